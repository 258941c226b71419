"""A finished run, and the image its labels were drawn on, in; pictures of both with the mesh over them out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from femprep.image import IntensityImage
from femprep.image.underlay import Underlay, lay_under, window
from femprep.model import Notice, records
from femprep.model.facets import facet_triangles
from femprep.report.manifest import ImageRecord, file_sha256
from femprep.report.pictures.aligned import shift_chart, view_pictures
from femprep.report.pictures.colours import colour, structure_colour
from femprep.report.pictures.long_axes import long_axis_pictures
from femprep.report.pictures.overlay import Overlay
from femprep.report.pictures.slices import slice_pictures
from femprep.report.run import Run


@dataclass(frozen=True)
class DataPictures:
    """What a page shows of the data.

    Attributes
    ----------
    slices, long_axes, views : list of str
        SVG; none of a run that began with surfaces.
    shifts : str
        SVG of the shifts by slice; empty where slices were not moved back.
    outlines, structures : dict
        Colour by the name of each line and of each filled area.
    limits : (float, float), optional
        Values of the image that are black and white; None without an image.
    total : int
        Slices with labels, of which ``slices`` may be some.
    """

    slices: list[str] = field(default_factory=list)
    long_axes: list[str] = field(default_factory=list)
    outlines: dict[str, str] = field(default_factory=dict)
    structures: dict[str, str] = field(default_factory=dict)
    limits: tuple[float, float] | None = None
    total: int = 0
    views: list[str] = field(default_factory=list)
    shifts: str = ""


def data_pictures(run: Run, under: Underlay | None = None) -> DataPictures:
    """Slices of the labels of a run and two cuts along the long axis, with its mesh drawn over them.

    Parameters
    ----------
    run : Run
    under : Underlay, optional
        The image to lay under them.
    """
    seg = run.segmentation
    if seg is None:
        return DataPictures()
    parts = {}
    for name in run.mesh.facet_names:
        used, triangles = np.unique(facet_triangles(run.mesh, name), return_inverse=True)
        parts[name] = run.mesh.points[used], triangles.reshape(-1, 3)
    walls = {name: part for name, part in parts.items() if name.startswith(("endo", "epi"))}
    numbers = [number for labels in seg.structures.values() for number in labels]
    marked = np.argwhere(np.isin(seg.labels, numbers))
    # Black and white are those of the heart and what lies around it, not of fat or air far off.
    limits = None if under is None else window(under.values(_around(marked, np.array(seg.labels.shape))))
    over = Overlay(parts, list(run.fidelity.off.values()), under, limits or (0.0, 1.0))
    present = [name for name, labels in seg.structures.items() if set(labels) & set(seg.present)]
    return DataPictures(
        slice_pictures(seg, replace(over, surfaces=walls)),  # base and caps lie along the slices
        long_axis_pictures(seg, over),
        {name: colour(name) for name in parts},
        {name: structure_colour(name) for name in present},
        limits,
        int(np.ptp(marked[:, seg.stack_axis])) + 1 if len(marked) else 0,
        view_pictures(seg, over),
        shift_chart(moved) if (moved := seg.info.get("slice_shifts", {})).get("slices") else "",
    )


def image_record(under: Underlay) -> ImageRecord:
    """What ``run.json`` tells of the image."""
    image, file = under.image, under.image.info.get("file")
    path = Path(file) if file else None
    return ImageRecord(
        path=path.name if path else None,
        sha256=file_sha256(path) if path and path.is_file() else None,
        frame=image.info.get("frame"),
        shape=tuple(image.grid.shape),
        spacing_mm=tuple(float(x) for x in image.grid.spacing),
        resampled=not under.same_grid,
        covered_percent=round(100.0 * under.covered, 1),
    )


def image_notices(under: Underlay) -> list[dict[str, Any]]:
    """What was assumed of the image, and what of the labels it does not reach."""
    found = [dict(one) for one in under.image.info.get("notices", ())]
    if under.covered < 1.0:
        line = "{amount} of the labelled voxels lie beyond the image (--image), where slices are drawn without it"
        found += records(Notice.of("not reached", line, amount=100.0 * (1.0 - under.covered), unit="%"))
    return found


def _around(marked: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Indices of up to some thousand voxels in the box of the labels."""
    low, high = marked.min(axis=0), marked.max(axis=0)
    grid = [np.unique(np.linspace(low[a], high[a], min(24, shape[a])).astype(int)) for a in range(3)]
    return np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float64)


def under_labels(run: Run, image: IntensityImage | None) -> Underlay | None:
    """The image under the labels of a run; None where there is no image, or no labels.

    Raises
    ------
    InputError
        They do not lie in one place.
    """
    return None if image is None or run.segmentation is None else lay_under(run.segmentation, image)
