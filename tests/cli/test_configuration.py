"""Options from file and command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from femprep.cli._configuration import parse_objects, parse_structures, parse_valves, read_options
from femprep.errors import FileError, OptionError
from femprep.options import Options


def test_command_line_wins_over_file(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text('preset = "acdc"\n[surface]\nvertices = 900\n[volume]\nedge_length = 3.0\n')
    options = read_options(path, surface__vertices=800, volume__time_limit=None)
    assert (options.surface.vertices, options.volume.edge_length) == (800, 3.0)
    assert options.labels == {"rv": (1,), "myo": (2,), "lv": (3,)}


def test_structures_of_file_and_command_line_are_merged(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("structures = {lv = 1, myo = [2, 4]}\n")
    assert read_options(path, structures={"lv": (3,)}).labels == {"lv": (3,), "myo": (2, 4)}


def test_a_file_with_the_mark_of_windows_in_front(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("[volume]\nedge_length = 3.0\n", encoding="utf-8-sig")
    assert read_options(path).volume.edge_length == 3.0


def test_nothing_given_is_the_defaults() -> None:
    assert read_options(None) == Options()


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("edge = 3", OptionError, "unknown option 'edge'"),
        ("[volume]\nedge_length = -1.0", OptionError, "volume.edge_length.*-1.0.*greater than 0"),
        ("[volume]\nedge_lenght = 1.0", OptionError, "unknown option 'volume.edge_lenght'"),
        ("surface = 3", OptionError, "surface"),
        ('preset = "acdcc"', OptionError, "preset.*acdcc.*expected one of acdc"),
        ("[volume", FileError, "not valid TOML"),
        ("x = " + "[" * 3000, FileError, "nested too deeply"),
    ],
)
def test_wrong_file_is_one_line(tmp_path: Path, text: str, error: type[Exception], words: str) -> None:
    path = tmp_path / "a.toml"
    path.write_text(text)
    with pytest.raises(error, match=words) as caught:
        read_options(path)
    assert "\n" not in str(caught.value)


def test_a_mark_before_the_text_is_taken(tmp_path: Path) -> None:
    config = tmp_path / "run.toml"
    config.write_bytes(b"\xef\xbb\xbf[volume]\r\nedge_length = 2.0\r\n")
    assert read_options(config).volume.edge_length == 2.0


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="cannot be read"):
        read_options(tmp_path / "none.toml")


def test_structures_are_parsed() -> None:
    assert parse_structures(["lv=3", "myo=2,4"]) == {"lv": (3,), "myo": (2, 4)}
    assert parse_structures(["lv=Left ventricle"]) == {"lv": ("Left ventricle",)}  # a segment's name
    assert parse_structures(None) is None


@pytest.mark.parametrize("item", ["lv", "lv=", "=3", "lv=1,,2"])
def test_wrong_structure_is_refused(item: str) -> None:
    with pytest.raises(OptionError, match="--structure"):
        parse_structures([item])


def test_objects_by_default_and_by_hand() -> None:
    labels = {"rv": (1,), "myo": (2,), "lv": (3,)}
    assert parse_objects(None, labels) == {"rv": ("rv",), "lv": ("lv",), "epi": ("lv", "myo")}
    assert parse_objects(["both=lv+rv", "lv"], labels) == {"both": ("lv", "rv"), "lv": ("lv",)}
    with pytest.raises(OptionError, match="'la'"):
        parse_objects(["x=la"], labels)


def test_valves_are_parsed() -> None:
    assert parse_valves(["mitral=1,2,3,0,0,1,12.5"]) == {"mitral": (1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 12.5)}
    assert parse_valves(None) is None


@pytest.mark.parametrize("item", ["mitral", "mitral=1,2,3", "mitral=1,2,3,0,0,1,x", "mitral=1,2,3,0,0,1,nan"])
def test_wrong_valve_is_refused(item: str) -> None:
    with pytest.raises(OptionError, match="--valve"):
        parse_valves([item])


def test_a_valve_is_given_once() -> None:
    with pytest.raises(OptionError, match="--valve aortic is given twice"):
        parse_valves(["aortic=1,2,3,0,0,1,9"] * 2)


def test_valves_belong_to_the_whole_heart() -> None:
    assert read_options(None, anatomy="whole-heart", wall__openings="labels").wall.openings == "labels"
    with pytest.raises(OptionError, match="anatomy lv is cut at its base plane"):
        read_options(None, wall__openings="labels")
