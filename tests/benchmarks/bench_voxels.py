"""Both ventricles on cubic voxels of many sizes, as of CT: does the mesh pass, and how far is it from the labels.

A phantom whose labels end flat at its base, along the image's axes and turned, cut where femprep cuts it and in the
last slice of its labels::

    python tests/benchmarks/bench_voxels.py 0.5 0.6 0.75 1
"""

from __future__ import annotations

import argparse
import time

from scipy.spatial.transform import Rotation

import femprep as fp
from femprep.errors import FemprepError
from femprep.phantoms import biventricular

TURNS = {"straight": (0.0, 0.0, 0.0), "turned": (35.0, 20.0, 10.0)}


def outcome(seg: fp.Segmentation, offset: float) -> tuple[str, str, str]:
    """What came of a mesh, how far its worst surface is from the labels, in pixels and in mm."""
    try:
        run = fp.mesh_segmentation(seg, anatomy="biv", wall={"base_offset": offset})
    except FemprepError as error:
        return f"refused: {str(error)[:60]}", "-", "-"
    worst = max(run.quality.fidelity, key=lambda one: one.greatest_pixels)
    said = "passed" if run.quality.passed else f"{len(run.quality.failures)} checks failed"
    return said, f"{worst.greatest_pixels:.1f}", f"{worst.greatest_mm:.1f}"


def main() -> None:
    """Print a row of a table for each size, placement and cut."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("voxels", type=float, nargs="+")
    print("| voxels, mm | axes | base | came of it | farthest, pixels | mm | seconds |\n|---|---|---|---|---|---|---|")
    for voxel in parser.parse_args().voxels:
        for name, angles in TURNS.items():
            phantom = biventricular().moved(Rotation.from_euler("xyz", angles, degrees=True).as_matrix())
            seg = phantom.segmentation((voxel,) * 3)
            inward = sum(notice.amount or 0.0 for notice in fp.find_common_base(seg).notices if notice.kind == "moved")
            for cut, offset in (("last slice", -inward), ("2.5 mm within", 0.0)):
                start = time.perf_counter()
                said = " | ".join(outcome(seg, offset))
                print(f"| {voxel:g} | {name} | {cut} | {said} | {time.perf_counter() - start:.0f} |", flush=True)


if __name__ == "__main__":
    main()
