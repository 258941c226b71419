"""Objects: largest piece, voids, sizes, policies, reports, boundary points."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from femprep.errors import InputError, OptionError
from femprep.image import Grid, LabelObject, Segmentation, boundary_points, make_object
from femprep.image.topology import label_pieces

SPACING = (1.5, 1.25, 8.0)


def segmentation(labels: np.ndarray, direction: np.ndarray | None = None, **structures: object) -> Segmentation:
    grid = Grid(labels.shape, SPACING, (5.0, 6.0, 7.0), np.eye(3) if direction is None else direction)
    return Segmentation(labels, grid, structures or {"lv": (3,), "myo": (2,), "rv": (1,)})


def heart() -> np.ndarray:
    labels = np.zeros((20, 18, 6), dtype=np.uint8)
    labels[4:14, 4:14, :] = 2
    labels[6:12, 6:12, :] = 3
    return labels


def test_object_is_padded_and_stays_in_place():
    seg = segmentation(heart(), Rotation.random(random_state=3).as_matrix())
    obj = seg.object("lv", "myo")
    assert obj.mask.shape == (14, 14, 10)
    assert obj.name == "lv+myo"
    inside = np.argwhere(obj.mask)
    assert inside.min() == 2
    centre = seg.grid.to_world(np.argwhere(seg.mask("lv", "myo"))).mean(axis=0)
    np.testing.assert_allclose(obj.grid.to_world(inside).mean(axis=0), centre, atol=1e-10)
    np.testing.assert_allclose(obj.barycentre, centre, atol=1e-10)
    assert obj.volume == pytest.approx(600 * 1.5 * 1.25 * 8.0)
    assert obj.report["touches_border"] is True
    assert obj.stack_axis == 2


def test_repair_keeps_the_largest_piece_and_says_so():
    labels = heart()
    labels[17:19, 16, 2] = 3
    labels[0, 0, 0] = 3
    seg = segmentation(labels)
    obj = seg.object("lv")
    assert obj.voxels == 216
    assert obj.report["pieces"] == 3
    assert obj.report["piece_voxels"] == [216, 2, 1]
    assert obj.report["removed_voxels"] == 3
    with pytest.raises(InputError, match="in 3 pieces of 216, 2, 1 voxels"):
        seg.object("lv", policy="strict")


def two_hearts(gap: int) -> np.ndarray:
    """The heart and its half beside it along the stack, slices between them empty."""
    labels = heart()
    return np.concatenate([labels, np.zeros_like(labels[:, :, :gap]), labels[:, :, :4]], axis=2)


def test_a_piece_that_is_no_speck_is_refused_with_where_it_lies():
    labels = heart()
    labels[8, :, :] = np.where(labels[8] == 3, 2, labels[8])
    with pytest.raises(InputError, match=r"'lv' is in 2 pieces of \d+, \d+ voxels, near \(.*\) and \(.*\) mm, .*joins"):
        segmentation(labels).object("lv")


def test_slices_without_a_label_between_pieces_are_named():
    seg = segmentation(two_hearts(1))
    with pytest.raises(InputError, match=r"pieces of \d+, \d+ voxels: slices? \d.* nothing of it, between slices"):
        seg.object("lv")


def test_repair_fills_voids_and_says_what_was_in_them():
    labels = heart()
    labels[8, 8, 2] = 0
    labels[9, 10, 3] = 1
    seg = segmentation(labels)
    obj = seg.object("lv")
    assert obj.voxels == 216
    assert obj.report["voids"] == 2
    assert obj.report["filled_voxels"] == 2
    assert obj.report["filled_labels"] == {"0": 1, "1": 1}
    with pytest.raises(InputError, match="has 2 voids of 1, 1 voxels"):
        seg.object("lv", policy="strict")


def test_tunnels_are_counted_and_refused_where_strict():
    seg = segmentation(heart())
    assert seg.object("myo").report["tunnels"] == 1
    assert seg.object("lv").report["tunnels"] == 0
    with pytest.raises(InputError, match="has a tunnel,"):
        seg.object("myo", policy="strict")
    assert seg.object("lv", policy="strict").report["policy"] == "strict"


def test_a_piece_lost_far_away_does_not_leave_a_large_mask():
    labels = np.zeros((200, 10, 6), dtype=np.uint8)
    labels[2:8, 2:8, 1:5] = 3
    labels[190, 5, 3] = 3
    assert segmentation(labels).object("lv").mask.shape == (10, 10, 8)


def test_too_small_or_in_one_slice():
    labels = np.zeros((20, 18, 6), dtype=np.uint8)
    labels[2, 2, 1:4] = 1
    labels[4:12, 4:12, 3] = 3
    seg = segmentation(labels)
    with pytest.raises(InputError, match="3 voxels, fewer than minimum_voxels = 8"):
        seg.object("rv")
    with pytest.raises(InputError, match="one slice only"):
        seg.object("rv", minimum_voxels=3)
    with pytest.raises(InputError, match=r"'lv' lies in one slice only \(axis k\)"):
        seg.object("lv")


def test_absent_labels_and_unknown_names():
    seg = segmentation(heart(), lv=(3, 7), myo=2)
    with pytest.raises(InputError, match=r"label 7 of structure 'lv' does not occur .* labels there: 2, 3"):
        seg.object("lv")
    with pytest.raises(InputError, match=r"structure 'rv' is not defined \(defined: lv, myo\)"):
        seg.mask("rv")
    with pytest.raises(InputError, match="no structure given"):
        seg.object()
    with pytest.raises(OptionError, match="policy"):
        seg.object("myo", policy="mend")


def test_several_labels_make_one_structure():
    labels = heart()
    labels[12:14] = np.where(labels[12:14] == 2, 9, labels[12:14])
    seg = segmentation(labels, wall=(2, 9))
    np.testing.assert_array_equal(seg.mask("wall"), heart() == 2)
    assert seg.present == (2, 3, 9)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.int32, np.uint32])
def test_labels_of_any_integer_type(dtype):
    seg = segmentation(heart().astype(dtype))
    assert seg.present == (2, 3)
    assert seg.object("lv").voxels == 216


def test_segmentation_refuses_what_is_no_label_map():
    grid = Grid((2, 2, 2), (1, 1, 1), (0, 0, 0), np.eye(3))
    with pytest.raises(InputError, match="expected integers"):
        Segmentation(np.zeros((2, 2, 2)), grid, {"lv": (1,)})
    with pytest.raises(InputError, match="their grid"):
        Segmentation(np.zeros((2, 2, 3), dtype=int), grid, {"lv": (1,)})
    with pytest.raises(InputError, match="0 is background"):
        Segmentation(np.zeros((2, 2, 2), dtype=int), grid, {"lv": (0,)})
    with pytest.raises(InputError, match="has no label"):
        Segmentation(np.zeros((2, 2, 2), dtype=int), grid, {"lv": ()})


def test_input_is_not_changed_and_results_are_read_only():
    labels = heart()
    labels[8, 8, 2] = 0
    before = labels.copy()
    seg = segmentation(labels)
    obj = seg.object("lv")
    np.testing.assert_array_equal(labels, before)
    assert labels.flags.writeable
    for array in (seg.labels, obj.mask, boundary_points(obj).points):
        assert not array.flags.writeable


def test_reports_are_json():
    report = dict(segmentation(heart()).object("lv").report)
    assert json.loads(json.dumps(report)) == report


def test_label_object_refuses_thin_padding():
    grid = Grid((5, 5, 5), (1, 1, 1), (0, 0, 0), np.eye(3))
    mask = np.zeros((5, 5, 5), dtype=bool)
    mask[1:3, 2, 2] = True
    with pytest.raises(InputError, match="fewer than 2 voxels"):
        LabelObject(mask, grid)
    with pytest.raises(InputError, match="has no voxels"):
        LabelObject(np.zeros((5, 5, 5), dtype=bool), grid)


def test_boundary_points_of_one_box_by_hand():
    mask = np.zeros((6, 6, 6), dtype=bool)
    mask[2:4, 2:5, 2:4] = True
    grid = Grid(mask.shape, SPACING, (5.0, 6.0, 7.0), [[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    found = boundary_points(make_object(mask, grid, "box"))
    # Faces of 2 x 3 x 2 voxels: 6 at each end of i, 4 of j, 6 of k.
    assert len(found) == 2 * (6 + 4 + 6)
    assert np.bincount(found.axis).tolist() == [12, 8, 12]
    np.testing.assert_array_equal(found.spacing, np.array(SPACING)[found.axis])
    # Face i = 1.5 of the image, which lies along world y.
    first = found.points[0]
    np.testing.assert_allclose(first, grid.to_world([[1.5, 2, 2]])[0])
    np.testing.assert_array_equal(found.normal[0], [0, -1, 0])


def test_boundary_points_lie_half_a_voxel_out_of_their_voxel():
    seg = segmentation(heart(), Rotation.random(random_state=5).as_matrix())
    obj = seg.object("lv")
    found = boundary_points(obj)
    assert obj.mask[tuple(found.voxel.T)].all()
    centre = obj.grid.to_world(found.voxel)
    np.testing.assert_allclose(found.points - centre, 0.5 * found.spacing[:, None] * found.normal, atol=1e-12)
    outside = np.rint(obj.grid.to_index(2.0 * found.points - centre)).astype(int)
    assert not obj.mask[tuple(outside.T)].any()
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=1e-15)


@settings(deadline=None, max_examples=60)
@given(arrays(bool, (5, 6, 4)), st.integers(0, 1000))
def test_boundary_faces_close_around_the_object(mask, seed):
    """Divergence theorem: the face areas' normals sum to zero, and the flux of x/3 through them is the volume."""
    mask[1:4, 1:4, 1:3] = True
    mask = label_pieces(mask)[0] == 1
    direction = Rotation.random(random_state=seed).as_matrix()
    obj = make_object(mask, Grid(mask.shape, SPACING, (5.0, 6.0, 7.0), direction), "any")
    found = boundary_points(obj)
    area = obj.grid.voxel_volume / found.spacing
    np.testing.assert_allclose(area @ found.normal, 0.0, atol=1e-8)
    flux = np.einsum("n,ni,ni->", area, found.points, found.normal) / 3.0
    assert flux == pytest.approx(obj.volume, rel=1e-9)


def test_boundary_points_are_the_same_every_time():
    obj = segmentation(heart()).object("lv", "myo")
    assert boundary_points(obj).points.tobytes() == boundary_points(obj).points.tobytes()
