"""A label map in, the same heart stored, moved or written in another way out; what the tests and a benchmark share."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import femprep as fp


class Way(NamedTuple):
    """Another way to have the same heart.

    Attributes
    ----------
    change : callable
        The segmentation in, the same heart the other way out.
    turn : (3, 3) array
        What it moves the heart by: ``x @ turn.T + shift``.
    shift : (3,) array
    rounding : float
        How far places may move, mm: a NIfTI file holds them in single precision.
    """

    change: Callable[[fp.Segmentation], fp.Segmentation]
    turn: np.ndarray = np.eye(3)
    shift: np.ndarray = np.zeros(3)
    rounding: float = 1e-9

    def back(self, points: np.ndarray) -> np.ndarray:
        """Points of the changed heart where the heart was."""
        return (points - self.shift) @ self.turn


def stored(seg: fp.Segmentation, order: tuple[int, ...], flipped: tuple[int, ...]) -> fp.Segmentation:
    """The same voxels at the same places, stored along other axes, and some of these backwards."""
    grid, labels = seg.grid, np.flip(np.transpose(seg.labels, order), flipped)
    direction = np.array(grid.direction)[:, order]
    corner = np.zeros(3)
    for axis in flipped:
        corner[order[axis]] = grid.shape[order[axis]] - 1
        direction[:, axis] *= -1.0
    spacing = np.array(grid.spacing)[list(order)]
    own = fp.Grid(labels.shape, spacing, grid.to_world(corner[None])[0], direction)
    return fp.Segmentation(np.ascontiguousarray(labels), own, seg.structures)


def padded(seg: fp.Segmentation, low: tuple[int, int, int], high: tuple[int, int, int]) -> fp.Segmentation:
    """So many more voxels of background at the ends."""
    labels = np.pad(seg.labels, list(zip(low, high, strict=True)))
    origin = seg.grid.to_world(-np.array([low], dtype=float))[0]
    return fp.Segmentation(labels, fp.Grid(labels.shape, seg.grid.spacing, origin, seg.grid.direction), seg.structures)


def cropped(seg: fp.Segmentation) -> fp.Segmentation:
    """No voxel of background beyond the heart."""
    used = np.argwhere(seg.labels > 0)
    low, high = used.min(axis=0), used.max(axis=0) + 1
    labels = seg.labels[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    origin = seg.grid.to_world(low[None].astype(float))[0]
    grid = fp.Grid(labels.shape, seg.grid.spacing, origin, seg.grid.direction)
    return fp.Segmentation(np.array(labels), grid, seg.structures)


def renumbered(seg: fp.Segmentation) -> fp.Segmentation:
    """Other numbers, in another order, of another type."""
    numbers = {name: 50000 - 700 * k for k, name in enumerate(seg.structures)}
    labels = np.zeros(seg.labels.shape, dtype=np.int32)
    for name, number in numbers.items():
        labels[np.isin(seg.labels, seg.structures[name])] = number
    return fp.Segmentation(labels, seg.grid, {name: (number,) for name, number in numbers.items()})


def moved(seg: fp.Segmentation, turn: np.ndarray, shift: np.ndarray) -> fp.Segmentation:
    """The heart somewhere else in the world."""
    grid = seg.grid
    own = fp.Grid(grid.shape, grid.spacing, turn @ grid.origin + shift, turn @ np.array(grid.direction))
    return fp.Segmentation(seg.labels, own, seg.structures)


def filed(seg: fp.Segmentation, ending: str) -> fp.Segmentation:
    """As it comes back from a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"heart{ending}"
        fp.write_segmentation(seg, path)
        return fp.read_segmentation(path, structures=dict(seg.structures))


def _moving(turn: np.ndarray, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Way:
    return Way(lambda seg: moved(seg, turn, np.array(shift)), turn, np.array(shift))


_ANY = Rotation.from_euler("xyz", [1.1, 0.4, -2.0]).as_matrix()
_QUARTERS = {"x": "a quarter about x", "y": "a quarter about y", "z": "a quarter about z"}
WAYS: dict[str, Way] = {
    "axes k, i, j": Way(lambda seg: stored(seg, (2, 0, 1), ())),
    "axes j, i, k": Way(lambda seg: stored(seg, (1, 0, 2), ())),
    "axes k, j, i": Way(lambda seg: stored(seg, (2, 1, 0), ())),
    "slices backwards": Way(lambda seg: stored(seg, (0, 1, 2), (2,))),
    "i and j backwards": Way(lambda seg: stored(seg, (0, 1, 2), (0, 1))),
    "i and k backwards": Way(lambda seg: stored(seg, (0, 1, 2), (0, 2))),
    "axes j, k, i, one backwards": Way(lambda seg: stored(seg, (1, 2, 0), (1,))),
    "all backwards": Way(lambda seg: stored(seg, (0, 1, 2), (0, 1, 2))),
    "padded": Way(lambda seg: padded(seg, (3, 0, 2), (0, 7, 1))),
    "cropped": Way(cropped),
    "other numbers and type": Way(renumbered),
    **{words: _moving(np.round(Rotation.from_euler(a, np.pi / 2).as_matrix())) for a, words in _QUARTERS.items()},
    "turned and shifted": _moving(_ANY, (5.0, 0.0, -3.0)),
    "2.6 m away": _moving(np.eye(3), (2000.0, -1500.0, 800.0)),
    "another way in all": Way(
        lambda seg: stored(padded(moved(renumbered(seg), _ANY, np.zeros(3)), (1, 2, 3), (0, 1, 0)), (2, 0, 1), (0, 2)),
        _ANY,
    ),
    "NRRD, axes k, i, j": Way(lambda seg: filed(stored(seg, (2, 0, 1), (1,)), ".nrrd")),
    "NIfTI, axes j, i, k": Way(lambda seg: filed(stored(seg, (1, 0, 2), (0,)), ".nii"), rounding=1e-4),
    "NIfTI, packed": Way(lambda seg: filed(seg, ".nii.gz"), rounding=1e-4),
}
