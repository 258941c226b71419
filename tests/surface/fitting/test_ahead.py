"""Surfaces begun ahead of their fit: the same surfaces, and errors where the fit would meet them."""

import threading

import numpy as np
import pytest

from femprep.errors import StageError
from femprep.options import SurfaceOptions
from femprep.phantoms import lv_ellipsoid
from femprep.surface import fit_surface
from femprep.surface.fitting import ahead
from femprep.surface.fitting.ahead import in_turn

OPTIONS = SurfaceOptions(vertices=500)


@pytest.fixture(scope="module")
def objects():
    seg = lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0))
    return {"lv": seg.object("lv"), "epi": seg.object("lv", "myo")}


def test_surfaces_begun_ahead_are_the_same_to_the_byte(objects):
    names = []
    for name, obj, begun in in_turn(objects, OPTIONS):
        names.append(name)
        assert (begun is None) == (name == "lv")
        one, other = fit_surface(obj, options=OPTIONS, begun=begun), fit_surface(obj, options=OPTIONS)
        assert one.points.tobytes() == other.points.tobytes()
        assert np.array_equal(one.triangles, other.triangles)
        assert one.info == other.info
    assert names == ["lv", "epi"]


def test_methods_that_begin_otherwise_are_not_begun(objects):
    options = OPTIONS.model_copy(update={"method": "even"})
    assert [begun for _, _, begun in in_turn(objects, options)] == [None, None]


def test_what_the_thread_raises_is_met_by_the_fit(objects, monkeypatch):
    def fails(obj):
        assert threading.current_thread() is not threading.main_thread()
        raise StageError("tunnels")

    monkeypatch.setattr(ahead, "rough_mesh", fails)
    *_, (_, obj, begun) = in_turn(objects, OPTIONS)
    surface = fit_surface(obj, options=OPTIONS, begun=begun)
    assert surface.info["notices"][0]["what"].startswith("tunnels")
