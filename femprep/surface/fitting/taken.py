"""All attempts to lay a template in; the best of them with its shape and record out, or an error that has them all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from femprep.errors import StageError
from femprep.mesh.patches import PatchSurface
from femprep.model import FloatArray, Notice, noted, split_quads
from femprep.model.products import product
from femprep.surface.fitting.laying import Laid
from femprep.surface.fitting.place import Placed
from femprep.surface.fitting.placed_parametrisation import PlacedShape
from femprep.surface.fitting.slide import Connectivity
from femprep.surface.fitting.ways import LAYING_WAYS, FitAttempt, told


class NoSurfaceError(StageError):
    """No attempt gave a template without crossing or folded triangles.

    Attributes
    ----------
    attempts : tuple of FitAttempt
    """

    def __init__(self, message: str, attempts: Iterable[FitAttempt]) -> None:
        super().__init__(message)
        self.attempts = tuple(attempts)


@dataclass(frozen=True, eq=False)
class Taken:
    """The attempt that is taken.

    Attributes
    ----------
    surface : PatchSurface
        The smooth surface, in coordinates of its own.
    placed : Placed
        The template on it, in those coordinates.
    redrawn : bool
        Whether its triangles were drawn on the surface anew, without a map.
    attempts : tuple of FitAttempt
        All of them, in order.
    """

    surface: PatchSurface
    placed: Placed
    redrawn: bool
    attempts: tuple[FitAttempt, ...]

    @classmethod
    def of(cls, tried: Sequence[Laid], refusal: str) -> Taken:
        """The best of some attempts.

        Raises
        ------
        NoSurfaceError
            None is sound; ``refusal`` is the message.
        """
        best = min(tried, key=lambda one: one.short)
        if best.shape is None or best.placed is None or best.short == np.inf:
            raise NoSurfaceError(refusal, [each.attempt for each in tried])
        attempts = [
            each.attempt.model_copy(update={"status": "taken"}) if each is best else each.attempt for each in tried
        ]
        return cls(best.shape, best.placed, best.attempt.way == LAYING_WAYS[-1].name, tuple(attempts))

    def shape(self, axes: FloatArray, centre: FloatArray) -> PlacedShape:
        """The surface as a map from the sphere; columns ``axes`` and ``centre`` tell where its coordinates lie."""
        placed, directions = self.placed, product(self.placed.directions, axes.T)
        return PlacedShape(self.surface, directions, split_quads(placed.cells), placed.points, axes, centre)

    def info(self, name: str, connectivity: Connectivity) -> dict[str, Any]:
        """The record of a surface of some name: how the template was laid, all attempts, and what there is to say."""
        words = f"surface {name} is too long or branched "
        notices = []
        if self.redrawn:
            words += "to be covered from a sphere; its triangles were drawn anew, and vertices lie less exactly where "
            notices.append(Notice.of("repaired", words + "those of the same number lie in other phases and hearts"))
        elif self.placed.flips and connectivity == "auto":
            words += "for even triangles in the template's order; edges were flipped"
            notices.append(Notice.of("repaired", words))
        record = {
            "steps": self.placed.steps,
            "flips": self.placed.flips,
            "redrawn": self.redrawn,
            "attempts": told(self.attempts),
            "notices": [],
        }
        return noted(record, *notices)
