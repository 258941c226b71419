"""Fields on a mesh and a correspondence in, the fields on the other mesh out: numbers, tags, vectors and directions.

Within an element a field has the slope of its means at the nodes, so that a mesh gives itself its own values back. What
has a direction is told by its components along the axes of the wall, and made of them anew: it turns with the wall.
"""

from __future__ import annotations

from typing import Any, Final, Literal

import numpy as np

from femprep.anatomy.transfer.correspondence import Correspondence, PartPair
from femprep.anatomy.transfer.wall_frames import cell_frames, point_frames
from femprep.anatomy.wall_parts import WallPart
from femprep.errors import InputError
from femprep.mesh.search.locate import Located
from femprep.model import FloatArray, IntArray
from femprep.model.products import unit_vectors

Kind = Literal["number", "tag", "vector", "direction"]

#: Cosine and sine that an angle of the coordinates stands for.
_TURN: Final = ("rotational_cos", "rotational_sin")


def kind_of(values: Any, name: str = "") -> Kind:
    """What a field is: whole numbers are tags, vectors of unit length directions, whose two senses mean the same.

    Raises
    ------
    InputError
        It has other than one or three components, or holds no numbers.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "fiub" or array.ndim > 2 or (array.ndim == 2 and array.shape[1] != 3):
        raise InputError(
            f"field {name!r} has shape {array.shape} and type {array.dtype}; a number or three for each element "
            "or point can be transferred"
        )
    if array.ndim == 1:
        return "number" if array.dtype.kind == "f" else "tag"
    length = np.linalg.norm(array.astype(float), axis=1)
    some = length > 0.0
    return "direction" if some.any() and np.abs(length[some] - 1.0).max() < 1e-3 else "vector"


def carry_cells(found: Correspondence, values: Any, kind: Kind) -> Any:
    """A field of the source's elements on the target's; 0 in blood."""
    array = np.asarray(values)
    out = np.zeros((found.target.n_cells, *array.shape[1:]), dtype=array.dtype)
    for pair in found.pairs:
        own = array[pair.source.cells]
        element = pair.source.tets[1][pair.cells.tet]
        out[pair.target.cells] = own[element] if kind == "tag" else _cells(pair, own.astype(float), element, kind)
    return out


def carry_points(found: Correspondence, values: Any, kind: Kind) -> Any:
    """A field of the source's points on the target's; 0 in blood."""
    array = np.asarray(values)
    out = np.zeros((len(found.target.points), *array.shape[1:]), dtype=array.dtype)
    for pair in reversed(found.pairs):  # where parts meet, the left ventricle tells
        own, at = array[pair.source.points], pair.points
        if kind == "tag":
            new = own[np.take_along_axis(at.nodes, at.weights.argmax(axis=1)[:, None], axis=1)[:, 0]]
        elif kind == "number":
            new = at.at(own.astype(float))
        else:
            local = _components(own.astype(float), point_frames(pair.source))
            new = _anew(_mixed(local, at, kind), point_frames(pair.target))
        out[pair.target.points] = new
    return out


def _cells(pair: PartPair, own: FloatArray, element: IntArray, kind: Kind) -> FloatArray:
    """Values of a part's elements at the places of another one's: those there, and their slope to the place."""
    if kind == "number":
        moved = own[element] + _slope(pair.source, own, pair.cells, element)
        return np.clip(moved, own.min(), own.max())
    local = _components(own, cell_frames(pair.source))
    if kind == "vector":
        return _anew(local[element] + _slope(pair.source, local, pair.cells, element), cell_frames(pair.target))
    product = np.einsum("ni,nj->nij", local, local)
    tensor = product[element] + _slope(pair.source, product, pair.cells, element)
    return _anew(_along(tensor, local[element]), cell_frames(pair.target))


def _slope(part: WallPart, own: FloatArray, at: Located, element: IntArray) -> FloatArray:
    """By how much the means at the nodes differ between a place and the centre of its element."""
    space = part.space
    nodal = space.to_nodes(own)
    compact = np.zeros(len(part.mesh.points), dtype=np.int64)
    compact[space.nodes] = np.arange(space.n)
    there = np.einsum("qi,qi...->q...", at.weights, nodal[compact[at.nodes]])
    return np.asarray(there - space.to_cells(nodal)[element])


def _mixed(local: FloatArray, at: Located, kind: Kind) -> FloatArray:
    if kind == "vector":
        return at.at(local)
    nearest = np.take_along_axis(at.nodes, at.weights.argmax(axis=1)[:, None], axis=1)[:, 0]
    return _along(at.at(np.einsum("ni,nj->nij", local, local)), local[nearest])


def _along(tensor: FloatArray, sense: FloatArray) -> FloatArray:
    """Unit vectors along the largest axis of tensors ``(q, 3, 3)``, the way of ``sense``; 0 where that is 0."""
    axis = np.linalg.eigh(tensor)[1][:, :, 2]
    return np.asarray(axis * np.sign(np.sum(axis * sense, axis=1, keepdims=True)))


def _components(vectors: FloatArray, frames: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nik,ni->nk", frames, vectors))


def _anew(local: FloatArray, frames: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nik,nk->ni", frames, local))


def put_right(fields: dict[str, Any]) -> None:
    """Mend what belongs together: sheets across fibres, normals across both; cosine and sine of one angle."""
    if "fiber" in fields and "sheet" in fields:
        fibre, sheet = fields["fiber"].astype(float), fields["sheet"].astype(float)
        sheet = unit_vectors(sheet - np.sum(sheet * fibre, axis=1, keepdims=True) * fibre)
        fields["sheet"] = sheet.astype(fields["sheet"].dtype)
        if "normal" in fields:
            normal = np.cross(fibre, sheet)
            sense = np.sign(np.sum(normal * fields["normal"], axis=1, keepdims=True))
            fields["normal"] = np.where(sense == 0, normal, sense * normal).astype(fields["normal"].dtype)
    if all(name in fields for name in _TURN):
        size = np.hypot(*(fields[name] for name in _TURN))
        for name in _TURN:
            fields[name] = np.divide(fields[name], size, out=np.zeros_like(fields[name]), where=size > 0.0)
