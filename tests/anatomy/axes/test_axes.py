"""Axes from meshes and labels, the hand, mirror images; on real maps the hand the literature gives."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from anatomy_meshes import ellipsoid, grown, slab
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.anatomy.axes.find_axes import facets_of, ventricular_axes
from femprep.anatomy.axes.mirror import flip
from femprep.anatomy.axes.ventricular_axes import Drift, VentricularAxes, hand, rv_drift
from femprep.anatomy.laplace.fem import LinearElements
from femprep.errors import InputError
from femprep.image.grid import Grid
from femprep.image.segmentation import Segmentation
from femprep.mesh.elements import boundary_faces
from femprep.model import VolumeMesh


def _heart(shape=(64, 64, 14), spacing=(1.6, 1.6, 8.0), mirrored: bool = False) -> Segmentation:
    """Short-axis label map of an LV with an RV on its side whose upper end leans to the front; the base is last."""
    grid = Grid(shape, np.array(spacing), np.zeros(3), np.eye(3))
    index = np.indices(shape).reshape(3, -1).T
    x, y, z = (grid.to_world(index) - [50.0, 50.0, 96.0]).T  # base at z = 0
    u, v = x - 0.1 * z, y + 0.05 * z  # the axis leans
    outer = (u / 32) ** 2 + (v / 32) ** 2 + (z / 90) ** 2 < 1
    inner = (u / 22) ** 2 + (v / 22) ** 2 + (z / 80) ** 2 < 1
    # Anatomical: long axis +z, RV at -x, front = z x (-x) = -y.
    front = -0.25 * (z + 45)
    rv = ((u + 22) / 30) ** 2 + ((v - front) / 30) ** 2 + (z / 75) ** 2 < 1
    labels = np.where(inner, 3, np.where(outer, 2, np.where(rv, 1, 0)))
    labels = np.where(z > 4, 0, labels).reshape(shape)
    if mirrored:
        labels = labels[:, ::-1]
    return Segmentation(labels.astype(np.uint8), grid, {"rv": 1, "myo": 2, "lv": 3})


def test_axes_of_an_ellipsoid_mesh():
    axes = ventricular_axes(ellipsoid("tetra", size=6, layers=3).mesh)
    assert axes.long_axis == pytest.approx([0, 0, 1], abs=1e-3)
    assert axes.apex == pytest.approx([0, 0, -65], abs=0.4)
    assert axes.base == pytest.approx([0, 0, 15], abs=1e-6)
    assert axes.mirrored is None
    assert axes.info["assumed"] == ["septal", "hand"]


def test_axes_turn_with_the_mesh():
    mesh = ellipsoid("hexahedron", size=4, layers=2).mesh
    q = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    q *= np.sign(np.linalg.det(q))
    turned = ventricular_axes(replace(mesh, points=mesh.points @ q.T + [10.0, 20, 30]))
    straight = ventricular_axes(mesh)
    assert turned.long_axis == pytest.approx(q @ straight.long_axis, abs=1e-9)
    assert turned.apex == pytest.approx(q @ straight.apex + [10, 20, 30], abs=1e-9)


def test_angle_counts_from_the_septum_to_the_front_in_both_hands():
    for mirrored in (False, True):
        axes = VentricularAxes([0.0, 0, 0], [0.0, 0, 90], [-1.0, 0, 0], mirrored)
        points = np.array([axes.septal, axes.anterior, -axes.septal, -axes.anterior]) * 20 + [0, 0, 50]
        assert axes.angle(points) == pytest.approx([0, 90, 180, 270])
        assert axes.radius(points) == pytest.approx(20)
        assert axes.height(points) == pytest.approx(50)
        assert axes.anterior @ np.cross(axes.long_axis, axes.septal) == pytest.approx(-1 if mirrored else 1)


@given(st.floats(-1e-14, 1e-14))
@settings(deadline=None)
def test_angle_stays_below_a_full_turn(y):
    axes = VentricularAxes([0.0, 0, 0], [0.0, 0, 90], [1.0, 0, 0], False)
    assert 0 <= axes.angle(np.array([[10.0, y, 3.0]]))[0] < 360


def test_record_round_trip_and_axes_carried_by_a_mesh():
    axes = VentricularAxes([1.0, 2, 3], [4.0, 5, 60], [1.0, 1, 0], True, {"anterior": [0.0, 1, 2]}, "labels", {"a": 1})
    again = VentricularAxes.from_record(json.loads(json.dumps(axes.record())))
    assert again.record() == axes.record()
    mesh = slab("tetra", cells=(1, 1, 1)).mesh
    assert ventricular_axes(replace(mesh, info={"axes": axes.record()})).mirrored is True


def test_bad_axes_are_refused():
    with pytest.raises(InputError, match="the same point"):
        VentricularAxes([0.0, 0, 0], [0.0, 0, 0], [1.0, 0, 0])
    with pytest.raises(InputError, match="runs along the long axis"):
        VentricularAxes([0.0, 0, 0], [0.0, 0, 1], [0.0, 0, 2])
    with pytest.raises(InputError, match="finite"):
        VentricularAxes([0.0, 0, np.nan], [0.0, 0, 1], [1.0, 0, 2])
    mesh = slab("tetra", cells=(1, 1, 1)).mesh
    keep = mesh.facet_tag == mesh.facet_names["endo"]
    facets = {"triangle": mesh.facets["triangle"][keep]}
    with pytest.raises(InputError, match="no facets tagged 'epi'"):
        ventricular_axes(replace(mesh, facets=facets, facet_tag=mesh.facet_tag[keep]))


@pytest.mark.parametrize("mirrored", [False, True])
def test_labels_give_axis_septum_insertions_and_hand(mirrored):
    axes = ventricular_axes(_heart(mirrored=mirrored))
    lean = np.array([0.1, 0.05 if mirrored else -0.05, 1.0])
    assert axes.long_axis == pytest.approx(lean / np.linalg.norm(lean), abs=0.01)
    assert axes.mirrored is mirrored
    assert axes.info["basal_end"] == "last"
    assert "assumed" not in axes.info
    assert axes.septal[0] < -0.9
    assert axes.insertions["anterior"] @ axes.anterior > axes.insertions["inferior"] @ axes.anterior + 20
    turn = axes.angle(np.array([axes.insertions["anterior"], axes.insertions["inferior"]]))
    assert turn[0] == pytest.approx(360 - turn[1], abs=1e-6)  # the septal direction is their middle
    assert 40 < axes.info["septal_span_degrees"] < 160


def test_flip_mends_a_mirrored_label_map():
    seg = _heart(mirrored=True)
    mended = flip(seg)
    assert ventricular_axes(mended).mirrored is False
    assert mended.info["flipped"] is True
    assert flip(mended).info["flipped"] is False
    assert np.array_equal(flip(mended).labels, seg.labels)
    assert np.array_equal(np.sort(mended.labels.ravel()), np.sort(seg.labels.ravel()))


def test_labels_without_rv_assume_and_say_so():
    seg = _heart()
    axes = ventricular_axes(Segmentation(np.where(seg.labels == 1, 0, seg.labels), seg.grid, {"myo": 2, "lv": 3}))
    assert axes.mirrored is None
    assert axes.info["assumed"] == ["septal", "hand"]


def test_image_of_cubic_voxels_may_lie_anyhow():
    seg = _heart((64, 64, 72), (1.6, 1.6, 1.5))
    straight = ventricular_axes(seg)
    assert "open_voxels" in straight.info
    lean = np.array([0.1, -0.05, 1.0])
    assert straight.long_axis == pytest.approx(lean / np.linalg.norm(lean), abs=0.04)
    assert straight.mirrored is False
    assert straight.septal[0] < -0.9
    upside_down = Segmentation(seg.labels[:, ::-1, ::-1], seg.grid, seg.structures)  # turned about x by half a turn
    turned = ventricular_axes(upside_down)
    assert turned.long_axis == pytest.approx(straight.long_axis * [1, -1, -1], abs=1e-9)
    assert turned.mirrored is False
    closed = seg.labels.copy()
    closed[:, :, 64:][closed[:, :, 64:] == 3] = 2
    with pytest.raises(InputError, match="closed all round"):
        ventricular_axes(replace(seg, labels=closed))


def test_given_basal_end_turns_the_axis():
    assert ventricular_axes(_heart(), basal_end="first").long_axis[2] < -0.9
    with pytest.raises(InputError, match="expected auto, first or last"):
        ventricular_axes(_heart(), basal_end="top")


def test_given_hand_wins_and_names_the_front():
    seg = _heart(mirrored=True)
    found, said = ventricular_axes(seg), ventricular_axes(seg, mirrored="no")
    assert (found.mirrored, said.mirrored, ventricular_axes(seg, mirrored="yes").mirrored) == (True, False, True)
    assert said.anterior == pytest.approx(-found.anterior)
    assert said.insertions["anterior"] == pytest.approx(found.insertions["inferior"])
    assert ventricular_axes(seg, mirrored="yes").insertions["anterior"] == pytest.approx(found.insertions["anterior"])
    without = Segmentation(np.where(seg.labels == 1, 0, seg.labels), seg.grid, {"myo": 2, "lv": 3})
    axes = ventricular_axes(without, mirrored="yes")
    assert axes.mirrored is True
    assert axes.info["assumed"] == ["septal"]
    with pytest.raises(InputError, match="expected auto, yes or no"):
        ventricular_axes(seg, mirrored="perhaps")


def test_drift_and_hand():
    axes = VentricularAxes([0.0, 0, 0], [0.0, 0, 90], [-1.0, 0, 0])
    height = np.linspace(10, 80, 8)
    angle = np.radians(np.linspace(-10, 25, 8))
    front = np.cross(axes.long_axis, axes.septal)
    points = (
        30 * (np.cos(angle)[:, None] * axes.septal + np.sin(angle)[:, None] * front) + height[:, None] * axes.long_axis
    )
    drift = rv_drift(axes, points, np.ones(8), np.arange(8))
    assert drift.degrees == pytest.approx(35.0)
    assert drift.error < 1e-9
    assert hand(drift) is False
    assert hand(rv_drift(axes, points[::-1], np.ones(8), np.arange(8))) is False  # the order does not matter
    mirrored = VentricularAxes(axes.apex, axes.base, axes.septal)
    twin = points - 2 * (points @ front)[:, None] * front
    assert hand(rv_drift(mirrored, twin, np.ones(8), np.arange(8))) is True
    assert rv_drift(axes, points[:1], np.ones(1), [0]) == (0.0, np.inf, 1)
    assert hand(rv_drift(axes, points[:2], np.ones(2), [0, 1])) is None  # two levels know no error


def test_hand_stays_open_where_the_drift_may_be_chance():
    # Six levels: Student's t of four degrees of freedom reaches 2.132 by chance in a twentieth of all cases.
    assert hand(Drift(20.0, 20.0 / 2.14, 6)) is False
    assert hand(Drift(-20.0, 20.0 / 2.14, 6)) is True
    assert hand(Drift(20.0, 20.0 / 2.12, 6)) is None
    assert hand(Drift(4.0, 0.0, 6)) is None  # clear, but no more than a shifted slice makes
    assert Drift(20.0, 20.0 / 2.132, 6).clearness == pytest.approx(1.0, abs=1e-3)


def test_one_slice_that_lost_its_outflow_tract_does_not_turn_the_hand():
    axes = VentricularAxes([0.0, 0, 0], [0.0, 0, 90], [-1.0, 0, 0])
    front, height = np.cross(axes.long_axis, axes.septal), np.linspace(10, 80, 7)
    angle = np.radians([-12.0, 4.0, 6.0, 13.0, 14.0, 6.0, -21.0])  # of the last slice the front half is missing
    points = 30 * np.outer(np.cos(angle), axes.septal) + 30 * np.outer(np.sin(angle), front)
    size = np.array([1.0, 2, 2, 2, 2, 6, 6])
    drift = rv_drift(axes, points + height[:, None] * axes.long_axis, size, np.arange(7))
    assert drift.degrees < -8.0
    assert hand(drift) is None


@pytest.mark.parametrize(
    ("kind", "order"), [*((kind, order) for kind in ("tetra", "wedge", "hexahedron") for order in (1, 2)), ("mixed", 1)]
)
def test_flipped_mesh_is_positive_and_flips_back(kind, order):
    mesh = ellipsoid(kind, size=3, layers=1).mesh
    if order == 2:
        mesh = grown(mesh)
    twin = flip(mesh)
    assert LinearElements(twin).volume == pytest.approx(LinearElements(mesh).volume)
    back = flip(twin)
    assert back.points == pytest.approx(mesh.points)
    for name in mesh.cells:
        assert np.array_equal(np.sort(back.cells[name], axis=1), np.sort(mesh.cells[name], axis=1))
    if order == 1:
        boundary = {tuple(sorted(n)) for faces in boundary_faces(twin.cells).values() for n in faces.nodes}
        assert {tuple(sorted(n)) for block in twin.facets.values() for n in block} <= boundary
    for one, two in zip(_area(mesh), _area(twin), strict=True):
        assert two == pytest.approx(one * [-1.0, 1, 1])  # outward before, outward after


def _area(mesh: VolumeMesh) -> list[np.ndarray]:
    return [facets_of(mesh, name)[1] for name in ("endo", "epi", "base")]


def test_mid_side_nodes_stay_in_the_middle_of_their_edges():
    from femprep.mesh.elements import ELEMENTS

    for kind in ("tetra", "wedge", "hexahedron"):
        twin = flip(grown(ellipsoid(kind, size=2, layers=1).mesh))
        for name, block in twin.cells.items():
            element = ELEMENTS[name]
            for k, (i, j) in enumerate(element.edges):
                middle = (twin.points[block[:, i]] + twin.points[block[:, j]]) / 2
                assert twin.points[block[:, element.corners + k]] == pytest.approx(middle)
        for block in twin.facets.values():
            corners = block.shape[1] // 2
            for k in range(corners):
                middle = (twin.points[block[:, k]] + twin.points[block[:, (k + 1) % corners]]) / 2
                assert twin.points[block[:, corners + k]] == pytest.approx(middle)


@pytest.mark.data
def test_acdc_is_mirrored_as_stored_and_the_ct_heart_is_not(data):
    from femprep.image import read_segmentation

    found = {}
    for number in (7, 9, 21, 41, 1, 30, 60, 80):
        path = data / f"acdc/training/patient{number:03d}/patient{number:03d}_frame01_gt.nii.gz"
        seg = read_segmentation(path, preset="acdc")
        found[number] = ventricular_axes(seg).mirrored, ventricular_axes(flip(seg)).mirrored
    assert set(found.values()) == {(True, False)}


@pytest.mark.data
def test_one_heart_has_the_same_axes_as_a_stack_and_as_a_ct_image(data):
    from femprep.image import read_segmentation

    folder, structures = data / "rodero01", {"lv": 1, "myo": 2, "rv": 3}
    stack = ventricular_axes(read_segmentation(folder / "rodero01_sax_vent_1.5x1.5x10_label.nii.gz", preset="acdc"))
    for name, limit in (("rodero01_sax_4ch_1.4x1.4x8_label.nii.gz", 3.0), ("rodero01_4ch_1.0mm_label.nii.gz", 5.0)):
        axes = ventricular_axes(read_segmentation(folder / name, structures=structures))
        assert axes.mirrored is stack.mirrored is False
        assert np.degrees(np.arccos(axes.long_axis @ stack.long_axis)) < limit
        assert np.degrees(np.arccos(axes.septal @ stack.septal)) < 8.0


@pytest.mark.data
@pytest.mark.slow
def test_all_acdc_maps_show_their_basal_end_and_none_the_wrong_hand(data):
    import csv

    from femprep.image import read_segmentation

    hands, other_end = [], []
    with (data / "acdc/cases.csv").open() as file:
        for row in csv.DictReader(file):
            path = data / "acdc" / row["file"]
            if not path.exists():
                continue
            axes = ventricular_axes(read_segmentation(path, preset="acdc"))
            if axes.info["basal_end"] != {"zmin": "first", "zmax": "last"}[row["base_end"]]:
                other_end.append(row["id"])
            hands.append(axes.mirrored)
    # The table goes by the LV alone; this one's RV ends at the other end, as it does at end-diastole.
    assert other_end == ["patient047_frame09"]
    assert len(hands) == 200
    assert hands.count(False) == 0
    assert hands.count(True) >= 165
