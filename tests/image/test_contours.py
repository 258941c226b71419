"""Contours: what is refused where they enter."""

from __future__ import annotations

import numpy as np
import pytest

import femprep as fp

PLANE = fp.ContourPlane("1", np.zeros(3), np.eye(3)[:, :2], [1.4, 1.4], 8.0, short_axis=True)
LINE = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]]


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: fp.Contour("liver", LINE, "1", closed=True), "known"),
        (lambda: fp.Contour("lv", LINE[:2], "1", closed=True), "at least 3"),
        (lambda: fp.Contour("lv", [[0.0, 0.0, np.nan]] * 3, "1", closed=True), "finite"),
        (lambda: fp.Contours((PLANE,), ()), "no contours"),
        (lambda: fp.Contours((PLANE, PLANE), (fp.Contour("lv", LINE, "1", closed=True),)), "name of its own"),
        (lambda: fp.Contours((PLANE,), (fp.Contour("lv", LINE, "2", closed=True),)), "not there"),
        (lambda: fp.Contours((PLANE,), (fp.Contour("lv", np.add(LINE, 5.0), "1", closed=True),)), "5.0 mm off"),
        (lambda: fp.ContourPlane("1", np.zeros(3), np.ones((3, 2)), [1.4, 1.4], 8.0, short_axis=True), "orthonormal"),
        (lambda: fp.ContourPlane("1", np.zeros(3), np.eye(3)[:, :2], [1.4, 0.0], 8.0, short_axis=True), "positive"),
    ],
)
def test_what_is_wrong_is_refused_by_name(make, word):
    with pytest.raises(fp.InputError, match=word):
        make()


def test_a_landmark_may_be_one_point():
    apex = fp.Contour("apex", [[1.0, 2.0, 0.0]], "1", closed=False)
    assert fp.Contours((PLANE,), (apex,)).on("1", "apex") == (apex,)
