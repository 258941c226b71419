"""The least thickness of the wall is one option, whichever mesher fills the wall."""

from __future__ import annotations

from pathlib import Path

from femprep.cli._configuration import read_options
from femprep.options import Options, SweepOptions


def test_the_command_lines_option_reaches_the_sweep() -> None:
    options = read_options(None, volume__mesher="sweep", wall__minimum_thickness=3.5)
    assert options.layers.minimum_thickness == 3.5
    assert Options(wall={"maximum_push": 2.0}).layers.maximum_push == 2.0


def test_the_sweeps_own_name_still_wins(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("[sweep]\nminimum_thickness = 2.0\n[wall]\nmaximum_push = 5.0\n")
    layers = read_options(path, wall__minimum_thickness=3.5).layers
    assert (layers.minimum_thickness, layers.maximum_push) == (2.0, 5.0)


def test_default_and_range_stand_once() -> None:
    assert Options().layers.minimum_thickness == SweepOptions().minimum_thickness == Options().wall.minimum_thickness
