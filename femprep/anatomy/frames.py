"""Local frames and their rotation: vectors in; circumferential, longitudinal, transmural axes and fibre triads out.

A frame is an array ``(n, 3, 3)`` whose columns are the circumferential, the longitudinal (apex to base) and the
transmural (outward) unit vector, right-handed in this order.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.tangents import tangents
from femprep.model import BoolArray, FloatArray
from femprep.model.products import unit_vectors

#: Below this fraction of its length, what is left of a vector after a projection has no direction.
_DEGENERATE: Final = 1e-6


def make_frames(
    longitudinal: FloatArray, transmural: FloatArray, *, keep: str = "transmural"
) -> tuple[FloatArray, BoolArray]:
    """Orthonormal frames of two vector fields (``axis`` of Bayer et al. 2012, Algorithm 1).

    Parameters
    ----------
    longitudinal, transmural : (n, 3) arrays
        Towards the base and outward, of any length.
    keep : {"transmural", "longitudinal"}
        Which of the two keeps its direction; the other is made orthogonal to it. Bayer et al. keep the longitudinal
        one; keeping the transmural one leaves the fibres tangential to the walls.

    Returns
    -------
    frames : (n, 3, 3) array
    degenerate : (n,) bool array
        Where the two were parallel or zero (as on the axis at the apex), so that a direction was chosen.
    """
    first, second = (transmural, longitudinal) if keep == "transmural" else (longitudinal, transmural)
    first, second = unit_vectors(first), unit_vectors(second)
    lost = np.linalg.norm(first, axis=1) == 0
    first = np.where(lost[:, None], _any_normal(second), first)
    rest = second - np.sum(first * second, axis=1, keepdims=True) * first
    weak = np.linalg.norm(rest, axis=1) < _DEGENERATE
    rest = np.where(weak[:, None], _any_normal(first), rest)
    rest = unit_vectors(rest)
    rest = unit_vectors(rest - np.sum(first * rest, axis=1, keepdims=True) * first)  # once more: orthogonal to rounding
    transmural, longitudinal = (first, rest) if keep == "transmural" else (rest, first)
    frames = np.stack([np.cross(longitudinal, transmural), longitudinal, transmural], axis=2)
    return frames, lost | weak


def _any_normal(vectors: FloatArray) -> FloatArray:
    """A unit vector orthogonal to each vector: across the coordinate axis it has least of."""
    return tangents(vectors)[:, 0] + np.where(np.any(vectors, axis=1)[:, None], 0.0, np.eye(3)[0])


def rotate(frames: FloatArray, helix: FloatArray, sheet: FloatArray) -> FloatArray:
    """Triads (fibre, sheet, normal) from frames and angles in degrees (conventions in ``femprep.anatomy.fibres``).

    Returns
    -------
    (n, 3, 3) array
        Columns fibre, sheet, normal; right-handed.
    """
    a, b = np.radians(helix)[:, None], np.radians(sheet)[:, None]
    circumferential, longitudinal, transmural = (frames[:, :, i] for i in range(3))
    fibre = np.cos(a) * circumferential + np.sin(a) * longitudinal
    across = np.cos(a) * longitudinal - np.sin(a) * circumferential
    sheets = np.cos(b) * transmural + np.sin(b) * across
    return np.stack([fibre, sheets, np.cross(fibre, sheets)], axis=2)


def bislerp(a: FloatArray, b: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Interpolate between frames on the shortest way, where a frame and its half turns are the same (Bayer, Alg. 1).

    A half turn about one of a frame's own axes reverses the other two, which for fibres is no change. Of the four
    frames that ``a`` can so be, the one nearest to ``b`` is taken; quaternions of a half turn about a frame's *own*
    axis come from multiplication on the right. Exactly at equal or opposite quaternions the interpolation is linear.

    Parameters
    ----------
    a, b : (n, 3, 3) arrays
        Frames (rotations) at t = 0 and t = 1.
    t : (n,) array
        0 to 1.

    Returns
    -------
    frames : (n, 3, 3) array
    signs : (n, 3) array
        1 or -1: by what each axis of ``a`` was multiplied.
    """
    qa, qb = _quaternions(a), _quaternions(b)
    w, x, y, z = qa.T
    turned = np.stack([qa, np.stack([-x, w, z, -y], 1), np.stack([-y, -z, w, x], 1), np.stack([-z, y, -x, w], 1)])
    choice = np.argmax(np.round(np.abs(np.einsum("kni,ni->kn", turned, qb)), 12), axis=0)  # the first of equals
    q = turned[choice, np.arange(len(qa))]
    dot = np.sum(q * qb, axis=1)
    q = np.where(dot[:, None] < 0, -q, q)
    angle = np.arccos(np.clip(np.abs(dot), 0.0, 1.0))
    sine = np.sin(angle)
    near = sine < 1e-7
    safe = np.where(near, 1.0, sine)
    left = np.where(near, 1 - t, np.sin((1 - t) * angle) / safe)
    right = np.where(near, t, np.sin(t * angle) / safe)
    signs = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return _matrices(unit_vectors(left[:, None] * q + right[:, None] * qb)), signs[choice]


def _quaternions(frames: FloatArray) -> FloatArray:
    """Unit quaternions (w, x, y, z) of rotations, from the largest of their four components (Shepperd 1978)."""
    m = frames
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    square = np.stack([trace, m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]], axis=1)
    pick = np.argmax(square, axis=1)
    minus = np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)
    plus = np.stack([m[:, 1, 0] + m[:, 0, 1], m[:, 0, 2] + m[:, 2, 0], m[:, 2, 1] + m[:, 1, 2]], axis=1)  # xy, xz, yz
    diagonal = 1 + 2 * square[:, 1:] - trace[:, None]
    table = np.stack(
        [
            np.column_stack([1 + trace, minus[:, 0], minus[:, 1], minus[:, 2]]),
            np.column_stack([minus[:, 0], diagonal[:, 0], plus[:, 0], plus[:, 1]]),
            np.column_stack([minus[:, 1], plus[:, 0], diagonal[:, 1], plus[:, 2]]),
            np.column_stack([minus[:, 2], plus[:, 1], plus[:, 2], diagonal[:, 2]]),
        ]
    )
    return unit_vectors(table[pick, np.arange(len(m))])


def _matrices(q: FloatArray) -> FloatArray:
    w, x, y, z = q.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1),
        ],
        axis=1,
    )
