"""Names of others' regions and facets: unique in every file, and told where they are written otherwise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.cli import main
from femprep.export.deck.names import facet_names, region_names, renamed
from femprep.export.table import FORMATS

LONG = "n" * 200
#: Formats whose files keep names as they were for femprep's own reader.
KEPT = ("vtu", "dolfinx", "fenics")


def named(regions: list[str], facets: list[str]) -> fp.VolumeMesh:
    """A mesh of two regions and facets whose names a file brought along."""
    mesh = truncated_ellipsoid("tetra")
    region = np.where(mesh.region == mesh.region[0], 51, 52)
    region[::2] = 52
    facet_tag = 201 + np.arange(mesh.n_facets) % len(facets)
    info = {
        "tag_names": {name: 51 + i for i, name in enumerate(regions)},
        "facet_tag_names": {name: 201 + i for i, name in enumerate(facets)},
    }
    return replace(mesh, region=region, facet_tag=facet_tag, info=info)


def counts(mesh: fp.VolumeMesh) -> tuple[dict[str, int], dict[str, int]]:
    """Elements of each region, facets of each name."""
    return (
        {name: int(np.sum(mesh.region == tag)) for name, tag in mesh.region_names.items()},
        {name: int(np.sum(mesh.facet_tag == tag)) for name, tag in mesh.facet_names.items()},
    )


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize(
    ("regions", "facets", "written"),
    [
        (["left", "right"], ["left", "lid"], ["left", "right", "left_201", "lid"]),
        ([LONG + "1", LONG + "2"], ["a"], ["n" * 60, "n" * 57 + "_52", "a"]),
        (["мышца", "Herzmuskel-ß"], ["gauche é", "心筋"], ["set_51", "Herzmuskel_ss", "gauche_e", "set_202"]),
        (["Wall", "WALL"], ["wall"], ["Wall", "WALL_52", "wall_201"]),
    ],
)
def test_no_file_loses_a_name_to_another(
    regions: list[str], facets: list[str], written: list[str], name: str, tmp_path: Path
) -> None:
    mesh = named(regions, facets)
    assert [*region_names(mesh), *facet_names(mesh)] == written
    filename = Path(FORMATS[name].filename).name
    fp.write_mesh(mesh, tmp_path / filename, format=name)
    found = counts(fp.read_mesh(tmp_path / filename))
    own = counts(mesh)
    if name not in KEPT:
        own = tuple(dict(zip(names, one.values())) for names, one in zip((written[:2], written[2:]), own))
    assert found == own


def test_what_is_written_under_another_name_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = named(["LV free wall", "rest"], ["a,b"])
    fp.write_mesh(mesh, tmp_path / "a.vtu")
    main(["convert", str(tmp_path / "a.vtu"), str(tmp_path / "a.inp")])
    said = "names are changed to such as every format holds: 'LV free wall' as 'LV_free_wall', 'a,b' as 'a_b'"
    assert f"note: {said}" in capsys.readouterr().out.splitlines()
    (many,) = renamed(named(["a", "b"], [f"no. {i}" for i in range(15)]))
    assert many.what.endswith("'no. 9' as 'no_9' and 5 more")


def test_names_that_every_format_holds_are_told_of_nothing() -> None:
    assert renamed(truncated_ellipsoid("tetra")) == []
    mesh = truncated_ellipsoid("tetra")
    numbers = replace(mesh, region=mesh.region * 0, facet_tag=mesh.facet_tag * 0)
    assert renamed(numbers) == []
    assert [*region_names(numbers), *facet_names(numbers)] == ["tag_0", "tag_0"]
