"""A named mesh in; axes, coordinates, segments and fibres on its ventricles out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from femprep.anatomy import WallFields, add_aha, add_atrial_fibres, add_coordinates, add_fibres, ventricular_axes
from femprep.anatomy.part import part_of, spread_over
from femprep.annotation.reading import CavityOpening
from femprep.annotation.shell import shell_of
from femprep.mesh.elements import FACET_CORNERS
from femprep.mesh.numbering import set_numbers
from femprep.mesh.topology import components
from femprep.model import FACET_TAGS, REGION_TAGS, BoolArray, VolumeMesh
from femprep.model.blocks import block_rows, chosen_rows
from femprep.options import FibreOptions

#: Regions that coordinates, segments and fibres are of.
_VENTRICLES = ("lv", "rv", "septum")


def with_anatomy(mesh: VolumeMesh, options: FibreOptions, openings: Sequence[CavityOpening] = ()) -> VolumeMesh:
    """The mesh with coordinates, segments and fibres on its ventricles; fibres of atria, where asked for or alone."""

    def add(part: VolumeMesh) -> VolumeMesh:
        axes = ventricular_axes(part, mirrored=options.mirrored)
        fields = WallFields(part, axes)
        for one in (add_coordinates, add_aha):
            part = one(part, axes=axes, fields=fields)
        return add_fibres(part, options, axes=axes, fields=fields)

    alone = is_atrium(mesh)
    found = mesh if alone else on_ventricles(mesh, add)
    if options.atria == "none" and not alone:
        return found
    return add_atrial_fibres(found, options.veins, [one.centre for one in openings if one.name == "veins"])


def is_atrium(mesh: VolumeMesh) -> bool:
    """Whether a mesh is of one atrium or both, without ventricles."""
    regions = set(mesh.region_names)
    return bool(regions & {"la", "ra"}) and not regions & set(_VENTRICLES)


def on_ventricles(mesh: VolumeMesh, add: Callable[[VolumeMesh], VolumeMesh]) -> VolumeMesh:
    """Add data to the ventricles of a mesh that has atria and vessels too; where it has none, to all of it.

    Where ventricles border on atria and vessels is their base. Elsewhere the data are 0, the directions those of the
    coordinate axes.
    """
    chosen = np.isin(mesh.region, [REGION_TAGS[name] for name in _VENTRICLES])
    if chosen.any():
        chosen = _largest(mesh, chosen)
    if chosen.all() or not chosen.any():
        return add(mesh)
    part, cells, nodes, facets = part_of(mesh, chosen)
    based = _with_base(part)
    found = add(based)
    new = {
        "cell": spread_over(found.cell_data, based.cell_data, cells, mesh.n_cells),
        "point": spread_over(found.point_data, based.point_data, nodes, len(mesh.points)),
        "facet": spread_over(
            {name: values[: part.n_facets] for name, values in found.facet_data.items()},
            based.facet_data,
            facets,
            mesh.n_facets,
        ),
    }
    return replace(mesh.with_data(**new), info={**mesh.info, **found.info})


def _largest(mesh: VolumeMesh, chosen: BoolArray) -> BoolArray:
    """The largest piece of some elements; smaller ones hang on the rest of the heart alone."""
    blocks = chosen_rows(mesh.cells, chosen)
    ends = [np.repeat(np.arange(own.start, own.stop), block.shape[1]) for _, block, own in block_rows(blocks)]
    cell, node = np.concatenate(ends), np.concatenate([block.ravel() for block in blocks.values()])
    count = int(chosen.sum())
    piece = components(cell, count + node, count + len(mesh.points))[:count]
    out = np.zeros(len(chosen), dtype=bool)
    out[np.flatnonzero(chosen)[piece == np.bincount(piece).argmax()]] = True
    return out


def _with_base(part: VolumeMesh) -> VolumeMesh:
    """The ventricles with the facets at which they were cut off tagged as base, behind those they had."""
    shell = shell_of(part)
    blocks, tags = {}, []
    for kind, block in shell.facets.items():
        corners = FACET_CORNERS[kind]
        have = part.facets.get(kind, np.empty((0, block.shape[1]), dtype=np.int64))
        number = set_numbers(block[:, :corners], have[:, :corners])
        fresh = block[~np.isin(number[: len(block)], number[len(block) :])]
        first = next((own for name, _, own in block_rows(part.facets) if name == kind), slice(0, 0))
        blocks[kind] = np.concatenate([have, fresh])
        tags += [part.facet_tag[first], np.full(len(fresh), FACET_TAGS["base"], dtype=np.int32)]
    return replace(part, facets=blocks, facet_tag=np.concatenate(tags), facet_data={})
