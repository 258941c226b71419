"""A tagged volume mesh in; the same mesh with axes, ventricular coordinates, AHA segments and fibres out."""

from __future__ import annotations

from femprep.anatomy.aha import add_aha, segment_means
from femprep.anatomy.axes.find_axes import ventricular_axes
from femprep.anatomy.axes.mirror import flip
from femprep.anatomy.axes.orientation import orient
from femprep.anatomy.axes.ventricular_axes import VentricularAxes
from femprep.anatomy.bullseye import bulls_eye, bulls_eye_svg
from femprep.anatomy.coordinates import add_coordinates
from femprep.anatomy.fibres import add_fibres, quadrature_fibres
from femprep.anatomy.laplace.fields import WallFields
from femprep.anatomy.part import on_wall
from femprep.anatomy.pericardium import add_pericardium, pericardium_scale
from femprep.anatomy.thickness import wall_thickness
from femprep.anatomy.tissue.image_sampling import sample_image
from femprep.anatomy.tissue.regions import add_regions
from femprep.anatomy.transfer.fields import transfer

__all__ = [
    "VentricularAxes",
    "WallFields",
    "add_aha",
    "add_coordinates",
    "add_fibres",
    "add_pericardium",
    "add_regions",
    "bulls_eye",
    "bulls_eye_svg",
    "flip",
    "on_wall",
    "orient",
    "pericardium_scale",
    "quadrature_fibres",
    "sample_image",
    "segment_means",
    "transfer",
    "ventricular_axes",
    "wall_thickness",
]
