"""What the kinds of cases share: a case, label maps written, arguments of the main job."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import SimpleITK as sitk
from fuzz.damage import Random, choose
from fuzz.label_damage import LABELS, SCALES
from fuzz.sources import HEARTS, Sources

from femprep import Segmentation

#: Options that make a run a matter of seconds.
QUICK = ("--vertices", "300", "--quiet")
SWEEP = ("--mesher", "sweep", "--edge-length", "8", *QUICK)
FILLED = ("--edge-length", "6", "--quality", "fast", "--time-limit", "60", *QUICK)
#: Share of damaged files and options that may come to be meshed; the others are read, or refused, alone.
MESHED = 0.1
#: Files that meshes are written to, one of most formats.
TARGETS = ("out.vtu", "out.inp", "out.msh", "out.med", "out.feb", "out.mesh", "out.k", "out.pts")


@dataclass(frozen=True)
class Case:
    """One command.

    Attributes
    ----------
    kind : str
    number : int
    what : str
        What was done to its input.
    arguments : list of str
        Of ``femprep``.
    out : str
        File or folder it writes, relative to its folder; empty where it writes none.
    meshes : bool
        Whether it may come to meshing, which takes seconds.
    """

    kind: str
    number: int
    what: str
    arguments: list[str]
    out: str = ""
    meshes: bool = False


class Made(NamedTuple):
    """What a kind makes by a random generator, as :class:`Case` has it."""

    what: str
    arguments: list[str]
    out: str = ""
    meshes: bool = False


def write(path: Path, labels: np.ndarray, spacing: np.ndarray, direction: np.ndarray | None = None) -> None:
    """Write an array ``[i, j, k]`` as an image."""
    image = sitk.GetImageFromArray(np.ascontiguousarray(labels.T))
    image.SetSpacing([float(s) for s in spacing])
    if direction is not None:
        image.SetDirection(direction.ravel().tolist())
    sitk.WriteImage(image, str(path), useCompression=True)


def mesh(path: Path, anatomy: str, *arguments: str) -> list[str]:
    """Arguments of the main job."""
    return ["mesh", str(path), "-o", "out", "--preset", HEARTS[anatomy], "--anatomy", anatomy, *arguments]


def read(random: Random, path: Path, sources: Sources, done: str) -> Made:
    """A command on a damaged image: most often one that reads it alone."""
    if random.random() < MESHED:
        return Made(done, mesh(path, "lv", *SWEEP), "out", True)
    ball = str(sources.surfaces[0])
    return Made(done, ["compare", ball, ball, "--json", "--slices", str(path)])


def without_base(seg: Segmentation) -> np.ndarray:
    """Labels whose base is not to be found: refused when all options and all other files have been read."""
    array = np.array(seg.labels)
    array[array == seg.structures["myo"][0]] = 0
    array[0, 0, 0] = seg.structures["myo"][0]
    return array


def map_for_options(random: Random, seg: Segmentation, path: Path) -> bool:
    """Write the map, or most often the one without a base; whether it may be meshed."""
    whole = bool(random.random() < MESHED)
    write(path, np.array(seg.labels) if whole else without_base(seg), seg.grid.spacing)
    return whole


def one_of(random: Random, values: object) -> str:
    """One of some words."""
    return str(choose(random, values))


def damaged_labels(random: Random, labels: np.ndarray, fewest: int) -> tuple[np.ndarray, list[str]]:
    """Labels damaged in some ways, at most three, and their names."""
    names = [one_of(random, LABELS) for _ in range(int(random.integers(fewest, 4)))]
    for name in names:
        if len(np.unique(labels)) > 1:
            labels = LABELS[name](random, labels)
    return labels, names


def scaled(random: Random, spacing: np.ndarray, names: list[str]) -> np.ndarray:
    """Voxel sizes, most often as they are; what was done to them is added to the names."""
    scale = float(choose(random, SCALES))  # type: ignore[arg-type]
    scales = np.full(3, scale) if random.random() < 0.7 else np.array([1.0, 1.0, scale])
    if np.any(scales != 1.0):
        names.append(f"voxels x {scale:g}")
    return spacing * scales
