"""What a format is said to leave out of a mesh is what does not come back from its file, and no more."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import numpy as np
import pytest
from meshes import truncated_ellipsoid

from femprep.cli import main
from femprep.export import FORMATS, read_mesh, write_mesh
from femprep.export.deck.springs import NEEDED, RING
from femprep.export.losses import losses
from femprep.model import VolumeMesh

KINDS = ("cell_data", "point_data", "facet_data")
#: What a file holds in another way: across fibre and sheet, as springs, sets of nodes, or ventricular coordinates; and
#: the user's own fields, which other programs read from it.
OTHERWISE = {"normal", *NEEDED, RING, "apicobasal", "transmural", "rotational", "stiffness", "drift", "time"}


def with_all() -> VolumeMesh:
    """A mesh with data of every kind."""
    mesh = truncated_ellipsoid("tetra", heights=2, around=6, layers=1)
    count, points, facets = mesh.n_cells, len(mesh.points), mesh.n_facets
    axes = {name: np.tile(row, (count, 1)) for name, row in zip(("fiber", "sheet", "normal"), np.eye(3))}
    places = dict.fromkeys(("apicobasal", "transmural", "rotational"), np.full(points, 0.5))
    held = {"pericardium": np.ones(points), "pericardium_area": np.ones(points)}
    held |= {"pericardium_normal": np.ones((points, 3)), RING: np.ones(points)}
    return mesh.with_data(
        cell={**axes, "aha": np.ones(count, np.int32), "stiffness": np.ones(count), "drift": np.ones((count, 3))},
        point={**places, **held, "time": np.ones(points)},
        facet={"aha": np.ones(facets, np.int32), "pressure": np.ones(facets)},
    )


@pytest.mark.parametrize("name", FORMATS)
def test_data_that_are_left_out_are_told(name: str, tmp_path: Path) -> None:
    mesh, file = with_all(), tmp_path / PurePosixPath(FORMATS[name].filename).name
    write_mesh(mesh, file, format=name)
    back = read_mesh(file)
    told = "; ".join(notice.what for notice in losses(mesh, name))
    for kind, what in zip(KINDS, ("elements", "points", "facets")):
        named = set(told.partition(f"of {what} (")[2].partition(")")[0].split(", ")) - {""}
        gone = set(getattr(mesh, kind)) - set(getattr(back, kind))
        assert named <= gone
        assert gone - named <= OTHERWISE


@pytest.mark.parametrize(
    ("kind", "file", "format", "told"),
    [
        ("tetra10", "lv.mesh", None, "the medit files hold elements without their mid-side nodes"),
        ("hexahedron", "lv", "fenics", "the fenics files hold hexahedron cut into linear tetrahedra"),
        ("tetra", "lv.msh", None, "the gmsh files leave out data of elements (fiber, aha); those of vtu hold them"),
    ],
)
def test_convert_tells_what_is_left_out(
    kind: str, file: str, format: str | None, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh = truncated_ellipsoid(kind, heights=2, around=6, layers=1)
    fibres = {"fiber": np.tile((1.0, 0.0, 0.0), (mesh.n_cells, 1)), "aha": np.ones(mesh.n_cells, np.int32)}
    write_mesh(mesh.with_data(cell=fibres), tmp_path / "in.vtu")
    words = ["convert", str(tmp_path / "in.vtu"), str(tmp_path / file), *(["--format", format] if format else [])]
    assert main(words) == 0
    assert f"note: {told}" in capsys.readouterr().out
    assert main([*words, "-q"]) == 0
    assert capsys.readouterr().out == ""
