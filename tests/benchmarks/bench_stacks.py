"""A heart of CT seen as short-axis stacks: where both ventricles are cut, and what the mesh comes to, stack by stack.

    FEMPREP_DATA=... python tests/benchmarks/bench_stacks.py [--slices 5 8 10] [--offsets 0 0.25 0.5 0.75] [--csv FILE]

The labels of Rodero's heart at 1 mm are looked up, nearest voxel, in slices across the left ventricle's long axis, each
stack begun a part of a slice further on. Then ``mesh_segmentation`` of both ventricles with fibres, all else as the
command has it. "base" counts slices towards the apex from that of the left ventricle alone.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
from rows import keep, shown

import femprep as fp
from femprep.image import Grid, Segmentation
from femprep.image.long_axis import long_axis
from femprep.mesh.tangents import tangents

HEART = Path("rodero01") / "rodero01_4ch_1.0mm_label.nii.gz"
#: Pixel by slice distance, mm, and slices beyond the heart at either end.
PIXEL = {5.0: 1.2, 8.0: 1.4, 10.0: 1.5}
ROOM = 2


def stack(seg: Segmentation, distance: float, offset: float) -> Segmentation:
    """The labels in slices so far apart, mm, begun so much of a slice further on."""
    axis = long_axis(seg).direction
    axes = np.column_stack([*tangents(axis[None])[0], axis])
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    pixel = PIXEL.get(distance, 1.4)
    spacing = np.array([pixel, pixel, distance])
    held = seg.grid.to_world(np.argwhere(np.asarray(seg.labels) > 0)) @ axes
    low = held.min(axis=0) - ROOM * spacing - [0.0, 0.0, offset * distance]
    shape = np.ceil((held.max(axis=0) - low) / spacing).astype(int) + ROOM
    i, j, k = (int(n) for n in shape)
    grid = Grid((i, j, k), spacing, axes @ low, axes)
    places = grid.to_world(np.argwhere(np.ones((i, j, k), dtype=bool)))
    labels = seg.grid.values_at(seg.labels, seg.grid.to_index(places))
    return Segmentation(labels.reshape(i, j, k), grid, seg.structures)


def one(seg: Segmentation, distance: float, offset: float) -> dict[str, Any]:
    """Mesh one stack; how it ended."""
    row: dict[str, Any] = {"slices": distance, "offset": offset}
    seen, start = stack(seg, distance, offset), time.process_time()
    try:
        both, left = fp.find_common_base(seen), fp.find_base(seen)
        row["base"] = round(-left.signed_distance(both.point) / distance)
        run = fp.mesh_segmentation(seen, anatomy="biv", fibres={})
    except fp.FemprepError as error:
        row.update(
            status="refused" if isinstance(error, fp.InputError | fp.OptionError) else "without a mesh",
            outcome=str(error),
        )
    else:
        runs, measures = run.mesh.info["attempts"], run.quality.measures
        row.update(status="passed" if run.quality.passed else "failed", elements=run.mesh.n_cells, runs=len(runs))
        row["dihedral"] = round(measures["minimum_dihedral"].min, 1)
        row["outcome"] = "; ".join(run.quality.failures)
        row["seconds"] = sum(entry.get("processor_seconds") or 0.0 for entry in runs)
    row["seconds"] = round(time.process_time() - start + row.get("seconds", 0.0), 1)
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--slices", type=float, nargs="*", default=list(PIXEL), help="distances of slices, mm")
    parser.add_argument("--offsets", type=float, nargs="*", default=[0.0, 0.25, 0.5, 0.75], help="parts of a slice")
    parser.add_argument("--csv", type=Path, help="file for a line per stack")
    given = parser.parse_args()
    seg = fp.read_segmentation(Path(os.environ["FEMPREP_DATA"]) / HEART, preset="rodero")
    rows = []
    for distance in given.slices:
        for offset in given.offsets:
            rows.append(one(seg, distance, offset))
            print(shown(rows[-1]), flush=True)
            if given.csv:
                keep(rows, given.csv)
    for status in ("passed", "failed", "refused", "without a mesh"):
        print(f"{status}: {sum(row['status'] == status for row in rows)} of {len(rows)}")


if __name__ == "__main__":
    main()
