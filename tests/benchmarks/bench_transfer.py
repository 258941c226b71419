"""Fields from diastole to systole of ACDC's hearts by coordinates, against the connectivity both share; a table.

    python tests/benchmarks/bench_transfer.py [--first N] [--count N] [--edge-length MM] [--csv FILE]

Both phases of a patient are swept with one connectivity, so that a node of the one is a node of the other: where the
coordinates put it instead is the error, beside the length of an edge. Fibres are held against those that the rule gives
in systole itself, and against those of diastole pushed along by the deformation between the two. Needs FEMPREP_DATA.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

import numpy as np
from rows import keep, shown

import femprep as fp
from femprep.anatomy.transfer.correspondence import paired
from femprep.anatomy.wall_parts import wall_parts
from femprep.model import FloatArray


def angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """Between directions, degrees."""
    return np.degrees(np.arccos(np.clip(np.abs(np.sum(a * b, axis=1)), 0.0, 1.0)))


def pushed(first: fp.VolumeMesh, second: fp.VolumeMesh) -> FloatArray:
    """Fibres of the first phase, moved and turned with their tetrahedra."""
    x, y = (mesh.points[mesh.cells["tetra"]] for mesh in (first, second))
    gradient = np.linalg.solve(x[:, 1:] - x[:, :1], y[:, 1:] - y[:, :1])  # rows: y = x F'
    found = np.einsum("ni,nij->nj", first.cell_data["fiber"], gradient)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def figures(name: str, first: fp.VolumeMesh, second: fp.VolumeMesh) -> dict[str, Any]:
    """Errors of one patient."""
    _, places = paired(first, second, wall_parts(first, "the source"), wall_parts(second, "the target")).places()
    off = np.linalg.norm(places - first.points, axis=1)
    moved = fp.transfer(first, second, ["fiber", "aha", "transmural"])
    record = moved.info["transfer"]
    fields = {(one["name"], one["on"]): one for one in record["fields"]}
    fibre = moved.cell_data["fiber"]
    rule, push = angles(fibre, second.cell_data["fiber"]), angles(fibre, pushed(first, second))
    upper = first.point_data["apicobasal"] > 0.2
    return {
        "case": name,
        "edge_mm": record["source_edge_mm"],
        "off_mean_mm": float(off.mean()),
        "off_95_mm": float(np.percentile(off, 95)),
        "off_largest_mm": float(off.max()),
        "off_edges": float(off.mean()) / record["source_edge_mm"],
        "off_95_above_apex_mm": float(np.percentile(off[upper], 95)),
        "back_mean_mm": record["place_back_mean_mm"],
        "back_95_mm": record["place_back_95_mm"],
        "back_largest_mm": record["place_back_largest_mm"],
        "fibre_rule_mean_deg": float(rule.mean()),
        "fibre_rule_95_deg": float(np.percentile(rule, 95)),
        "fibre_pushed_mean_deg": float(push.mean()),
        "fibre_back_mean_deg": fields["fiber", "elements"]["back_mean"],
        "aha_same_percent": 100.0 * float(np.mean(moved.cell_data["aha"] == second.cell_data["aha"])),
        "aha_back_percent": fields["aha", "elements"]["back_mean"],
    }


def main() -> None:
    """Print a line for each patient."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--edge-length", type=float, default=4.0)
    parser.add_argument("--csv", type=Path)
    given = parser.parse_args()
    rows = []
    for number in range(given.first, given.first + given.count):
        folder = Path(os.environ["FEMPREP_DATA"]) / "acdc" / "training" / f"patient{number:03d}"
        phases = [fp.read_segmentation(path, preset="acdc") for path in sorted(folder.glob("*_gt.nii.gz"))]
        found = fp.mesh_sequence(
            phases, volume={"edge_length": given.edge_length}, sweep={"element": "tetra"}, fibres={}
        )
        rows.append(figures(folder.name, found.runs[0].mesh, found.runs[1].mesh))
        print(shown(rows[-1]), flush=True)
    if given.csv:
        keep(rows, given.csv)


if __name__ == "__main__":
    main()
