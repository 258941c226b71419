"""A mesh in, the one its page shows out: of many elements those of a coarser mesh, with the finer one's fields.

The view takes fifteen bytes an element, so that a page of millions of them would not open. A refined mesh knows the
coarser ones it was cut from: the first that is small enough is shown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from femprep.anatomy import wall_thickness
from femprep.mesh.measures.volume_elements import all_volumes
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.model.products import unit_vectors
from femprep.report.pictures.bullseyes import quality_measures
from femprep.report.pictures.drawn import MOST

#: Measures of quality that are shown.
QUALITY: Final = ("mean_ratio", "minimum_dihedral")


@dataclass(frozen=True, eq=False)
class Shown:
    """What a page shows of a mesh.

    Attributes
    ----------
    mesh : VolumeMesh
        The mesh itself, or one that it is a refinement of, with its regions, segments and fibres.
    fields : mapping of str to (n,) array
        ``thickness`` (where there is a wall) and the measures of ``QUALITY``, at its elements.
    whole : mapping of str to (m,) array
        The same at the elements of the mesh itself.
    parent : (m,) array, optional
        The element shown that each element of the mesh is a part of; none where all are shown.
    note : str
        What the page says of it; empty where all are shown.
    """

    mesh: VolumeMesh
    fields: Mapping[str, FloatArray]
    whole: Mapping[str, FloatArray]
    parent: IntArray | None = None
    note: str = ""

    def element(self, number: int) -> int:
        """The element shown that an element of the mesh is a part of."""
        return number if self.parent is None else int(self.parent[number])


def shown(mesh: VolumeMesh, most: int = MOST) -> Shown:
    """Measure a mesh, and choose what of it is shown.

    Fields of a coarser mesh are the mean by volume of those of its parts, measures of quality the worst of them,
    regions and segments those that most of the parts have.

    Parameters
    ----------
    mesh : VolumeMesh
    most : int
        Elements above which a coarser mesh is shown.
    """
    whole = quality_measures(mesh, QUALITY)
    if sum(name == "epi" or name.startswith("endo") for name in mesh.facet_names) > 1:
        whole = {"thickness": wall_thickness(mesh), **whole}
    coarse, parent, levels = mesh, None, 0
    while coarse.n_cells > most and coarse.nested is not None:
        own = coarse.nested.parent
        parent = own if parent is None else own[parent]
        coarse, levels = coarse.nested.coarse, levels + 1
    if parent is None:
        return Shown(mesh, whole, whole)
    count = coarse.n_cells
    volume = all_volumes(mesh.points, mesh.cells)
    fields = {
        name: _mean(values, volume, parent, count) if name == "thickness" else _least(values, parent, count)
        for name, values in whole.items()
    }
    data: dict[str, Any] = {}
    if "aha" in mesh.cell_data:
        data["aha"] = _most(np.asarray(mesh.cell_data["aha"]), parent, count)
    if "fiber" in mesh.cell_data:
        data["fiber"] = _direction(np.asarray(mesh.cell_data["fiber"]), parent, count)
    region = _most(mesh.region, parent, count)
    note = (
        f"Shown are the {count} elements that the mesh's {mesh.n_cells} were cut from, {8**levels} from each: fields "
        "are their mean, quality that of the worst of them."
    )
    return Shown(replace(coarse, region=region, cell_data=data, planes=mesh.planes), fields, whole, parent, note)


def _mean(values: FloatArray, weight: FloatArray, parent: IntArray, count: int) -> FloatArray:
    total = np.bincount(parent, weights=weight, minlength=count)
    return np.bincount(parent, weights=weight * values, minlength=count) / np.where(total > 0.0, total, 1.0)


def _least(values: FloatArray, parent: IntArray, count: int) -> FloatArray:
    out = np.full(count, np.inf)
    np.minimum.at(out, parent, values)
    return np.where(np.isfinite(out), out, np.nan)


def _most(tags: Any, parent: IntArray, count: int) -> Any:
    """The tag that most parts of each element have, the smallest of equals."""
    every = np.unique(tags)
    best, found = np.zeros(count), np.full(count, every[0])
    for tag in every:
        here = np.bincount(parent[tags == tag], minlength=count)
        found[here > best] = tag
        best = np.maximum(best, here)
    return found.astype(tags.dtype)


def _direction(vectors: FloatArray, parent: IntArray, count: int) -> FloatArray:
    """The mean of the parts' directions, each turned towards the first of them; of unit length."""
    first = np.zeros((count, 3))
    first[parent[::-1]] = vectors[::-1]
    sign = np.where(np.einsum("ij,ij->i", vectors, first[parent]) < 0.0, -1.0, 1.0)
    sums = [np.bincount(parent, weights=sign * column, minlength=count) for column in vectors.T]
    total = np.stack(sums, axis=1).astype(np.float64)
    return np.where(np.any(total, axis=1, keepdims=True), unit_vectors(total), first)
