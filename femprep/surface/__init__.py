"""fit_surface(): image, harmonic and template put together; quality, distances and reference methods beside it."""

from __future__ import annotations

from femprep.mesh.plane_sections import plane_sections
from femprep.surface.files import read_surface
from femprep.surface.fit import fit_surface
from femprep.surface.given.pieces import split_surface
from femprep.surface.harmonic.shape import HarmonicShape
from femprep.surface.measure.compare import Comparison, compare_surfaces
from femprep.surface.measure.distance import SurfaceDistance, surface_distance
from femprep.surface.measure.inslice import InSliceDistance, in_slice_distance, label_distance
from femprep.surface.measure.quality import SurfaceQuality, surface_quality
from femprep.surface.measure.sections import end_planes, grid_planes, label_contours, slice_planes

__all__ = [
    "Comparison",
    "HarmonicShape",
    "InSliceDistance",
    "SurfaceDistance",
    "SurfaceQuality",
    "compare_surfaces",
    "end_planes",
    "fit_surface",
    "grid_planes",
    "in_slice_distance",
    "label_contours",
    "label_distance",
    "plane_sections",
    "read_surface",
    "slice_planes",
    "split_surface",
    "surface_distance",
    "surface_quality",
]
