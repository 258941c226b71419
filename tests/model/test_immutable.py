"""Objects survive pickling, copying and other processes: same values, and what was read-only is read-only."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import femprep as fp
from femprep.phantoms import biventricular, lv_ellipsoid

WAYS: dict[str, Callable[[Any], Any]] = {
    "pickled": lambda thing: pickle.loads(pickle.dumps(thing)),
    "pickled by protocol 5": lambda thing: pickle.loads(pickle.dumps(thing, 5)),
    "copied deeply": copy.deepcopy,
    "copied": copy.copy,
}


@pytest.fixture(scope="module")
def run() -> fp.Run:
    seg = lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped")
    return fp.mesh_segmentation(
        seg, volume={"mesher": "sweep"}, sweep={"edge_length": 6.0}, surface={"vertices": 500}, fibres={}
    )


@pytest.fixture(scope="module")
def things(run: fp.Run) -> dict[str, Any]:
    seg = run.segmentation
    assert seg is not None
    heart = biventricular().segmentation(spacing=(3.0, 3.0, 8.0))
    surfaces, base = dict(run.surfaces), fp.find_base(seg)
    return {
        "run": run,
        "sequence": fp.SequenceRun((run, run), (0.0, 1.0), 0, {"lv": 0}),
        "annotation": fp.annotate(run.mesh),
        "refined mesh": fp.refine(run.mesh),
        "refinement": fp.Refinement.of(run.mesh),
        "mesh with a net": fp.add_purkinje(run.mesh, generations=2),
        "boundary": fp.boundary_points(seg.object("lv")),
        "shifts": fp.estimate_shifts(heart),
        "axes": fp.ventricular_axes(seg),
        "blood": fp.fill_cavities(run.wall),
        "own surfaces": fp.prepare_surfaces({"lv": surfaces["lv"], "epi": surfaces["epi"]}, base=base),
        "matched": fp.match_surfaces(endo=surfaces["lv"], epi=surfaces["epi"], base=base),
        "template": fp.template_of(run.mesh),
        "options": run.options,
        "phantom": lv_ellipsoid(),
    }


def arrays(thing: Any, path: str = "", seen: set[int] | None = None) -> Iterator[tuple[str, np.ndarray]]:
    """All arrays that a thing holds, with where they are."""
    seen = set() if seen is None else seen
    if id(thing) in seen:
        return
    seen.add(id(thing))
    parts: dict[Any, Any] = {}
    if isinstance(thing, np.ndarray):
        yield path, thing
    elif isinstance(thing, Mapping):
        parts = dict(thing)
    elif isinstance(thing, list | tuple):
        parts = dict(enumerate(thing))
    elif type(thing).__module__.startswith("femprep"):
        parts = vars(thing)
    for name, part in parts.items():
        yield from arrays(part, f"{path}.{name}", seen)


@pytest.mark.parametrize("way", list(WAYS))
def test_everything_survives(things: dict[str, Any], way: str) -> None:
    for name, thing in things.items():
        again = WAYS[way](thing)
        assert type(again) is type(thing)
        before, after = dict(arrays(thing)), dict(arrays(again))
        assert list(before) == list(after), name
        for path, array in before.items():
            np.testing.assert_array_equal(after[path], array, f"{name}{path}")
            assert after[path].flags.writeable <= array.flags.writeable, f"{name}{path}"


@pytest.mark.parametrize("way", list(WAYS))
def test_tables_stay_read_only_and_what_is_shared_stays_shared(run: fp.Run, way: str) -> None:
    again = WAYS[way](fp.refine(run.mesh))
    with pytest.raises(TypeError):
        again.cell_data["new"] = again.region
    # The mesh still knows what it was refined from, also once it has further data.
    assert again.with_data(cell={"new": again.region}).nested is not None


def test_other_processes_take_them_and_send_them_back(run: fp.Run) -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        mesh = pool.submit(fp.add_aha, run.mesh, axes=fp.ventricular_axes(run.segmentation)).result()
        refused = pool.submit(fp.check, mesh, minimum_dihedral="much").exception()
        again = pool.submit(copy.copy, run).result()
    assert not mesh.cell_data["aha"].flags.writeable
    assert isinstance(refused, fp.OptionError)
    assert repr(again) == repr(run)
