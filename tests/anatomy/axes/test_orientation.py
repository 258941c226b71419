"""Templates turned by the heart's own axes: vertex i lies at the same place wherever the heart lies in its image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import femprep as fp
from femprep.anatomy import orient
from femprep.errors import InputError
from femprep.phantoms import atrium, biventricular

SPACING = (1.44, 1.44, 8.0)
HEART = biventricular()


def stacked(turn: float, tilt: float, axis_tilt: float = 0.0):
    """The heart turned about its long axis in the image, its stack run from base to apex or back, and both tilted."""
    image = Rotation.from_euler("zx", [turn, tilt], degrees=True).as_matrix()
    heart = HEART.moved(rotation=Rotation.from_euler("yz", [axis_tilt, 0.5 * turn], degrees=True).as_matrix())
    # The image's axes turn against the heart's as told by turn; the phantom's own place in the world is another.
    return heart, heart.segmentation(SPACING, direction=heart.rotation @ image)


def lopsided(seg):
    """One voxel of the left ventricle given to its wall.

    Of a symmetric mask the heart's axes tell which of its equal storages is fitted; of this one its voxels do.
    """
    labels = seg.labels.copy()
    labels[tuple(np.argwhere(seg.mask("lv"))[0])] = seg.structures["myo"][0]
    return replace(seg, labels=labels)


def in_heart(phantom, points):
    """World points in the phantom's own coordinates."""
    return (points - phantom.origin) @ phantom.rotation


def places(seg, phantom, name=("lv",)):
    surface = fp.fit_surface(seg.object(*name), vertices=400)
    return in_heart(phantom, surface.points)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["paper", "even"])
def test_the_same_vertex_lies_at_the_same_place(method):
    found = []
    for turn, tilt in ((0.0, 0.0), (140.0, 0.0), (-70.0, 180.0)):
        phantom, seg = stacked(turn, tilt, axis_tilt=25.0)
        for kind, label in ((orient(seg), "turned with the heart"), (seg, "with the image")):
            surface = fp.fit_surface(kind.object("lv"), vertices=400, method=method)
            found.append((label, in_heart(phantom, surface.points)))
    with_heart = [points for label, points in found if label == "turned with the heart"]
    with_image = [points for label, points in found if label == "with the image"]
    apart = [np.linalg.norm(points - with_heart[0], axis=1).mean() for points in with_heart[1:]]
    adrift = [np.linalg.norm(points - with_image[0], axis=1).mean() for points in with_image[1:]]
    assert max(apart) < 2.5
    assert min(adrift) > 15.0


def test_axes_point_to_base_and_right_ventricle():
    for turn, tilt in ((30.0, 0.0), (200.0, 180.0)):
        phantom, seg = stacked(turn, tilt)
        frame = phantom.rotation.T @ orient(seg).frame
        assert frame[2, 2] > np.cos(np.radians(3.0))
        assert frame[0, 0] > np.cos(np.radians(8.0))
        assert np.linalg.det(frame) == pytest.approx(1.0)


@pytest.mark.slow
def test_the_smooth_surface_does_not_depend_on_it():
    seg = lopsided(stacked(80.0, 0.0)[1])
    one, other = (fp.fit_surface(s.object("lv"), vertices=600) for s in (seg, orient(seg)))
    np.testing.assert_array_equal(one.shape.surface.points, other.shape.surface.points)
    assert one.volume == pytest.approx(other.volume, rel=1e-4)


@pytest.mark.slow
def test_the_harmonic_surface_does_not_depend_on_it():
    seg = lopsided(stacked(80.0, 0.0)[1])
    one, other = (fp.fit_surface(s.object("lv"), vertices=300, method="paper") for s in (seg, orient(seg)))
    directions = fp.fit_surface(seg.object("lv"), vertices=100).directions
    np.testing.assert_allclose(one.shape(directions), other.shape(directions), atol=1e-12)


@pytest.mark.slow
def test_a_heart_without_ventricles_follows_the_image():
    seg = atrium().segmentation(SPACING)
    same = orient(seg)
    assert same.frame is None
    assert same.info["orientation"]["source"] == "image"
    one, other = (fp.fit_surface(s.object("la"), vertices=100) for s in (seg, same))
    np.testing.assert_array_equal(one.points, other.points)


def test_a_frame_that_is_no_rotation_is_refused():
    seg = HEART.segmentation(SPACING)
    with pytest.raises(InputError, match="rotation"):
        replace(seg, frame=np.diag([1.0, 1.0, -1.0]))


@pytest.mark.slow
def test_the_pipeline_turns_templates():
    _, seg = stacked(120.0, 0.0)
    fitted = fp.fit_surfaces(seg, {"lv": ("lv",)}, fp.Options(surface={"vertices": 100}))
    direct = fp.fit_surface(orient(seg).object("lv"), vertices=100)
    np.testing.assert_array_equal(fitted.surfaces["lv"].points, direct.points)
    assert fitted.segmentation.info["orientation"]["source"] == "labels"


def test_a_word_that_is_no_end_is_refused():
    """It was taken for labels that do not tell the axes."""
    seg = biventricular().segmentation(spacing=(3.0, 3.0, 10.0))
    with pytest.raises(InputError, match="basal_end is 'frist'; expected auto, first or last"):
        orient(seg, basal_end="frist")
