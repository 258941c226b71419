"""What is loaded while the mesher runs, and that none of it is left behind."""

import pytest

from femprep.rehearsal import Rehearsal
from femprep.volume.rehearsal import rehearse, tiny_mesh


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
    rehearse()
    assert tiny_mesh().n_cells == 1
