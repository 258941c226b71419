"""Nouns as objects of other libraries: every point, cell, tag and name comes along."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid

import femprep as fp
from femprep.errors import InputError, MissingDependencyError
from femprep.export.foreign import Block, ForeignMesh, from_meshio
from femprep.model import FACET_TAGS

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def wall() -> fp.Wall:
    tags = [FACET_TAGS["base"], FACET_TAGS["endo"], FACET_TAGS["epi"], FACET_TAGS["epi"]]
    return fp.Wall(CORNERS, TETRAHEDRON, tags, np.arange(4))


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge", "hexahedron", "hexahedron20", "mixed"])
def test_meshio_gives_back_the_same_mesh(kind: str) -> None:
    mesh = mixed() if kind == "mixed" else truncated_ellipsoid(kind)
    back = from_meshio(mesh.to_meshio())
    np.testing.assert_array_equal(back.points, mesh.points)
    assert list(back.cells) == list(mesh.cells)
    assert all(np.array_equal(back.cells[name], block) for name, block in mesh.cells.items())
    assert all(np.array_equal(back.facets[name], block) for name, block in mesh.facets.items())
    np.testing.assert_array_equal(back.region, mesh.region)
    np.testing.assert_array_equal(back.facet_tag, mesh.facet_tag)
    assert back.facet_names == mesh.facet_names


def test_pyvista_holds_data_and_volume() -> None:
    mesh = truncated_ellipsoid("tetra").with_data(point={"depth": np.arange(180.0)})
    grid = mesh.to_pyvista()
    assert grid.n_cells == mesh.n_cells
    np.testing.assert_array_equal(grid.cell_data["region"], mesh.region)
    np.testing.assert_array_equal(grid.point_data["depth"], np.arange(180.0))
    assert grid.volume == pytest.approx(fp.check(mesh).volume)
    np.testing.assert_array_equal(wall().to_pyvista().cell_data["facet_tag"], wall().facet_tag)
    assert fp.Surface(CORNERS, TETRAHEDRON).to_pyvista().volume == pytest.approx(1.0 / 6.0)


def test_surfaces_and_walls_in_meshio() -> None:
    assert len(fp.Surface(CORNERS, TETRAHEDRON).to_meshio().cells_dict["triangle"]) == 4
    found = wall().to_meshio()
    np.testing.assert_array_equal(found.cell_data["facet_tag"][0], wall().facet_tag)
    assert set(found.field_data) == {"base", "endo", "epi"}


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "hexahedron"])
def test_skfem_has_the_same_volumes_areas_and_names(kind: str) -> None:
    skfem = pytest.importorskip("skfem")
    mesh = truncated_ellipsoid(kind)
    found = mesh.to_skfem()
    own = skfem.ElementHex1() if kind == "hexahedron" else skfem.ElementTetP1()
    one = skfem.Functional(lambda w: 1.0 + 0.0 * w.x[0])
    report = fp.check(mesh)
    for name, tag in mesh.region_names.items():
        assert len(found.subdomains[name]) == np.count_nonzero(mesh.region == tag)
        volume = one.assemble(skfem.CellBasis(found, own, elements=name))
        assert volume == pytest.approx(report.regions[name].volume, rel=1e-9)
    assert set(found.boundaries) == set(mesh.facet_names)
    for name, tag in mesh.facet_names.items():
        numbers = np.asarray(found.boundaries[name])
        assert len(numbers) == np.count_nonzero(mesh.facet_tag == tag)
        assert (found.f2t[1, numbers] == -1).all()
        if kind == "tetra":
            area = one.assemble(skfem.FacetBasis(found, own, facets=numbers))
            a, b, c = (mesh.points[mesh.facets["triangle"][mesh.facet_tag == tag][:, i]] for i in range(3))
            assert area == pytest.approx(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum(), rel=1e-9)


def test_skfem_refuses_several_types_and_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="one type of tetra, tetra10, hexahedron, and this mesh has"):
        mixed().to_skfem()
    monkeypatch.setitem(sys.modules, "skfem", None)  # type: ignore[arg-type]
    with pytest.raises(MissingDependencyError, match="pip install scikit-fem"):
        truncated_ellipsoid("tetra").to_skfem()


def test_plot_colours_by_tags_and_passes_keywords_on(monkeypatch: pytest.MonkeyPatch) -> None:
    import pyvista

    asked = []
    monkeypatch.setattr(pyvista.DataSet, "plot", lambda self, **given: asked.append(given))
    truncated_ellipsoid("tetra").plot(off_screen=True)
    wall().plot(show_edges=False)
    fp.Surface(CORNERS, TETRAHEDRON).plot()
    assert asked == [
        {"show_edges": True, "scalars": "region", "off_screen": True},
        {"show_edges": False, "scalars": "facet_tag"},
        {"show_edges": True},
    ]


def test_meshio_has_the_data_of_elements_and_of_facets_under_one_name() -> None:
    mesh = truncated_ellipsoid("tetra")
    mesh = mesh.with_data(cell={"aha": np.full(mesh.n_cells, 7)}, facet={"aha": np.arange(1, mesh.n_facets + 1)})
    back = from_meshio(mesh.to_meshio())
    np.testing.assert_array_equal(back.cell_data["aha"], mesh.cell_data["aha"])
    np.testing.assert_array_equal(back.facet_data["aha"], mesh.facet_data["aha"])


@pytest.mark.parametrize(
    ("points", "nodes", "match"),
    [
        (CORNERS, [[0, 1, 2, 2.5]], "cells 'tetra' holds 2.5, expected whole numbers"),
        (CORNERS + 1j, [[0, 1, 2, 3]], "points holds no real numbers but complex128"),
    ],
)
def test_what_meshio_holds_is_not_cut_to_what_fits(points: np.ndarray, nodes: list[list[float]], match: str) -> None:
    """Fractions became whole numbers, and the imaginary part was dropped."""
    with pytest.raises(InputError, match=match):
        from_meshio(ForeignMesh(points, [Block("tetra", np.array(nodes))]))
