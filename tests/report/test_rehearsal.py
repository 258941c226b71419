"""What is loaded while the mesher runs, and that none of it is left behind."""

import subprocess
import sys
from collections.abc import Iterator

import pytest

from femprep.report.rehearsal import Rehearsal
from femprep.volume.rehearsal import begin, rehearse, tiny_mesh


def test_progress_is_passed_on_and_the_painter_ends_with_the_block():
    seen = []
    with Rehearsal(("abaqus",), lambda *told: seen.append(told)) as rehearsal:
        rehearsal("wall", 1.0)
        assert rehearsal.painter is None
        rehearsal("volume", 0.0)
        painter = rehearsal.painter
        assert painter is not None
        assert painter.poll() is None
        rehearsal("volume", 1.0)
        assert rehearsal.painter is painter
    assert painter.returncode is not None
    assert seen == [("wall", 1.0), ("volume", 0.0), ("volume", 1.0)]


def test_the_painter_ends_where_the_block_fails():
    with pytest.raises(RuntimeError), Rehearsal((), None) as rehearsal:
        rehearsal("volume", 0.0)
        painter = rehearsal.painter
        raise RuntimeError
    assert painter.returncode is not None


def test_one_tetrahedron_goes_through_all_that_follows_the_mesher():
    assert len(list(rehearse())) > 1
    assert tiny_mesh().n_cells == 1


def test_what_a_step_raises_stays_in_the_thread():
    taken = []

    def steps() -> Iterator[None]:
        taken.append(1)
        yield
        raise RuntimeError

    begin(steps()).join()
    assert taken == [1]


def test_no_further_step_is_taken_once_the_program_ends():
    code = """
import time
from femprep.volume.rehearsal import begin
def steps():
    for number in range(1000):
        print(number, flush=True)
        time.sleep(0.2)
        yield
begin(steps())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert 1 <= len(done.stdout.split()) < 20
