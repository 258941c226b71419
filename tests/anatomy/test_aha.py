"""AHA segments: volumes against closed forms, sides where they belong, mirror images, the bull's eye."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from anatomy_meshes import clipped_ellipsoid, ellipsoid

from femprep.anatomy.aha import SEGMENTS, add_aha, segment_means
from femprep.anatomy.axes.mirror import flip
from femprep.anatomy.axes.ventricular_axes import VentricularAxes
from femprep.anatomy.bullseye import bulls_eye
from femprep.errors import InputError

# The septum is turned by 15 degrees so that no element face lies on the border of two segments.
SEPTAL = (np.cos(np.radians(195)), np.sin(np.radians(195)), 0.0)
AXES = VentricularAxes([0.0, 0, -65], [0.0, 0, 15], SEPTAL, mirrored=False)


def _between(a: float, b: float, low: float, high: float) -> float:
    """Volume between two heights of an ellipsoid with semi-axes a, a, b, exact."""

    def below(z: float) -> float:
        z = min(max(z, -b), b)
        return np.pi * a**2 * (z - z**3 / (3 * b**2))

    return below(high) - below(low)


def _exact() -> np.ndarray:
    """Volumes of the 17 segments of the wall between the ellipsoids (25, 55) and (35, 65) below z = 15."""
    border = [15 - k * (15 + 55) / 3 for k in range(4)]
    rings = [_between(35, 65, low, high) - _between(25, 55, low, high) for high, low in pairwise(border)]
    apex = _between(35, 65, -65, -55)
    return np.array([rings[0] / 6] * 6 + [rings[1] / 6] * 6 + [rings[2] / 4] * 4 + [apex])


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_volume_fractions_are_those_of_the_closed_form(kind):
    mesh = add_aha(ellipsoid(kind, size=12, layers=4).mesh, axes=AXES)
    found = np.array([mesh.info["aha"]["volumes_mm3"][k] for k in range(1, 18)])
    exact = _exact()
    fraction, true = found / found.sum(), exact / exact.sum()
    # Elements are whole, so a border is off by part of one: of hexahedra eight columns fill a segment of 60 degrees.
    assert np.abs(fraction - true).max() < (true[0] / 8 if kind == "hexahedron" else 0.004)
    assert found.sum() == pytest.approx(exact.sum(), rel=0.01)
    levels = [fraction[:6].sum(), fraction[6:12].sum(), fraction[12:16].sum(), fraction[16]]
    assert levels == pytest.approx([true[:6].sum(), true[6:12].sum(), true[12:16].sum(), true[16]], abs=0.012)


def test_fractions_converge():
    worst = []
    for size, layers in ((4, 2), (16, 4)):
        mesh = add_aha(ellipsoid("hexahedron", size=size, layers=layers).mesh, axes=AXES)
        found = np.array([mesh.info["aha"]["volumes_mm3"][k] for k in range(1, 18)])
        worst.append(np.abs(found / found.sum() - _exact() / _exact().sum()).max())
    assert worst[1] < 0.5 * worst[0]


def test_segments_lie_on_their_sides():
    mesh = add_aha(ellipsoid("hexahedron", size=6, layers=2).mesh, axes=AXES)
    centre = mesh.points[mesh.cells["hexahedron"]].mean(axis=1)
    mean = {k: centre[mesh.cell_data["aha"] == k].mean(axis=0) for k in range(1, 18)}
    for k, name in SEGMENTS.items():
        if k > 16:
            continue
        front, septal = mean[k] @ AXES.anterior, mean[k] @ AXES.septal
        assert (front > 3) == ("anterior" in name or "antero" in name)
        assert (front < -3) == ("infer" in name)
        assert (septal > 3) == ("sept" in name)
        assert (septal < -3) == ("lateral" in name)
    assert mean[1][2] > mean[7][2] > mean[13][2] > mean[17][2]
    assert sorted(SEGMENTS) == [*range(1, 18), *range(21, 30)]


def test_facets_have_the_segment_of_the_wall_behind_them():
    mesh = add_aha(ellipsoid("hexahedron", size=6, layers=1).mesh, axes=AXES)
    assert mesh.facet_data["aha"].shape == (mesh.n_facets,)
    assert set(np.unique(mesh.facet_data["aha"])) == set(range(1, 18))
    inner = mesh.facet_data["aha"][mesh.facet_tag == mesh.facet_names["endo"]]
    assert 17 not in inner  # the apex is what lies beyond the cavity
    assert set(np.unique(mesh.facet_data["aha"][mesh.facet_tag == mesh.facet_names["base"]])) == set(range(1, 7))


def test_clipped_apex_has_no_apex_segment():
    mesh = add_aha(clipped_ellipsoid().mesh, axes=AXES)
    assert mesh.info["aha"]["empty"] == [17]


def test_mirrored_twin_has_the_same_segments():
    mesh = add_aha(ellipsoid("tetra", size=4, layers=2).mesh, axes=AXES)
    again = add_aha(flip(mesh))
    assert np.array_equal(again.cell_data["aha"], mesh.cell_data["aha"])
    assert np.array_equal(again.facet_data["aha"], mesh.facet_data["aha"])


def test_an_assumed_septum_is_said():
    record = add_aha(ellipsoid("tetra", size=3, layers=1).mesh).info["aha"]
    assert "septum" in record["assumed"]
    assert "mirrored" in record["assumed_hand"]


def test_means_are_weighted_with_volume():
    mesh = add_aha(ellipsoid("hexahedron", size=4, layers=2).mesh, axes=AXES)
    values = np.where(mesh.cell_data["aha"] == 5, 3.0, 1.0)
    mean = segment_means(mesh, values)
    assert mean[4] == pytest.approx(3.0)
    assert np.delete(mean, 4) == pytest.approx(1.0)
    assert np.isnan(segment_means(add_aha(clipped_ellipsoid().mesh, axes=AXES), np.ones(1600))[16])
    with pytest.raises(InputError, match="expected one per element"):
        segment_means(mesh, np.ones(3))
    with pytest.raises(InputError, match="call add_aha first"):
        segment_means(ellipsoid("tetra", size=3, layers=1).mesh, np.ones(3))


def test_bulls_eye_has_seventeen_pieces_in_the_standard_order():
    plt = pytest.importorskip("matplotlib.pyplot")
    plt.switch_backend("agg")
    ax = bulls_eye(np.arange(1.0, 18.0), text="{:.0f}", label="segment")
    assert len(ax.patches) == 17
    at = {t.get_text(): t.get_position() for t in ax.texts}
    assert at["1"][1] > 3  # anterior at the top
    assert at["4"][1] < -3
    assert at["2"][0] < 0 < at["6"][0]  # septum on the left
    assert at["14"] == pytest.approx((-1.5, 0.0), abs=1e-9)
    assert at["17"] == pytest.approx((0.0, 0.0))
    plt.close("all")
    with pytest.raises(InputError, match="17 values"):
        bulls_eye(np.ones(16))


def test_bulls_eye_of_a_field_of_a_mesh_shows_gaps_grey():
    plt = pytest.importorskip("matplotlib.pyplot")
    plt.switch_backend("agg")
    mesh = add_aha(clipped_ellipsoid().mesh, axes=AXES)
    ax = bulls_eye(mesh.cell_data["aha"], mesh)
    assert [t.get_text() for t in ax.texts].count("-") == 1
    plt.close("all")
