"""A mesh in, the fields that its user gave its elements and points out: numbers under names that files can hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from femprep.export.deck.names import label
from femprep.model import TISSUES, VolumeMesh

#: Data that femprep makes itself: a format holds them in its own way (fibres as orientations), or not at all.
_OWN: Final = frozenset(
    {
        *("fiber", "sheet", "normal", "aha", "layer", "parent", "wall_region", "atrial_bundle", "template"),
        *("transmural", "apicobasal", "transventricular", "rotational", "rotational_cos", "rotational_sin"),
        *("pericardium", "pericardium_area", "pericardium_normal", "basal_ring"),
        *("thickness", "activation", "displacement"),
        *(f"{name}_share" for name in TISSUES),
    }
)


class UserField(NamedTuple):
    """A field of the user's.

    Attributes
    ----------
    own : str
        Its name in the mesh.
    name : str
        Its name in files: letters, digits and ``_``, different from those of all others.
    values : (n, k) array
        Of each element or point.
    """

    own: str
    name: str
    values: npt.NDArray[Any]

    def columns(self) -> Iterator[tuple[str, npt.NDArray[Any]]]:
        """Its components, each with its name: that of the field, with a number from 1 where there are several."""
        for i, column in enumerate(self.values.T, start=1):
            yield (self.name if self.values.shape[1] == 1 else f"{self.name}_{i}"), column


def user_fields(mesh: VolumeMesh) -> tuple[list[UserField], list[UserField]]:
    """Fields of elements and of points that femprep did not make, all values finite: decks hold no others."""
    taken: set[str] = set()
    return _fields(mesh.cell_data, "cells", taken), _fields(mesh.point_data, "points", taken)


def _fields(data: Mapping[str, Any], kind: str, taken: set[str]) -> list[UserField]:
    found: list[UserField] = []
    for own, values in data.items():
        if own in _OWN or not np.isfinite(values).all():
            continue
        name = label(own, len(found) + 1)
        while name.lower() in taken:
            name += f"_{kind}"
        taken.add(name.lower())
        array = np.asarray(values, dtype=np.uint8 if values.dtype == bool else None)
        found.append(UserField(own, name, array.reshape(len(array), -1)))
    return found
