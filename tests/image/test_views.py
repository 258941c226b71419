"""PlaneView: labels of a long-axis slice with its own pose, pixels and thickness."""

from __future__ import annotations

import numpy as np
import pytest

import femprep as fp
from femprep.errors import InputError
from femprep.image.views import mask_edges
from femprep.phantoms import biventricular

AXES = np.column_stack([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def view(**changes):
    labels = np.zeros((6, 8), dtype=int)
    labels[2:4, 3:6] = 3
    parts = {"name": "4ch", "labels": labels, "structures": {"lv": (3,), "la": (4,)}, "origin": [1.0, 2.0, 3.0]}
    return fp.PlaneView(**{**parts, "axes": AXES, "spacing": [1.4, 2.0], "thickness": 6.0, **changes})


def test_pixels_lie_along_the_axes_of_the_plane():
    np.testing.assert_allclose(view().to_world([[2, 3]]), [[1.0, 2.0 + 2 * 1.4, 3.0 + 3 * 2.0]])
    np.testing.assert_allclose(view().normal, [1.0, 0.0, 0.0])


def test_masks_are_those_of_the_structures_named():
    assert view().mask("lv").sum() == 6
    assert view().mask("lv", "la").sum() == 6
    assert view().shown == ("lv",)
    assert view().showing("lv", "myo") is None
    assert view().showing("lv").mask("object").sum() == 6


@pytest.mark.parametrize(
    "changes",
    [
        {"labels": np.zeros((2, 2, 2), dtype=int)},
        {"labels": np.zeros((2, 2))},
        {"axes": np.column_stack([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]])},
        {"spacing": [0.0, 1.0]},
        {"thickness": np.nan},
        {"origin": [np.inf, 0.0, 0.0]},
    ],
)
def test_what_is_no_view_is_refused_by_its_name(changes):
    with pytest.raises(InputError, match="4ch"):
        view(**changes)


def test_an_unknown_structure_is_refused():
    with pytest.raises(InputError, match="rv"):
        view().mask("rv")


def test_edges_lie_between_pixels_and_point_outward():
    one = view()
    edges = mask_edges(one.mask("lv"), one.origin, one.axes, one.spacing)
    assert len(edges.points) == 2 * (2 + 3)
    middle = one.to_world(np.argwhere(one.mask("lv"))).mean(axis=0)
    assert (np.einsum("nk,nk->n", edges.points - middle, edges.across) > 0.0).all()
    inner = edges.points - 0.5 * edges.spacing[:, None] * edges.across
    index = np.rint((inner - one.origin) @ one.axes / one.spacing).astype(int)
    assert one.mask("lv")[tuple(index.T)].all()


def test_objects_take_along_the_views_that_show_them():
    seg = biventricular().segmentation((3.0, 3.0, 8.0)).with_views(view())
    assert [each.name for each in seg.object("lv").views] == ["4ch"]
    assert seg.object("lv", "myo").views == ()


def test_a_mirrored_heart_takes_its_views_along():
    seg = biventricular().segmentation((3.0, 3.0, 8.0)).with_views(view())
    twice = fp.flip(fp.flip(seg)).views[0]
    np.testing.assert_allclose(twice.to_world([[2, 3]]), view().to_world([[2, 3]]), atol=1e-9)
    assert not np.allclose(fp.flip(seg).views[0].origin, view().origin)


def test_landmarks_move_with_their_view():
    seen = view(landmarks={"mitral": [[1.0, 3.0, 5.0], [1.0, 5.0, 5.0]]})
    turned = seen.moved(np.eye(3)[[1, 0, 2]], np.array([0.0, 0.0, 2.0])).landmarks["mitral"]
    np.testing.assert_allclose(turned, [[3.0, 1.0, 7.0], [5.0, 1.0, 7.0]])
