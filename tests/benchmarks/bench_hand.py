"""The hand of every ACDC map, and how clearly its right ventricle tells it; prints counts and margins.

    python tests/benchmarks/bench_hand.py

All ACDC maps are stored mirrored. The clearness is the drift of the RV as a multiple of what chance gives with 95 %
confidence: -1 and less says mirrored, +1 and more says not. Needs FEMPREP_DATA.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from pathlib import Path

import numpy as np
from bench_acdc import cases

import femprep as fp


def main() -> None:
    """Maps that do not tell, then the counts and the distribution of the clearness."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    data = Path(os.environ["FEMPREP_DATA"])
    hands: Counter[bool | None] = Counter()
    clearness = []
    for case in cases(data):
        axes = fp.ventricular_axes(fp.read_segmentation(data / "acdc" / case["file"], preset="acdc"))
        hands[axes.mirrored] += 1
        clearness.append(axes.info["rv_drift_clearness"])
        if not axes.mirrored:
            print(f"{case['id']}  mirrored {axes.mirrored}  drift {axes.info['rv_drift_degrees']:6.1f} degrees  "
                  f"clearness {clearness[-1]:6.2f}")  # fmt: skip
    print(f"\n{hands[True]} mirrored, {hands[False]} not, {hands[None]} open")
    shares = (0, 5, 10, 25, 50, 75, 90, 95, 99, 100)
    for share, value in zip(shares, np.percentile(clearness, shares)):
        print(f"{share:4d} %  {value:7.2f}")


if __name__ == "__main__":
    main()
