"""The heart in the wheel ``ansys-health-heart``: its labels at 1 mm and its true surfaces, mm LPS.

The mesh is after Rodero et al. 2021 (CC BY 4.0, doi 10.5281/zenodo.4590294), in a wheel of MIT licence:

    pip download ansys-health-heart==0.16.2 --no-deps && unzip ansys_health_heart-*.whl
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista as pv

from femprep.image import Grid, Segmentation
from femprep.mesh.topology import volume
from femprep.model import FloatArray, IntArray

#: Number of each closed cavity among the mesh's surfaces, and label of its voxels.
CAVITIES = {"lv": (1, 1), "rv": (2, 3), "la": (3, 5), "ra": (4, 7)}
#: Numbers of left ventricle and septum among the mesh's volumes, and label of their voxels.
MUSCLE, MUSCLE_LABEL = (1, 7), 2
VOXEL, MARGIN = 1.0, 10.0


def read_wheel_heart(path: Path) -> tuple[Segmentation, dict[str, tuple[FloatArray, IntArray]]]:
    """Labels of the left ventricle, its muscle and the other cavities, and the closed surfaces of the cavities."""
    mesh = pv.read(path)
    mesh.points = np.asarray(mesh.points, dtype=float) * [-1.0, -1.0, 1.0]
    kinds, numbers = np.asarray(mesh.celltypes), np.asarray(mesh.cell_data["_surface-id"])
    low, high = np.array(mesh.bounds)[::2] - MARGIN, np.array(mesh.bounds)[1::2] + MARGIN
    count = np.ceil((high - low) / VOXEL).astype(int) + 1
    voxels = pv.ImageData(dimensions=count, spacing=[VOXEL] * 3, origin=low)
    solid = mesh.extract_cells(np.flatnonzero(kinds == pv.CellType.TETRA))
    solid.clear_point_data()
    found = voxels.sample(solid)
    inside = np.asarray(found["vtkValidPointMask"]) > 0
    flat = np.where(inside & np.isin(np.asarray(found["_volume-id"]), MUSCLE), MUSCLE_LABEL, 0)
    labels = flat.reshape(count, order="F").astype(np.int64)
    surfaces = {}
    for name, (number, label) in CAVITIES.items():
        shell = mesh.extract_cells(np.flatnonzero((kinds == pv.CellType.TRIANGLE) & (numbers == number)))
        shell = pv.PolyData(shell.points, shell.cells).clean()
        points, cells = np.asarray(shell.points, dtype=float), np.asarray(shell.regular_faces)
        cells = cells if volume(points, cells) > 0 else cells[:, ::-1]
        surfaces[name] = (points, cells)
        faces = np.column_stack([np.full(len(cells), 3), cells]).ravel()
        mask = pv.PolyData(points, faces).voxelize_binary_mask(reference_volume=voxels)
        labels[np.asarray(mask["mask"]).reshape(count, order="F") > 0] = label
    structures = {"lv": (1,), "myo": (MUSCLE_LABEL,), "rv": (3,), "la": (5,), "ra": (7,)}
    return Segmentation(labels, Grid(labels.shape, [VOXEL] * 3, low, np.eye(3)), structures), surfaces
