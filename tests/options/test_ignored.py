"""Options that would be taken and ignored are refused, by Python and by the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

import femprep as fp
from femprep.cli import main
from femprep.options import Options, SweepOptions, VolumeOptions
from femprep.options.run import _READ_BY_ONE
from femprep.phantoms import lv_ellipsoid

SWEPT = {"mesher": "sweep"}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"sweep": {"element": "hexahedron"}}, r"sweep\.element, .* of mesher 'sweep'"),
        ({"sweep": {"layers": 3}}, r"sweep\.layers.*--mesher sweep"),
        ({"volume": {**SWEPT, "quality": "best"}}, r"volume\.quality, .* of mesher 'tetwild'"),
        ({"volume": {**SWEPT, "minimum_dihedral": 12.0}}, r"volume\.minimum_dihedral.*--mesher tetwild"),
        ({"wall": {"rv_wall_thickness": 4.0}}, r"wall\.rv_wall_thickness is for anatomy biv or whole-heart; lv has"),
        ({"anatomy": "biv", "wall": {"atrial_wall_thickness": 3.0}}, r"atrial_wall_thickness .* whole-heart; biv has"),
    ],
)
def test_what_the_mesher_or_the_anatomy_has_not_is_refused(given: dict, words: str) -> None:
    with pytest.raises(fp.OptionError, match=words):
        fp.mesh_segmentation(lv_ellipsoid().segmentation(), **given)


def test_what_both_meshers_read_is_taken_by_both() -> None:
    shared = {"edge_length": 4.0, "elements_through_wall": 3, "order": 2, "time_limit": 50.0}
    assert Options(volume={**shared, **SWEPT}, sweep={"element": "tetra"}).layers.layers == 3
    assert Options(volume=shared, wall={"minimum_thickness": 1.5}).volume.order == 2
    assert Options(anatomy="biv", wall={"rv_wall_thickness": 4.0}).wall.rv_wall_thickness == 4.0
    # All options written out, as run.json has them, are those of a run again.
    for options in (Options(), Options(volume=SWEPT)):
        assert Options(**options.model_dump()) == options


def test_every_option_named_exists() -> None:
    for group, kind in (("sweep", SweepOptions), ("volume", VolumeOptions)):
        assert set(_READ_BY_ONE[group]) <= set(kind.model_fields)


def test_the_command_line_says_which_mesher_has_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fp.write_segmentation(lv_ellipsoid().segmentation(), tmp_path / "map.nii.gz")
    maps = ["--structure", "lv=1", "--structure", "myo=2"]
    given = ["mesh", str(tmp_path / "map.nii.gz"), "-o", str(tmp_path / "out"), *maps]
    assert main([*given, "--element", "hexahedron"]) == 2
    assert "use --mesher sweep" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()
