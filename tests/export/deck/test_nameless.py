"""Numbers of a file without names: that they are taken for femprep's is told, where they are; ours have names."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from meshes import truncated_ellipsoid
from notices import reported

import femprep as fp
from femprep.model.tags import TAKEN


def foreign(path: Path, region: int, facet: int | None = None) -> Path:
    """A mesh that meshio writes to Medit, its elements and facets of one number each."""
    mesh = truncated_ellipsoid("tetra")
    blocks, tags = [("tetra", mesh.cells["tetra"])], [np.full(mesh.n_cells, region)]
    if facet is not None:
        blocks.append(("triangle", mesh.facets["triangle"]))
        tags.append(np.full(mesh.n_facets, facet))
    meshio.Mesh(mesh.points, blocks, cell_data={"medit:ref": tags}).write(path)
    return path


@pytest.mark.parametrize(
    ("region", "facet", "said"),
    [
        (2, None, "2 for rv"),
        (2, 101, "2 for rv, 101 for endo"),
        (70, 102, "102 for epi"),
        (70, 2, None),
        (0, 0, None),
    ],
)
def test_numbers_that_are_ours_are_told(region: int, facet: int | None, said: str | None, tmp_path: Path) -> None:
    mesh = fp.read_mesh(foreign(tmp_path / "a.mesh", region, facet))
    assert reported(mesh) == ([f"{TAKEN}: {said}"] if said else [])


def test_whoever_names_regions_by_their_place_takes_none(tmp_path: Path) -> None:
    mesh = fp.read_mesh(foreign(tmp_path / "a.mesh", 2))
    assert reported(mesh) == [f"{TAKEN}: 2 for rv"]
    found = fp.annotate(mesh).mesh
    assert set(found.region_names) == {"lv"}
    assert not [one for one in found.info["notices"] if one["what"].startswith(TAKEN)]


def test_names_in_comments_of_ours_are_read(tmp_path: Path) -> None:
    """Medit has none; another program's comments say nothing."""
    path = fp.write_mesh(truncated_ellipsoid("tetra"), tmp_path / "a.mesh")[0]
    assert not reported(fp.read_mesh(path))
    path.write_text(path.read_text().replace("# femprep volume mesh", "# a mesh"))
    (notice,) = reported(fp.read_mesh(path))
    assert notice.startswith(TAKEN)


@pytest.mark.parametrize("wrong", [2**31, -(2**31), 0.5])
def test_an_array_of_regions_that_holds_no_tags_is_told(wrong: float, tmp_path: Path) -> None:
    """One number made all regions 0, without a word."""
    mesh = truncated_ellipsoid("tetra")
    region = np.where(np.arange(mesh.n_cells) == 5, wrong, mesh.region)
    meshio.Mesh(mesh.points, [("tetra", mesh.cells["tetra"])], cell_data={"region": [region]}).write(tmp_path / "a.vtu")
    found = fp.read_mesh(tmp_path / "a.vtu")
    assert not found.region.any()
    assert reported(found) == ["regions are left out: region is not of whole numbers of 32 bits"]
    np.testing.assert_array_equal(found.cell_data["region"], region)
