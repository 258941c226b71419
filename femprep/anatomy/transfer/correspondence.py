"""Two meshes with ventricular coordinates in; where in the one the elements and points of the other lie, out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femprep.anatomy.wall_parts import PARTS, WallPart, depth_chart
from femprep.errors import InputError
from femprep.mesh.search.locate import Located, Locator
from femprep.model import FACET_TAGS, FloatArray, VolumeMesh


@dataclass(frozen=True, eq=False)
class PartPair:
    """The same part of both walls.

    Attributes
    ----------
    source, target : WallPart
    cells, points : Located
        Where the target's elements (their centres) and points have the source's coordinates; tetrahedra are those of
        ``source.tets``.
    """

    source: WallPart
    target: WallPart
    cells: Located
    points: Located


@dataclass(frozen=True, eq=False)
class Correspondence:
    """Where in one wall the elements and points of another one lie, by their coordinates.

    Attributes
    ----------
    source, target : VolumeMesh
    pairs : tuple of PartPair
        One for each part of the wall. A point that two parts share is in both.
    """

    source: VolumeMesh
    target: VolumeMesh
    pairs: tuple[PartPair, ...]

    def places(self) -> tuple[FloatArray, FloatArray]:
        """Where in the source the target's elements ``(n_cells, 3)`` and points ``(n, 3)`` lie, mm; NaN in blood."""
        cells, points = np.full((self.target.n_cells, 3), np.nan), np.full((len(self.target.points), 3), np.nan)
        for pair in reversed(self.pairs):
            cells[pair.target.cells] = pair.cells.at(pair.source.mesh.points)
            points[pair.target.points] = pair.points.at(pair.source.mesh.points)
        return cells, points


def paired(source: VolumeMesh, target: VolumeMesh, sources: list[WallPart], targets: list[WallPart]) -> Correspondence:
    """Find the elements and points of a mesh in another one by their ventricular coordinates, part by part.

    Raises
    ------
    InputError
        Coordinates are missing, or the anatomy of the meshes differs.
    """
    require_same_anatomy(source, target, sources, targets)
    pairs = []
    for one, other in zip(sources, targets):
        locator = Locator(one.tets[0], depth_chart(one, one.sizes))
        places = depth_chart(other, one.sizes)
        space = other.space
        pairs.append(PartPair(one, other, locator(space.to_cells(places[space.nodes])), locator(places)))
    return Correspondence(source, target, tuple(pairs))


def require_same_anatomy(
    source: VolumeMesh, target: VolumeMesh, sources: list[WallPart], targets: list[WallPart]
) -> None:
    """Make sure that two walls have the same parts, and both or neither a cut apex.

    Raises
    ------
    InputError
    """
    have, want = ([part.number for part in parts] for parts in (sources, targets))
    if have != want:
        words = [" and ".join(PARTS[number] for number in own) for own in (have, want)]
        raise InputError(f"the anatomy differs: the source has {words[0]}, the target {words[1]}; give like meshes")
    cut = [bool(np.any(mesh.facet_tag == FACET_TAGS["apex"])) for mesh in (source, target)]
    if cut[0] != cut[1]:
        which = "source" if cut[0] else "target"
        raise InputError(
            f"the wall of the {which} is cut off at its apex and the other one's is closed, so that heights differ; "
            "mesh both with the same --apex"
        )
