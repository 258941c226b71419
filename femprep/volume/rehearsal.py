"""Compiled code and libraries, loaded ahead of their use while another process keeps this one waiting.

Reading compiled kernels from disk takes about a second in all; compiling them, the first time of all, half a minute.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Final

import numpy as np

from femprep.mesh.measures.volume_elements import element_measures, element_volumes
from femprep.mesh.patches import PatchSurface
from femprep.mesh.unique_rows import bucketed, sort_each
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh, Wall
from femprep.volume.optimise import optimise
from femprep.volume.optimise.constraints import constrain
from femprep.volume.quality.check import check
from femprep.volume.quality.percentiles import percentiles
from femprep.volume.refine import refine
from femprep.volume.tagging import tag_facets

_log = logging.getLogger(__name__)

#: What the stages after the mesher have in hand at a time, measured on meshes of half a million elements, and the most
#: that is taken ahead.
_BYTES_PER_ELEMENT: Final = 1200
_MOST_BYTES: Final = 2**30

_POINTS = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
_FACETS = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
_CELLS = np.array([(0, 1, 2, 3)])


@cache
def tiny_mesh() -> VolumeMesh:
    """One tetrahedron with tagged facets."""
    tag = np.array([FACET_TAGS[name] for name in ("endo", "epi", "epi", "epi")], dtype=np.int32)
    region = np.full(1, REGION_TAGS["lv"], dtype=np.int32)
    return VolumeMesh(_POINTS, {"tetra": _CELLS}, region, {"triangle": _FACETS}, tag)


def rehearse(elements: float = 0.0) -> Iterator[None]:
    """Take one tetrahedron through everything that follows the mesher, step by step, and memory for so many elements.

    Where the C library keeps freed memory, as the command line asks it to, that is then at hand.
    """
    mesh = tiny_mesh()
    wall = Wall(1.01 * _POINTS, _FACETS, mesh.facet_tag, np.full(4, -1), {})
    tag = tag_facets(_POINTS, _FACETS, wall, 1.0)
    yield
    # Every element counts as poor, so that the search runs too.
    moved = optimise(_POINTS, _CELLS, constrain(4, _FACETS, tag, wall), poor=2.0).points
    yield
    refine(mesh)
    PatchSurface(_POINTS, _FACETS).project(moved)
    yield
    element_measures(moved, _CELLS, "tetra")
    yield
    element_volumes(moved, _CELLS, "tetra")
    yield
    rows = _CELLS.copy()
    sort_each(rows)
    bucketed(rows, 4)
    yield
    check(mesh)
    percentiles(np.arange(9.0), (50.0,))
    yield
    np.ones(int(min(elements * _BYTES_PER_ELEMENT, _MOST_BYTES)), dtype=np.uint8)


def begin(steps: Iterable[None]) -> threading.Thread:
    """Take the steps in a thread; what one raises is only logged, and ends them.

    Once the program ends no further step is taken, and it waits for the one at work: a daemon thread would be
    stopped within compiled code, which crashes.
    """
    thread = threading.Thread(target=_take, args=(steps,), name="femprep-rehearsal")
    thread.start()
    return thread


@contextmanager
def meanwhile(steps: Iterable[None]) -> Iterator[None]:
    """Take the steps in a thread while the block runs, which waits for their end unless it fails."""
    thread = begin(steps)
    yield
    thread.join()


def _take(steps: Iterable[None]) -> None:
    try:
        for _ in steps:
            if not threading.main_thread().is_alive():
                return
    except Exception:  # whatever is wrong will show, and be told, where it matters
        _log.debug("nothing could be loaded ahead", exc_info=True)
