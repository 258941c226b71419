"""Label maps in, damaged ones out: what segmentations come to by hand, by networks, by conversions and by accident."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from fuzz.damage import Random, choose
from scipy import ndimage

Labels = np.ndarray


def _dropped(random: Random, labels: Labels) -> Labels:
    keep = random.random(labels.shape[2]) > 0.4
    keep[random.integers(labels.shape[2], size=2)] = True
    return labels[:, :, keep]


def _emptied(random: Random, labels: Labels) -> Labels:
    out = labels.copy()
    out[:, :, random.integers(labels.shape[2], size=int(random.integers(1, 4)))] = 0
    return out


def _shifted(random: Random, labels: Labels) -> Labels:
    out, reach = labels.copy(), int(choose(random, (2, 6, 20)))  # type: ignore[call-overload]
    for k in range(labels.shape[2]):
        out[:, :, k] = np.roll(labels[:, :, k], random.integers(-reach, reach + 1, 2), (0, 1))
    return out


def _swapped(random: Random, labels: Labels) -> Labels:
    a, b = random.choice(np.unique(labels), 2)
    return np.where(labels == a, b, np.where(labels == b, a, labels)).astype(labels.dtype)


def _thinned(random: Random, labels: Labels) -> Labels:
    number = random.choice(np.unique(labels)[1:])
    kept = ndimage.binary_erosion(labels == number, np.ones((3, 3, 1)), iterations=int(random.integers(1, 4)))
    return np.where((labels == number) & ~kept, 0, labels).astype(labels.dtype)


def _grown(random: Random, labels: Labels) -> Labels:
    number = random.choice(np.unique(labels)[1:])
    grown = ndimage.binary_dilation(labels == number, np.ones((3, 3, 1)), iterations=int(random.integers(1, 5)))
    return np.where(grown, number, labels).astype(labels.dtype)


def _bridged(random: Random, labels: Labels) -> Labels:
    out, number = labels.copy(), random.choice(np.unique(labels))
    a, b = (random.integers(0, labels.shape) for _ in range(2))
    for share in np.linspace(0.0, 1.0, 200):
        out[tuple(np.rint(a + share * (b - a)).astype(int))] = number
    return out


def _cropped(random: Random, labels: Labels) -> Labels:
    low = [int(random.integers(0, max(n // 3, 1))) for n in labels.shape]
    high = [n - int(random.integers(0, max(n // 3, 1))) for n in labels.shape]
    return labels[tuple(slice(a, max(b, a + 1)) for a, b in zip(low, high, strict=True))]


def _turned(random: Random, labels: Labels) -> Labels:
    return np.transpose(labels, random.permutation(3))


def _mirrored(random: Random, labels: Labels) -> Labels:
    return np.flip(labels, int(random.integers(3)))


def _speckled(random: Random, labels: Labels) -> Labels:
    share = float(choose(random, (0.001, 0.01, 0.1, 0.5)))  # type: ignore[arg-type]
    largest = float(labels.max())  # of an image to sample it may be no number
    noise = random.integers(0, (int(largest) if abs(largest) < 1e6 else 3) + 2, labels.shape)
    return np.where(random.random(labels.shape) < share, noise, labels).astype(labels.dtype)


def _few(random: Random, labels: Labels) -> Labels:
    first = int(random.integers(max(labels.shape[2] - 4, 1)))
    return labels[:, :, first : first + int(random.integers(1, 5))]


def _hollow(random: Random, labels: Labels) -> Labels:
    number = random.choice(np.unique(labels)[1:])
    core = ndimage.binary_erosion(labels == number, iterations=2)
    return np.where(core, 0, labels).astype(labels.dtype)


def _half(random: Random, labels: Labels) -> Labels:
    out, axis = labels.copy(), int(random.integers(3))
    np.moveaxis(out, axis, 0)[: labels.shape[axis] // 2] = int(random.integers(4))
    return out


def _coarse(random: Random, labels: Labels) -> Labels:
    step = int(random.integers(2, 6))
    return labels[::step, ::step]


def _rotated(random: Random, labels: Labels) -> Labels:
    axes = (0, 1) if random.random() < 0.5 else (int(random.integers(2)), 2)
    angle = float(random.uniform(-90.0, 90.0))
    return np.asarray(ndimage.rotate(labels, angle, axes, order=0, reshape=bool(random.integers(2))))


def _holed(random: Random, labels: Labels) -> Labels:
    out = labels.copy()
    for _ in range(int(random.integers(1, 6))):
        at, half = random.integers(0, labels.shape), random.integers(1, 5, 3)
        out[tuple(slice(max(a - h, 0), a + h) for a, h in zip(at, half, strict=True))] = 0
    return out


def _opened(random: Random, labels: Labels) -> Labels:
    """A sector of the wall is the background, as where a network lost the lateral wall."""
    middle = np.argwhere(labels).mean(axis=0)
    i, j = np.mgrid[: labels.shape[0], : labels.shape[1]]
    turn = np.arctan2(j - middle[1], i - middle[0]) - random.uniform(-np.pi, np.pi)
    sector = np.abs((turn + np.pi) % (2 * np.pi) - np.pi) < random.uniform(0.05, 1.0)
    number = random.choice(np.unique(labels)[1:])
    return np.where(sector[:, :, None] & (labels == number), 0, labels).astype(labels.dtype)


def _slice_in_the_middle(random: Random, labels: Labels) -> int:
    held = np.flatnonzero(labels.any(axis=(0, 1)))
    return int(random.choice(held[len(held) // 4 : max(3 * len(held) // 4, len(held) // 4 + 1)]))


def _pinned(random: Random, labels: Labels) -> Labels:
    """One voxel of a slice in the middle has another label, in the heart or beside it."""
    out, k = labels.copy(), _slice_in_the_middle(random, labels)
    near = np.argwhere(ndimage.binary_dilation(labels[:, :, k] > 0, iterations=3))
    out[(*random.choice(near), k)] = int(random.integers(4))
    return out


def _one_slice(random: Random, labels: Labels) -> Labels:
    """One slice in the middle is damaged by some other way."""
    out, k = labels.copy(), _slice_in_the_middle(random, labels)
    ways = (_swapped, _thinned, _grown, _hollow, _opened, _speckled, _offset)
    way = ways[int(random.integers(len(ways)))]
    if len(np.unique(labels[:, :, k])) > 1:
        out[:, :, k] = way(random, labels[:, :, k : k + 1])[:, :, 0]
    return out


def _parted(random: Random, labels: Labels) -> Labels:
    """A label runs through the heart as a band, in all slices."""
    middle = np.argwhere(labels).mean(axis=0)
    i, j = np.mgrid[: labels.shape[0], : labels.shape[1]]
    angle = random.uniform(0.0, np.pi)
    away = np.abs((i - middle[0]) * np.cos(angle) + (j - middle[1]) * np.sin(angle) - random.uniform(-3.0, 3.0))
    band = (away < float(choose(random, (0.5, 1.0, 2.0))))[:, :, None]  # type: ignore[arg-type]
    return np.where(band & (labels > 0), int(random.integers(4)), labels).astype(labels.dtype)


def _reordered(random: Random, labels: Labels) -> Labels:
    order = random.permutation(labels.shape[2]) if random.random() < 0.5 else np.roll(np.arange(labels.shape[2]), 3)
    return labels[:, :, order]


def _repeated(random: Random, labels: Labels) -> Labels:
    return np.repeat(labels, random.integers(1, 4, labels.shape[2]), axis=2)


def _padded(random: Random, labels: Labels) -> Labels:
    number = int(choose(random, (0, 0, 1, 7)))  # type: ignore[call-overload]
    return np.pad(labels, [tuple(random.integers(0, 12, 2)) for _ in range(3)], constant_values=number)


def _offset(random: Random, labels: Labels) -> Labels:
    """Other numbers: all labels one higher, or all the same."""
    if random.random() < 0.3:
        return np.where(labels > 0, 1, 0).astype(labels.dtype)
    return (labels + labels.dtype.type(random.integers(1, 200))).astype(labels.dtype)


#: What may be done to a label map, by name.
LABELS: dict[str, Callable[[Random, Labels], Labels]] = {
    "slices dropped": _dropped,
    "slices emptied": _emptied,
    "slices shifted": _shifted,
    "labels swapped": _swapped,
    "thinned": _thinned,
    "grown": _grown,
    "bridged": _bridged,
    "cropped": _cropped,
    "turned": _turned,
    "mirrored": _mirrored,
    "speckled": _speckled,
    "few slices": _few,
    "hollow": _hollow,
    "half gone": _half,
    "coarse": _coarse,
    "rotated": _rotated,
    "holed": _holed,
    "opened": _opened,
    "one voxel": _pinned,
    "one slice": _one_slice,
    "parted": _parted,
    "slices reordered": _reordered,
    "slices repeated": _repeated,
    "padded": _padded,
    "other numbers": _offset,
}
#: What voxel sizes are multiplied by.
SCALES = (1.0, 1.0, 1.0, 1.0, 1e3, 1e-3, 10.0, 0.1, 0.5, 2.0)
