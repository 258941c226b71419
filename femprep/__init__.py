"""femprep: from a segmented cardiac image to a finite element mesh a solver accepts.

The whole way in ten lines, here on a phantom with voxels of 1.4 x 1.4 x 8 mm and a coarse mesh:

>>> import femprep as fp
>>> from femprep.phantoms import lv_ellipsoid
>>> seg = lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped")
>>> cavity, heart = seg.object("lv"), seg.object("lv", "myo")
>>> endo = fp.fit_surface(cavity, vertices=500)
>>> epi = fp.fit_surface(heart, boundary=fp.extend_apex(seg, heart, endo=endo), vertices=500)
>>> wall = fp.build_wall(epi=epi, endo={"lv": endo}, base=fp.find_base(seg))
>>> mesh = fp.tetrahedralize(wall, edge_length=5.0)
>>> mesh = fp.add_fibres(mesh, axes=fp.ventricular_axes(seg), endo_angle=60.0, epi_angle=-60.0)
>>> fp.check(mesh).raise_if_failed().validity.inverted_elements
0
>>> list(mesh.facet_names)
['endo', 'epi', 'base']

The examples at functions and classes go on from these names.
"""

from __future__ import annotations

import logging
from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# What the library has to say goes to whoever listens, never to the screen by itself.
logging.getLogger(__name__).addHandler(logging.NullHandler())

#: Where each public name lives. Modules load on first use, so that ``import femprep`` stays fast.
_HOMES = {
    "FemprepError": "femprep.errors",
    "FemprepWarning": "femprep.errors",
    "InputError": "femprep.errors",
    "OptionError": "femprep.errors",
    "DiskFullError": "femprep.errors",
    "FileError": "femprep.errors",
    "ResourceError": "femprep.errors",
    "StageError": "femprep.errors",
    "QualityError": "femprep.errors",
    "Plane": "femprep.model",
    "Surface": "femprep.model",
    "Wall": "femprep.model",
    "VolumeMesh": "femprep.model",
    "BloodPools": "femprep.model",
    "PurkinjeNet": "femprep.model",
    "FACET_TAGS": "femprep.model",
    "REGION_TAGS": "femprep.model",
    "Options": "femprep.options",
    "ImageOptions": "femprep.options",
    "SurfaceOptions": "femprep.options",
    "WallOptions": "femprep.options",
    "VolumeOptions": "femprep.options",
    "SweepOptions": "femprep.options",
    "CheckOptions": "femprep.options",
    "FibreOptions": "femprep.options",
    "ExportOptions": "femprep.options",
    "PericardiumOptions": "femprep.options",
    "PurkinjeOptions": "femprep.options",
    "ActivationOptions": "femprep.options",
    "AnnotateOptions": "femprep.options",
    "find_base": "femprep.wall",
    "find_annulus": "femprep.wall",
    "Annulus": "femprep.wall",
    "find_apex": "femprep.wall",
    "extend_apex": "femprep.wall",
    "find_common_base": "femprep.wall",
    "phase_base_offsets": "femprep.wall",
    "keep_apart": "femprep.wall",
    "Envelope": "femprep.wall",
    "build_wall": "femprep.wall",
    "cavity_surface": "femprep.wall",
    "fill_cavities": "femprep.wall",
    "find_openings": "femprep.wall",
    "open_wall": "femprep.wall",
    "fit_surface": "femprep.surface.fit",
    "read_surface": "femprep.surface",
    "split_surface": "femprep.surface",
    "compare_surfaces": "femprep.surface",
    "surface_distance": "femprep.surface",
    "in_slice_distance": "femprep.surface",
    "surface_quality": "femprep.surface",
    "read_segmentation": "femprep.image",
    "read_frames": "femprep.image",
    "read_masks": "femprep.image",
    "write_segmentation": "femprep.image",
    "Segmentation": "femprep.image",
    "Grid": "femprep.image",
    "LabelObject": "femprep.image",
    "PlaneView": "femprep.image",
    "Contours": "femprep.image",
    "Contour": "femprep.image",
    "ContourPlane": "femprep.image",
    "read_contours": "femprep.image",
    "align_slices": "femprep.surface.alignment",
    "fill_papillary": "femprep.image",
    "leave_out_slices": "femprep.image",
    "estimate_shifts": "femprep.surface.alignment",
    "SliceShifts": "femprep.image",
    "boundary_points": "femprep.image",
    "BoundaryPoints": "femprep.image",
    "tetrahedralize": "femprep.volume",
    "refine": "femprep.volume.refine",
    "Refinement": "femprep.volume.refine",
    "check": "femprep.volume",
    "QualityReport": "femprep.volume",
    "match_surfaces": "femprep.sweeping.matching.match",
    "sweep": "femprep.sweeping",
    "boundary_wall": "femprep.sweeping",
    "displacements": "femprep.sweeping",
    "template_of": "femprep.sweeping",
    "write_mesh": "femprep.export",
    "read_mesh": "femprep.export",
    "write_facets": "femprep.export",
    "write_wall": "femprep.export",
    "write_purkinje": "femprep.export",
    "write_surface": "femprep.export",
    "mesh_segmentation": "femprep.pipeline",
    "mesh_surfaces": "femprep.own_surfaces",
    "prepare_surfaces": "femprep.wall.own",
    "OwnSurfaces": "femprep.wall.own",
    "fit_surfaces": "femprep.pipeline",
    "Run": "femprep.report.run",
    "write_run": "femprep.report.output",
    "mesh_sequence": "femprep.sequence",
    "write_sequence": "femprep.report.sequence_output",
    "SequenceRun": "femprep.report.run",
    "write_surfaces": "femprep.report.output",
    "add_fibres": "femprep.anatomy",
    "add_atrial_fibres": "femprep.anatomy",
    "quadrature_fibres": "femprep.anatomy",
    "add_coordinates": "femprep.anatomy",
    "add_pericardium": "femprep.anatomy",
    "pericardium_scale": "femprep.anatomy",
    "ventricular_axes": "femprep.anatomy",
    "VentricularAxes": "femprep.anatomy",
    "flip": "femprep.anatomy",
    "on_wall": "femprep.anatomy",
    "orient": "femprep.anatomy",
    "add_aha": "femprep.anatomy",
    "bulls_eye": "femprep.anatomy",
    "bulls_eye_svg": "femprep.anatomy",
    "wall_thickness": "femprep.anatomy",
    "transfer": "femprep.anatomy",
    "add_regions": "femprep.anatomy",
    "sample_image": "femprep.anatomy",
    "read_image": "femprep.image",
    "IntensityImage": "femprep.image",
    "add_purkinje": "femprep.activation",
    "add_activation": "femprep.activation",
    "annotate": "femprep.annotation",
    "read_surfaces": "femprep.annotation",
    "Annotation": "femprep.annotation",
    "write_annotation": "femprep.report.annotated",
}

__all__ = ["__version__", *_HOMES]

if TYPE_CHECKING:
    from femprep.errors import FemprepError as FemprepError


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'femprep' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
