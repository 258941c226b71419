"""Names that stand in a file beside the mesh, and numbers that a file uses twice."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from biventricular import biventricular

import femprep as fp
from femprep.annotation.shell import shell_of
from femprep.export.foreign import from_meshio
from femprep.mesh.numbering import set_numbers
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh

THEIRS = {
    "endo_lv": (7001, "Left ventricle endocardium"),
    "endo_rv": (7002, "Right ventricle septum"),
    "epi": (7003, "Left ventricle epicardium"),
    "base": (7004, "interface_left-ventricle-myocardium_mitral-valve-plane"),
}


def published(folder: Path) -> tuple[Path, VolumeMesh]:
    """A mesh as PyAnsys Heart writes them: numbers in the file, names beside it."""
    truth = biventricular()
    own = {FACET_TAGS[name]: number for name, (number, _) in THEIRS.items()}
    tag = np.array([own[t] for t in truth.facet_tag.tolist()])
    count = truth.n_cells
    meshio.Mesh(
        truth.points,
        [("tetra", truth.cells["tetra"]), ("triangle", truth.facets["triangle"])],
        cell_data={
            "_surface-id": [np.full(count, np.nan), tag.astype(float)],
            "_volume-id": [np.full(count, 1), np.zeros(len(tag), dtype=int)],
        },
    ).write(folder / "heart.vtu")
    return folder / "heart.vtu", truth


def test_names_beside_a_mesh_are_read_and_taken(tmp_path: Path) -> None:
    path, truth = published(tmp_path)
    names = {
        "_surface_id_to_name": {str(number): name for number, name in THEIRS.values()} | {"1": "Left ventricle cavity"},
        "_volume_id_to_name": {"1": "Left ventricle"},
    }
    (tmp_path / "heart.namemap.json").write_text(json.dumps(names))
    found = fp.annotate(fp.read_mesh(path), fibres=None)
    assert found.attempts[0].way == "names"
    assert set(found.mesh.facet_names) == {"endo_lv", "endo_rv", "epi", "mitral"}
    assert set(found.mesh.region_names) == {"lv"}
    shell = shell_of(found.mesh)
    number = set_numbers(shell.facets["triangle"], truth.facets["triangle"])
    want = dict(zip(number[len(shell) :].tolist(), truth.facet_tag.tolist()))
    wanted = np.array([want[n] for n in number[: len(shell)].tolist()])
    wanted[wanted == FACET_TAGS["base"]] = FACET_TAGS["mitral"]
    np.testing.assert_array_equal(found.mesh.facet_tag, wanted)


def test_a_surface_and_a_volume_of_one_name(tmp_path: Path) -> None:
    path, _ = published(tmp_path)
    names = {"_surface_id_to_name": {"7003": "Left ventricle"}, "_volume_id_to_name": {"1": "Left ventricle"}}
    (tmp_path / "heart.namemap.json").write_text(json.dumps(names))
    found = fp.read_mesh(path)
    assert list(found.region_names) == ["Left ventricle"]
    assert "Left ventricle" in found.facet_names
    assert found.facet_names["Left ventricle"] != found.region_names["Left ventricle"]


def test_without_them_geometry_tells(tmp_path: Path) -> None:
    found = fp.annotate(fp.read_mesh(published(tmp_path)[0]), fibres=None)
    assert set(found.mesh.facet_names) == {"endo_lv", "endo_rv", "epi", "base"}


@pytest.mark.parametrize("text", ["{", "[]", '{"_surface_id_to_name": {"one": "base"}}'])
def test_damaged_names_are_told_in_one_line(text: str, tmp_path: Path) -> None:
    path, _ = published(tmp_path)
    (tmp_path / "heart.namemap.json").write_text(text)
    with pytest.raises(fp.FileError, match=r"heart\.namemap\.json. is no table of numbers and names"):
        fp.read_mesh(path)


def test_a_number_that_is_ours_of_another_name_makes_no_two_regions_one() -> None:
    truth = biventricular()
    third = np.arange(truth.n_cells) % 3
    mesh = meshio.Mesh(
        truth.points,
        [("tetra", truth.cells["tetra"]), ("triangle", truth.facets["triangle"])],
        cell_data={"gmsh:physical": [np.array([3, 7, 1])[third], np.ones(truth.n_facets, dtype=int)]},
        field_data={"left atrium": np.array([3, 3]), "septum": np.array([7, 3]), "muscle": np.array([1, 3])}
        | {"skin": np.array([1, 2])},
    )
    read = from_meshio(mesh)
    assert len(np.unique(read.region)) == 3
    np.testing.assert_array_equal(read.region == REGION_TAGS["septum"], third == 1)
    names = {number: name for name, number in read.info["tag_names"].items()}
    assert {names.get(int(t)) for t in np.unique(read.region)} == {"left atrium", "muscle", None}
    assert {names[int(t)] for t in np.unique(read.facet_tag)} == {"skin"}


def test_names_of_the_file_stand_where_regions_would_place_rings_anew() -> None:
    truth = biventricular()
    named = fp.annotate(VolumeMesh(truth.points, truth.cells, np.ones(truth.n_cells)), fibres=None).mesh
    # The left ventricle's upper half is called its atrium: where both meet a ring would be placed.
    middle = truth.points[truth.cells["tetra"]].mean(axis=1)[:, 2]
    above = (named.region == REGION_TAGS["lv"]) & (middle > np.median(middle))
    region = np.where(above, 90, named.region + 70)
    mesh = replace(truth, region=region.astype(np.int32))
    names = {"90": "la", "71": "lv", **{str(tag): name for name, tag in truth.facet_names.items()}}
    found = fp.annotate(mesh, names=names, fibres=None)
    assert set(found.mesh.facet_names) == {"endo_lv", "endo_rv", "epi", "base"}
