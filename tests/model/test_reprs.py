"""What nouns show of themselves: one line with counts."""

from __future__ import annotations

import numpy as np
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.model import FACET_TAGS
from femprep.phantoms import lv_ellipsoid
from femprep.report.run import Run


def test_nouns_show_one_line_with_counts() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    cells = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    surface = fp.Surface(points, cells, name="lv")
    assert repr(surface) == "Surface('lv': 4 points, 4 triangles)"
    tags = [FACET_TAGS[name] for name in ("base", "endo", "epi", "epi")]
    wall = fp.Wall(points, cells, tags, np.arange(4))
    assert repr(wall) == "Wall(4 points, 4 triangles: endo, epi, base)"
    mesh = truncated_ellipsoid("tetra")
    assert repr(mesh).startswith(
        f"VolumeMesh({len(mesh.points)} points, {mesh.n_cells} tetra, {mesh.n_facets} facets: lv"
    )
    labels = np.zeros((9, 8, 7), dtype=np.uint8)
    labels[3:6, 3:6, 2:5] = 3
    grid = fp.Grid(labels.shape, (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), np.eye(3))
    seg = fp.Segmentation(labels, grid, {"lv": (3,)})
    assert repr(seg) == "Segmentation(9 x 8 x 7 voxels of 1.5 x 1.5 x 8 mm: lv)"
    assert repr(grid) == "Grid(9 x 8 x 7 voxels of 1.5 x 1.5 x 8 mm)"
    plane = fp.Plane([0.0, -1e-17, 5.0], [0.0, 0.0, 2.0])
    assert repr(plane) == "Plane(point (0, -1e-17, 5) mm, normal (0, 0, 1); given)"
    cavity = seg.object("lv")
    assert repr(cavity) == "LabelObject('lv': 27 voxels, 0.486 mL)"
    quality = fp.check(mesh)
    assert repr(quality).startswith(f"QualityReport({len(mesh.points)} points, {mesh.n_cells} tetra, ")
    run = Run(seg, fp.Options(), {"lv": cavity}, {"lv": surface}, wall, mesh, quality, seconds={"surface": 2.0})
    assert repr(run).startswith("Run(lv: VolumeMesh(")
    assert repr(run).endswith(", 2.0 s)")
    assert all("\n" not in repr(noun) for noun in (surface, wall, mesh, seg, cavity, quality, run))
    nested = fp.Refinement.of(mesh, levels=1)
    assert repr(nested) == f"Refinement({mesh.n_cells} -> {8 * mesh.n_cells} elements)"


def test_nouns_of_a_heart_show_one_line() -> None:
    seg = lv_ellipsoid().segmentation(spacing=(1.8, 1.8, 9.0))
    assert repr(fp.estimate_shifts(seg)).startswith("SliceShifts(")
    axes = fp.ventricular_axes(seg)
    assert repr(axes).startswith(f"VentricularAxes({axes.length:.1f} mm from apex (")
    assert all(len(repr(noun)) < 120 and "\n" not in repr(noun) for noun in (fp.estimate_shifts(seg), axes))
