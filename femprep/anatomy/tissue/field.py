"""A mesh and a label map in; for any point of the mesh's wall, how far inside each label it lies, out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femprep.anatomy.tissue.slice_maps import SliceMaps, voxels_in, wall_locator
from femprep.anatomy.tissue.wall_slices import Feet, WallSlices
from femprep.anatomy.wall_parts import WallPart, wall_parts
from femprep.errors import InputError
from femprep.image.segmentation import Segmentation
from femprep.mesh.search.locate import Locator
from femprep.model import BoolArray, FloatArray, IntArray, VolumeMesh


class TissueField:
    """Labels of an image along the wall of a mesh.

    Parameters
    ----------
    mesh : VolumeMesh
        With ventricular coordinates.
    image : Segmentation
        Its structures are the tissues; ``healthy``, where it is one, the rest of the wall: other voxels then tell
        nothing.
    names : sequence of str
        The tissues, in the order of the scores' columns.

    Raises
    ------
    InputError
        The image and the wall do not meet, or coordinates are missing.
    """

    def __init__(self, mesh: VolumeMesh, image: Segmentation, names: Sequence[str]) -> None:
        self.mesh, self.image, self.grid = mesh, image, image.grid
        self.parts: list[WallPart] = wall_parts(mesh)
        self.locator: Locator = wall_locator(mesh)
        self.labels = np.zeros(image.labels.shape, dtype=np.uint8)
        for number, name in enumerate(names, start=1):
            self.labels[image.mask(name)] = number
        known = voxels_in(self.locator, self.grid)
        if not known.any():
            raise InputError(
                "no voxel of the second image lies in the wall of the mesh; both have to be in the same world "
                "coordinates (scanner, mm): compare their positions, or resample one onto the other"
            )
        #: Whether the image tells of the rest of the wall, too.
        self.told = "healthy" in image.structures
        if self.told:
            named: BoolArray = np.asarray((self.labels > 0) | image.mask("healthy"), dtype=np.bool_)
            known = np.asarray(known & named, dtype=np.bool_)
            if not known.any():
                raise InputError("none of the labels of the second image lies in the wall of the mesh")
        self.maps = SliceMaps(self.labels, known, self.grid)
        self._slices = [WallSlices(part, self.grid) for part in self.parts]
        self._labels = list(range(1, len(names) + 1))

    def feet(self, part: int, nodes: IntArray, weights: FloatArray) -> Feet:
        """Feet of points of a part in the slices of the image."""
        return self._slices[part].feet(nodes, weights)

    def scores(self, feet: Feet) -> FloatArray:
        """How far inside each tissue points lie, mm, ``(q, tissues)``; far outside where nothing is known."""
        found = self.maps.scores(feet, self._labels)
        found[~feet.known] = -1e3
        return found

    def at_points(self) -> FloatArray:
        """Scores at the points of the mesh ``(n, tissues)``, far outside for those of no wall."""
        every = np.arange(len(self.mesh.points))
        return self.between(np.stack([every, every], axis=1), np.zeros(len(every)))

    def between(self, ends: IntArray, share: FloatArray) -> FloatArray:
        """Scores so far from the first to the second of pairs of points of an element ``(q, 2)``."""
        found = np.full((len(ends), len(self._labels)), -1e3)
        for number, part in enumerate(self.parts):
            own = np.full(len(self.mesh.points), -1)
            own[part.points] = np.arange(len(part.points))
            rows = np.flatnonzero((own[ends] >= 0).all(axis=1))
            weights = np.stack([1.0 - share[rows], share[rows]], axis=1)
            found[rows] = self.scores(self.feet(number, own[ends[rows]], weights))
        return found

    def at_middles(self) -> FloatArray:
        """Scores in the middle of the elements of the mesh ``(m, tissues)``, far outside for those of no wall."""
        found = np.full((self.mesh.n_cells, len(self._labels)), -1e3)
        for number, part in enumerate(self.parts):
            first = 0
            for nodes in part.mesh.cells.values():
                weights = np.full(nodes.shape, 1.0 / nodes.shape[1])
                found[part.cells[first : first + len(nodes)]] = self.scores(self.feet(number, nodes, weights))
                first += len(nodes)
        return found

    def nearest(self, feet: Feet) -> IntArray:
        """Number of the tissue, from 1, of the nearest pixel of the nearer slice; 0 for none."""
        return np.where(feet.known, self.maps.nearest(feet).astype(np.int64), 0)

    def nearest_voxels(self, points: FloatArray) -> IntArray:
        """Number of the tissue of the voxel that points ``(n, 3)`` lie in; 0 outside the image."""
        return self.grid.values_at(self.labels, self.grid.to_index(points)).astype(np.int64)
