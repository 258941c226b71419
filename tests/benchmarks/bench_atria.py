"""Fibres of the atria of a published whole heart: bundles, thickness of walls, how far fibres turn between neighbours.

The heart is that of ``bench_annotate.py``, bare but for the numbers of its volumes::

    python tests/benchmarks/bench_atria.py ansys/health/heart/data_examples/rodero_01_fullheart_2.0mm.vtu
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pyvista

import femprep as fp
from femprep.model import VolumeMesh
from femprep.volume.ventricles import neighbours


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", type=Path)
    parser.add_argument("-o", "--output", type=Path, help="write the mesh here")
    arguments = parser.parse_args()
    file = pyvista.read(arguments.mesh)
    tetra = file.cells_dict[10].astype(np.int64)
    volume = file.cell_data["_volume-id"][file.celltypes == 10].astype(int)
    mesh = VolumeMesh(np.asarray(file.points, dtype=float), {"tetra": tetra}, volume + 10)
    found = fp.annotate(mesh, fibres={"atria": "piersanti"})
    print("seconds:", {name: round(own, 1) for name, own in found.seconds.items()})
    print(json.dumps(found.mesh.info["atria"], indent=1))
    bundle, fibre = (np.asarray(found.mesh.cell_data[name]) for name in ("atrial_bundle", "fiber"))
    one, other = neighbours(found.mesh).T
    same = (bundle[one] == bundle[other]) & (bundle[one] > 0)
    cosine = np.abs(np.einsum("ij,ij->i", fibre[one[same]], fibre[other[same]]))
    angle = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
    print(f"neighbours in a bundle turn by {np.percentile(angle, [50, 90, 99]).round(1)} degrees (50, 90, 99 %)")
    if arguments.output:
        fp.write_mesh(found.mesh, arguments.output)


if __name__ == "__main__":
    main()
