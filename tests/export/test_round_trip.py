"""Every format gives back what was written into it, and leaves the mesh alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid, with_fibres
from same_mesh import assert_same, copies

from femprep.export import FORMATS, read_mesh, write_mesh
from femprep.mesh.elements import ELEMENTS
from femprep.model import VolumeMesh, with_verdict
from femprep.options import CheckOptions
from femprep.volume import check
from femprep.volume.quality.judged import carry

KINDS = [*ELEMENTS, "mixed"]
LINEAR = ("tetra", "wedge", "hexahedron", "mixed")


def mesh_of(kind: str) -> VolumeMesh:
    mesh = with_fibres(mixed() if kind == "mixed" else truncated_ellipsoid(kind, curved=True))
    return mesh.with_data(cell={"aha": np.arange(mesh.n_cells, dtype=np.int32) % 17 + 1})


@dataclass(frozen=True)
class Case:
    """How exactly a format gives a mesh back."""

    format: str
    filename: str
    kinds: tuple[str, ...] = tuple(KINDS)
    data: tuple[str, ...] = ("fiber", "sheet", "aha")
    tolerance: float = 0.0
    data_tolerance: float = 0.0
    by_region: bool = False


CASES = [
    Case("vtu", "lv.vtu"),
    # Twenty characters hold every number but the last digits of those below 0.01.
    Case("abaqus", "lv.inp", tolerance=1e-15, data_tolerance=1e-15),
    Case("gmsh", "lv.msh", data=()),
    Case("gmsh41", "lv.msh", by_region=True),
    Case("dolfinx", "mesh.xdmf", kinds=("tetra", "tetra10", "hexahedron")),
    Case("fenics", "mesh.xdmf", kinds=("tetra",)),
    Case("med", "lv.med"),
    Case("medit", "lv.mesh", kinds=LINEAR),
    Case("febio", "lv.feb", by_region=True),
    Case("opencarp", "lv.pts", kinds=LINEAR, tolerance=1e-13),  # micrometres: a number is multiplied and divided
    Case("opencarp-binary", "lv.bpts", kinds=LINEAR, tolerance=4e-6, data_tolerance=1e-7),  # single precision
    Case("svmultiphysics", "lv"),
    # Sixteen characters a coordinate, a number of a direction.
    Case("ls-dyna", "lv.k", kinds=(*LINEAR, "tetra10"), tolerance=1e-10, data_tolerance=1e-13),
]


@pytest.mark.parametrize(("case", "kind"), [pytest.param(c, k, id=f"{c.format}-{k}") for c in CASES for k in c.kinds])
def test_everything_comes_back(case: Case, kind: str, tmp_path: Path) -> None:
    mesh = mesh_of(kind)
    before = copies(mesh)
    written = write_mesh(mesh, tmp_path / case.filename, format=case.format)
    assert sorted(written) == sorted(tmp_path.iterdir())
    assert (tmp_path / case.filename).exists()
    back = read_mesh(tmp_path / case.filename)
    assert_same(
        back,
        mesh,
        tolerance=case.tolerance,
        data=case.data,
        data_tolerance=case.data_tolerance,
        by_region=case.by_region,
    )
    assert copies(mesh) == before


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.format)
def test_writing_again_gives_the_same_bytes(case: Case, tmp_path: Path) -> None:
    mesh = mesh_of("tetra")
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        write_mesh(mesh, tmp_path / folder / case.filename, format=case.format)
    names = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file())
    assert names
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_no_format_is_left_out() -> None:
    assert {case.format for case in CASES} == set(FORMATS)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.format)
@pytest.mark.parametrize("unit", ["cm", "m"])
def test_units_are_named_where_the_file_can_and_read_back(case: Case, unit: str, tmp_path: Path) -> None:
    mesh = mesh_of("tetra")
    write_mesh(mesh, tmp_path / case.filename, format=case.format, length_unit=unit)
    back = read_mesh(tmp_path / case.filename)
    # Metres need an exponent in a field of 20 characters: 13 digits are left; of 16 characters, 9.
    digits = {"ls-dyna": 1e-9, "opencarp-binary": 1e-7}.get(case.format, 1e-13)
    np.testing.assert_allclose(back.points, mesh.points, rtol=digits, atol=10 * digits)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.format)
def test_the_limits_a_mesh_was_judged_by_come_back(case: Case, tmp_path: Path) -> None:
    line = 'no "base" -- try --openings; <b>'
    mesh = carry(
        mesh_of("tetra"), CheckOptions(purpose="explicit", mean_of_mean_ratio=0.1, minimum_dihedral=None), "sweep"
    )
    mesh = with_verdict(mesh, failures={"fibres": [f"fibres: {line}"]})
    write_mesh(mesh, tmp_path / case.filename, format=case.format)
    back = read_mesh(tmp_path / case.filename)
    if case.format.startswith("opencarp"):  # its files have no room for comments
        assert "minimum_dihedral" not in {one.name for one in check(back).limits}
        assert "minimum_dihedral" in {one.name for one in check(back, purpose="general").limits}
        return
    assert back.info["verdict"] == mesh.info["verdict"]
    one, other = check(mesh), check(back)
    assert (other.options, other.limits_from) == (one.options, one.limits_from)
    assert f"fibres: {line}" in other.failures


def test_the_verdict_goes_on_through_further_formats(tmp_path: Path) -> None:
    """Judged, written as a deck, read, written as VTK, read: as from the first file."""
    mesh = carry(mesh_of("tetra"), CheckOptions(mean_of_mean_ratio=0.2, maximum_dihedral=175.0), "tetwild")
    write_mesh(mesh, tmp_path / "one.inp")
    write_mesh(read_mesh(tmp_path / "one.inp"), tmp_path / "two.vtu")
    assert check(read_mesh(tmp_path / "two.vtu")).options == check(mesh).options


def test_vtu_keeps_every_array_and_record(tmp_path: Path) -> None:
    from femprep.model import Plane

    mesh = truncated_ellipsoid("wedge15", curved=True)
    mesh = replace(
        with_fibres(mesh).with_data(
            cell={"aha": np.arange(mesh.n_cells, dtype=np.int32) % 17 + 1, "thick": np.linspace(0, 1, mesh.n_cells)},
            point={"depth": mesh.points[:, 2].copy(), "frame": np.ones((len(mesh.points), 9))},
            facet={"curvature": np.linspace(-1, 1, mesh.n_facets)},
        ),
        planes={"base": Plane(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.6, 0.8]), "labels")},
        info={"mesher": "sweep", "notices": ["one"], "nested": {"seconds": 0.1}},
    )
    write_mesh(mesh, tmp_path / "mesh.vtu")
    back = read_mesh(tmp_path / "mesh.vtu")
    for group in ("cells", "facets", "cell_data", "point_data", "facet_data"):
        one, other = getattr(mesh, group), getattr(back, group)
        assert list(one) == list(other)
        for name in one:
            assert np.asarray(one[name]).dtype == np.asarray(other[name]).dtype, name
            assert np.array_equal(one[name], other[name]), name
    assert np.array_equal(back.facet_tag, mesh.facet_tag)
    assert back.info == mesh.info
    assert np.array_equal(back.planes["base"].point, mesh.planes["base"].point)
    assert np.array_equal(back.planes["base"].normal, mesh.planes["base"].normal)
    assert back.planes["base"].source == "labels"


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.format)
def test_names_that_are_not_ours_are_kept(case: Case, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    mesh = replace(
        mesh,
        region=np.where(mesh.region == 3, 61, mesh.region),
        facet_tag=np.where(mesh.facet_tag == 104, 301, mesh.facet_tag),
        info={"tag_names": {"Scar_core": 61, "Inlet": 301}},
    )
    write_mesh(mesh, tmp_path / case.filename, format=case.format)
    back = read_mesh(tmp_path / case.filename)
    assert set(back.region_names) == {"lv", "Scar_core"}
    assert set(back.facet_names) == {"endo", "epi", "base", "Inlet"}
    assert np.count_nonzero(back.region == back.region_names["Scar_core"]) == np.count_nonzero(mesh.region == 61)
    assert "notices" not in back.info
