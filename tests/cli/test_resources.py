"""Runs on machines that lack something: a home, a folder for temporary files, memory, a steady clock, being alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import femprep as fp
from femprep.phantoms import lv_ellipsoid
from femprep.report.manifest import hashes

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="limits memory as POSIX does")]
_START = "import sys; from femprep.cli import main; {first}; sys.exit(main())"


@pytest.fixture(scope="module")
def heart(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("heart") / "heart.nii.gz"
    fp.write_segmentation(lv_ellipsoid().segmentation(spacing=(2.5, 2.5, 8.0)), path)
    return path


def command(heart: Path, out: Path, first: str = "0", edge: str = "8") -> list[str]:
    """A run of some seconds, and what Python does before it."""
    given = ["--preset", "acdc", "--mesher", "sweep", "--edge-length", edge, "--vertices", "300", "--quiet"]
    return [sys.executable, "-c", _START.format(first=first), "mesh", str(heart), "-o", str(out), *given]


def environment(**changes: str) -> dict[str, str]:
    """This one's without folders of the user's own, and with some changes."""
    own = {name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "FEMPREP_CACHE"))}
    return {**own, **changes}


def broken(out: Path) -> list[str]:
    """Files of an output folder that are not what its record says, or are beside it."""
    record = json.loads((out / "run.json").read_bytes())
    found = hashes(out, [name for name in record["files"] if name in record["sha256"]])
    wrong = [name for name, own in found.items() if record["sha256"][name] != own]
    return wrong + [path.name for path in out.parent.iterdir() if path != out]


def ended(arguments: list[str], folder: Path, **changes: str) -> tuple[int, list[str]]:
    """Exit status and lines on standard error."""
    env = environment(**changes)
    done = subprocess.run(arguments, capture_output=True, text=True, check=False, env=env, cwd=folder, timeout=900)
    return done.returncode, done.stderr.splitlines()


@pytest.mark.parametrize("home", ["/dev/null", ""])
def test_without_a_home(home: str, heart: Path, tmp_path: Path) -> None:
    out = tmp_path / "made" / "out"
    out.parent.mkdir()
    status, said = ended(command(heart, out), tmp_path, HOME=home)
    assert (status, said) == (0, [])
    assert broken(out) == []


def test_without_a_folder_for_temporary_files(heart: Path, tmp_path: Path) -> None:
    out = tmp_path / "made" / "out"
    out.parent.mkdir()
    none = "import tempfile; tempfile._candidate_tempdir_list = lambda: ['/nowhere']"
    status, said = ended(command(heart, out, none), tmp_path)
    assert status in (0, 2, 3)
    assert len(said) == (status > 0)
    assert [path.name for path in tmp_path.iterdir()] == ["made"]
    assert broken(out) == [] if status == 0 else not list(out.parent.iterdir())


def test_with_two_gigabytes(heart: Path, tmp_path: Path) -> None:
    out = tmp_path / "made" / "out"
    out.parent.mkdir()
    limit = "import resource; resource.setrlimit(resource.RLIMIT_AS, (2**31,) * 2)"
    status, said = ended(command(heart, out, limit), tmp_path, NUMBA_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    assert (status, said) == (0, [])
    assert broken(out) == []


def test_with_a_clock_that_jumps(heart: Path, tmp_path: Path) -> None:
    out = tmp_path / "made" / "out"
    out.parent.mkdir()
    jumps = "import random, time; now = time.time; time.time = lambda: now() + random.choice([-4e7, 0, 4e7])"
    status, said = ended(command(heart, out, jumps), tmp_path)
    assert (status, said) == (0, [])
    assert broken(out) == []
    stages = json.loads((out / "run.json").read_bytes())["stages"]
    assert all(0.0 <= stage["seconds"] < 900.0 for stage in stages)


def test_two_runs_into_one_folder(heart: Path, tmp_path: Path) -> None:
    out = tmp_path / "made" / "out"
    out.parent.mkdir()
    runs = [
        subprocess.Popen(command(heart, out, edge=edge), stderr=subprocess.PIPE, text=True, env=environment())
        for edge in ("8", "9")
    ]
    said = [run.communicate(timeout=900)[1] for run in runs]
    status = [run.returncode for run in runs]
    assert 0 in status
    assert set(status) <= {0, 2, 3}
    assert [text.count("\n") for text in said] == [int(one > 0) for one in status]
    assert broken(out) == []
    assert fp.read_mesh(out / "mesh.vtu").n_cells > 0
