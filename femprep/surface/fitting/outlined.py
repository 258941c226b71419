"""A LabelObject in, a template placed near its surface out, quickly: on a smoothed outline of its voxels."""

from __future__ import annotations

from typing import Final

from femprep.errors import StageError
from femprep.image.canonical_frame import CanonicalFrame
from femprep.image.canonical_storage import stored_by_content
from femprep.image.object import LabelObject
from femprep.mesh.patches import PatchSurface
from femprep.model import Surface
from femprep.model.products import product
from femprep.options.advice import MORE_VERTICES
from femprep.surface.estimate.outline import outlines
from femprep.surface.fitting.place import placed_or_flipped
from femprep.surface.fitting.ways import ACCEPTANCE
from femprep.template import charge_template

#: Vertices of the outline.
_OUTLINE: Final = 1500


def outline_surface(obj: LabelObject, vertices: int) -> Surface:
    """A template surface about a voxel off an object's labels, for vertices that are moved onto a known body.

    Parameters
    ----------
    obj : LabelObject
    vertices : int
        Of the template.

    Returns
    -------
    Surface

    Raises
    ------
    StageError
        The outline is not a ball's, or the template folds on it.
    """
    canonical = CanonicalFrame.of(stored_by_content(obj)[0])
    template = charge_template(vertices)
    directions = canonical.directions(
        product(template.directions, (canonical.axes if obj.frame is None else obj.frame).T)
    )
    rough = PatchSurface(*outlines(canonical.obj, _OUTLINE)[1])
    placed = placed_or_flipped(directions, template.cells, rough, ACCEPTANCE.outline)
    if placed.folded:
        raise StageError(
            f"the template folds on the outline of {obj.name!r}",
            advice=[MORE_VERTICES, "mend displaced slices, holes and slivers of its labels"],
        )
    points = product(placed.points, canonical.axes.T) + obj.barycentre
    return Surface(
        points,
        placed.cells,
        obj.name,
        directions=product(placed.directions, canonical.axes.T),
        info={"flips": placed.flips},
    )
