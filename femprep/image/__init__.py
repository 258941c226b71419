"""Label maps in: read, choose structures, repair with a report, boundary points and slices out."""

from __future__ import annotations

from femprep.image.boundary import BoundaryPoints, boundary_points
from femprep.image.contours import Contour, ContourPlane, Contours
from femprep.image.grid import Grid
from femprep.image.left_out import leave_out_slices
from femprep.image.object import LabelObject, make_object
from femprep.image.papillary import fill_papillary
from femprep.image.reading.contours import read_contours
from femprep.image.reading.intensity import IntensityImage, read_image
from femprep.image.reading.masks import read_masks
from femprep.image.reading.reader import read_frames, read_segmentation, write_segmentation
from femprep.image.resample import isotropic
from femprep.image.segmentation import Segmentation
from femprep.image.shifts import SliceShifts
from femprep.image.slices import SliceTable, slice_table
from femprep.image.topology import Topology, topology
from femprep.image.views import PlaneView

__all__ = [
    "BoundaryPoints",
    "Contour",
    "ContourPlane",
    "Contours",
    "Grid",
    "IntensityImage",
    "LabelObject",
    "PlaneView",
    "Segmentation",
    "SliceShifts",
    "SliceTable",
    "Topology",
    "boundary_points",
    "fill_papillary",
    "isotropic",
    "leave_out_slices",
    "make_object",
    "read_contours",
    "read_frames",
    "read_image",
    "read_masks",
    "read_segmentation",
    "slice_table",
    "topology",
    "write_segmentation",
]
