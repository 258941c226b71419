"""Where the schemas lie, and that editors can use them."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from femprep.cli import main
from femprep.cli.schema import schema_texts


def test_the_installed_schemas_are_those_of_the_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--where"]) == 0
    folder = Path(capsys.readouterr().out.strip())
    for name, text in schema_texts().items():
        assert (folder / name).read_text() == text
        assert json.loads(text)["$id"] == f"urn:femprep:schema:{Path(name).stem}"


def test_a_file_of_options_is_judged_by_its_schema() -> None:
    judge = jsonschema.Draft202012Validator(json.loads(schema_texts()["options.json"]))
    good = 'preset = "acdc"\n[wall]\nminimum_thickness = 2.0\n[sweep]\nminimum_thickness = 1.5\n'
    assert judge.is_valid(tomllib.loads(good))
    assert not judge.is_valid(tomllib.loads("[wall]\nminimum_thicknes = 2.0\n"))
    assert not judge.is_valid(tomllib.loads("[wall]\nminimum_thickness = -2.0\n"))


def test_schemas_are_written_where_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", str(tmp_path / "new")]) == 0
    assert {path.name: path.read_text() for path in (tmp_path / "new").iterdir()} == schema_texts()


def test_the_wheel_takes_the_schemas_along() -> None:
    settings = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    wheel = settings["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert wheel["force-include"] == {"schemas": "femprep/schemas"}


def test_records_of_a_run_are_not_replaced_by_their_schemas(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "run.json").write_text('{"femprep": "0.1.0"}')
    assert main(["schema", str(tmp_path)]) == 2
    assert "holds 'run.json', no schema of femprep's" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["run.json"]
    (tmp_path / "run.json").unlink()
    for _ in range(2):  # its own are
        assert main(["schema", str(tmp_path)]) == 0
