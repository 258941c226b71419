"""A kind, a seed and a number in; a command of femprep on inputs damaged accordingly out, the same every time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from fuzz import image_cases, mesh_cases, option_cases, several_images_cases, surface_cases
from fuzz.common import Case, Made
from fuzz.damage import Random
from fuzz.odd_cases import odd
from fuzz.sources import Sources

__all__ = ["KINDS", "ODD", "REAL", "Case", "make_case"]

#: The kind that needs real label maps, from the folder ``FEMPREP_DATA``.
REAL = "real labels"
#: The kind whose cases have names: its numbers go through them, whatever the seed.
ODD = "odd"

#: What makes the cases of each kind. A case follows from the place of its kind: new ones come last.
KINDS: dict[str, Callable[[Random, Sources, Path], Made]] = {
    "labels": image_cases.labels,
    "header": image_cases.header,
    "bytes": image_cases.raw_bytes,
    "affine": image_cases.affine,
    "options": option_cases.options,
    "toml": option_cases.toml,
    "mesh file": mesh_cases.mesh_file,
    "surface file": surface_cases.surface_file,
    "annotate": mesh_cases.annotate,
    "refine": mesh_cases.refine,
    "transfer": mesh_cases.transfer,
    "activate": mesh_cases.activate,
    "template": mesh_cases.template,
    "own surfaces": surface_cases.own_surfaces,
    "masks": several_images_cases.masks,
    "segments": several_images_cases.segments,
    "frames": several_images_cases.frames,
    "second images": several_images_cases.second_images,
    "table": option_cases.table,
    REAL: image_cases.real_labels,
    ODD: partial(odd, 0),
}


def make_case(kind: str, seed: int, number: int, sources: Sources, folder: Path) -> Case:
    """The case of a kind with a number, its files written into a folder."""
    random = np.random.default_rng([seed, list(KINDS).index(kind), number])
    made = partial(odd, number) if kind == ODD else KINDS[kind]
    return Case(kind, number, *made(random, sources, folder))
