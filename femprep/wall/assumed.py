"""What labels do not tell of the walls of a heart in, the notices of what was taken in its place out."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Final

import numpy as np

from femprep.model import Notice, Surface
from femprep.options import WallOptions
from femprep.wall.chambers.envelope import Envelope

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

#: What chambers are called, and the option that tells the thickness of their wall where it has no label.
_CHAMBERS: Final = {
    "rv": ("right ventricle", "rv_wall_thickness"),
    "la": ("left atrium", "atrial_wall_thickness"),
    "ra": ("right atrium", "atrial_wall_thickness"),
}


def assumed_wall(chamber: str, thickness: float) -> Notice:
    """That a chamber (``rv``, ``la``, ``ra``) has no labelled wall, and what thickness was taken for it, mm."""
    name, option = _CHAMBERS[chamber]
    words = f"the labels have no wall of the {name}: outside its cavity a wall of {{amount}} was assumed ({option})"
    return Notice.of("assumed", words, amount=thickness, unit="mm")


def closed_openings(options: WallOptions) -> list[Notice]:
    """That the openings of a whole heart were closed, where nobody asked for what the labels show."""
    if options.openings != "closed":
        return []
    which = "other openings than the given ones" if options.valves else "all valves and openings of vessels"
    words = (
        f"{which} were closed by tissue of at least {options.minimum_thickness:g} mm; openings = labels cuts those "
        "that the labels show"
    )
    return [Notice.of("assumed", words)]


def unused_structures(seg: Segmentation, used: Collection[str]) -> list[Notice]:
    """Which structures are labelled and named, but no part of the mesh."""
    gone = [
        name for name, labels in seg.structures.items() if name not in used and not set(labels).isdisjoint(seg.present)
    ]
    if not gone:
        return []
    labels = [number for name in gone for number in seg.structures[name]]
    names = ", ".join(name.replace("_", " ") for name in gone)
    words = f"labelled, but no part of the mesh: {names}, {{amount}}"
    return [Notice.of("left out", words, amount=np.count_nonzero(np.isin(seg.labels, labels)), unit="voxels")]


def filled_groove(body: Envelope, epi: Surface, folds: int) -> Notice:
    """How far an epicardium lies outside the body it should enclose closely, as grooves were filled for its sake."""
    away = body.values(epi.points)
    worst = int(away.argmax())
    words = (
        "the epicardium folds in a narrow groove between chambers: the groove was filled up by as much as {amount} "
        "near {place}"
    )
    if folds:
        words += f"; {folds} of its triangles fold still"
    return Notice.of("repaired", words, amount=max(float(away[worst]), 0.0), unit="mm", place=epi.points[worst])
