"""How the command line starts: quickly, with help, with the version."""

from __future__ import annotations

import subprocess
import sys

import pytest

from femprep import __version__
from femprep.cli import main
from femprep.cli._app import COMMANDS, load

HEAVY = ("numpy", "scipy", "numba", "SimpleITK", "vtk", "pyvista", "manifold3d", "trimesh", "meshio")


@pytest.mark.parametrize("code", ["import femprep", "from femprep.cli._app import app"])
def test_nothing_heavy_is_imported_at_the_start(code: str) -> None:
    show = f"import sys; {code}; print([m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", show], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_is_there() -> None:
    import femprep

    for name in femprep.__all__:
        assert getattr(femprep, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = femprep.nothing


def test_the_list_of_commands_says_what_each_says_itself() -> None:
    for name, line in COMMANDS.items():
        assert load(name).help.splitlines()[0] == line


def test_version_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert __version__ in capsys.readouterr().out
    for command in ("mesh", "surface", "check", "convert", "compare", "demo"):
        assert main([command, "--help"]) == 0
        assert "Usage" in capsys.readouterr().out


def test_unknown_option_is_exit_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["mesh", "a.nii", "-o", "x", "--edgelength", "2"]) == 2
    assert "--edgelength" in capsys.readouterr().err
