"""GPFiles: outlines in pieces are joined, planes have their poses, and the example of biv-me is read whole."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import femprep as fp
from femprep.image.reading.contours.ordering import in_order

HEAD = "x\ty\tz\tcontour type\tframeID\tweight\ttime frame\n"
POSE = (
    "a.dcm\tsliceID: \t{n}\tImagePositionPatient\t-60\t-60\t{z}\tImageOrientationPatient\t1\t0\t0\t0\t1\t0\t"
    "PixelSpacing\t1.5\t1.2\n"
)


def arc(radius, first, last, count, z=0.0):
    angle = np.radians(np.linspace(first, last, count))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, z)])


def lines(kind, points, plane, weight=1.0):
    return "".join(f"{x}\t{y}\t{z}\t{kind}\t{plane}\t{weight}\t0\n" for x, y, z in points)


def write(folder, body):
    (folder / "SliceInfoFile.txt").write_text(POSE.format(n=1, z=0) + POSE.format(n=2, z=10))
    path = folder / "GPFile_000.txt"
    path.write_text(HEAD + body)
    return path


@pytest.fixture
def crescent():
    """A free wall and a septum, which bends inwards, in shuffled pieces and directions."""
    wall, septum = arc(30.0, 100.0, 260.0, 60), np.add(arc(40.0, 132.5, 227.5, 40), [22.0, 0.0, 0.0])
    return [np.concatenate([wall[35:], wall[:35]]), septum[::-1]]


def crosses(line):
    """Whether a closed line crosses itself."""
    a, b = line[:, :2], np.roll(line, -1, axis=0)[:, :2]

    def side(p, q, r):
        return np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return any(
        side(a[i], b[i], a[j]) != side(a[i], b[i], b[j]) and side(a[j], b[j], a[i]) != side(a[j], b[j], b[i])
        for i in range(len(a))
        for j in range(i + 2, len(a) - (i == 0))
    )


def test_a_crescent_in_pieces_becomes_one_simple_line(crescent):
    line, _ = in_order(crescent)
    assert not crosses(line)
    assert {tuple(p) for p in line} == {tuple(p) for piece in crescent for p in piece}


def test_points_without_any_order_are_put_in_order():
    ring = arc(25.0, 0.0, 354.0, 60)
    line, closed = in_order([np.random.default_rng(3).permutation(ring)])
    assert closed
    assert not crosses(line)


def test_the_widest_gap_stays_open():
    line, closed = in_order([arc(25.0, 200.0, 330.0, 30), arc(25.0, 30.0, 195.0, 40)])
    ends = sorted(np.degrees(np.arctan2(line[[0, -1], 1], line[[0, -1], 0])).round().tolist())
    assert not closed
    assert ends == [-30.0, 30.0]


def test_types_make_surfaces_and_the_septum_belongs_to_both_ventricles(tmp_path):
    body = lines("SAX_LV_ENDOCARDIAL", arc(15.0, 0.0, 350.0, 36), 1)
    body += lines("SAX_LV_EPICARDIAL", arc(22.0, -130.0, 130.0, 40), 1)
    body += lines("SAX_RV_SEPTUM", arc(22.0, 135.0, 225.0, 20), 1)
    body += lines("SAX_RV_FREEWALL", arc(22.0, 100.0, 260.0, 30) * [1.6, 1.0, 1.0], 1)
    body += lines("SAX_LV_ENDOCARDIAL", [[0.0, 0.0, 0.0]], 1, weight=0.0)
    body += lines("RV_INSERT", [[-15.0, 15.0, 0.0]], 1) + lines("SAX_PAPILLARY", [[1.0, 1.0, 0.0]], 1)
    body += lines("MITRAL_VALVE", [[5.0, 5.0, 10.0], [-5.0, 5.0, 10.0]], 2)
    contours = fp.read_contours(write(tmp_path, body))
    assert {one.surface: len(one.points) for one in contours.contours} == {"lv": 36, "epi": 60, "rv": 50, "mitral": 2}
    first = contours.planes[0]
    assert first.short_axis
    # Columns lie 1.2 mm apart, and the first index runs along a row.
    assert first.spacing.tolist() == [1.2, 1.5]
    assert any("PAPILLARY" in notice.what for notice in contours.notices)


@pytest.mark.parametrize(
    ("body", "word"),
    [
        (lines("SAX_LV_ENDOCARDIAL", arc(15.0, 0.0, 350.0, 36), 3), "SliceInfoFile"),
        ("1\t2\tx\tSAX_LV_ENDOCARDIAL\t1\t1\t0\n", "line 2"),
        (lines("RV_INSERT", [[0.0, 0.0, 0.0]], 1), "no contours"),
        (lines("SAX_LV_ENDOCARDIAL", arc(15.0, 0.0, 350.0, 36, z=4.0), 1), "4.0 mm off"),
    ],
)
def test_what_is_wrong_is_refused_by_place(tmp_path, body, word):
    with pytest.raises(fp.FemprepError, match=word):
        fp.read_contours(write(tmp_path, body))


def test_a_missing_slice_file_is_named(tmp_path):
    path = write(tmp_path, lines("SAX_LV_ENDOCARDIAL", arc(15.0, 0.0, 350.0, 36), 1))
    (tmp_path / "SliceInfoFile.txt").unlink()
    with pytest.raises(fp.FileError, match="SliceInfoFile"):
        fp.read_contours(path)


@pytest.mark.skipif("FEMPREP_DATA" not in os.environ, reason="FEMPREP_DATA names no folder of hearts")
@pytest.mark.parametrize("phase", [0, 6, 12, 20])
def test_every_outline_of_a_real_patient_is_simple(phase):
    path = Path(os.environ["FEMPREP_DATA"]) / "bivme_example" / f"GPFile_{phase:03d}.txt"
    contours = fp.read_contours(path)
    for one in contours.contours:
        if one.surface in ("lv", "epi", "rv"):
            plane = next(plane for plane in contours.planes if plane.name == one.plane)
            line = np.unique(plane.to_plane(one.points), axis=0, return_index=True)[1]
            assert not crosses(plane.to_plane(one.points[np.sort(line)]))
    seg = contours.to_segmentation()
    assert len(seg.views) == 4
    assert {"mitral", "tricuspid", "apex"} <= set(seg.views[0].landmarks)
    assert seg.grid.spacing[2] == pytest.approx(17.7, abs=1e-3)
