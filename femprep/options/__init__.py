"""Every option and default of every stage, once. Schemas, command line and Python calls are all made from here.

A stage takes ``options=None, **changes``: :func:`choose` merges the changes into the stage's defaults and turns what
pydantic finds wrong into one line. :func:`takes` shows the options of the class in the stage's signature.
"""

from __future__ import annotations

from femprep.options.activation import ActivationOptions, PurkinjeOptions
from femprep.options.annotate import AnnotateOptions
from femprep.options.base import Policy, StageOptions, choose, require_number, takes
from femprep.options.check import MESHER_LIMITS, PURPOSE_LIMITS, CheckOptions
from femprep.options.export import ExportOptions
from femprep.options.fibres import FibreOptions
from femprep.options.image import ImageOptions
from femprep.options.pericardium import PericardiumOptions
from femprep.options.presets import PRESETS, likely_preset
from femprep.options.run import Options
from femprep.options.surface import SurfaceOptions
from femprep.options.sweep import SweepOptions
from femprep.options.volume import QUALITY, MeshTargets, VolumeOptions
from femprep.options.wall import WallOptions

__all__ = [
    "MESHER_LIMITS",
    "PRESETS",
    "PURPOSE_LIMITS",
    "QUALITY",
    "ActivationOptions",
    "AnnotateOptions",
    "CheckOptions",
    "ExportOptions",
    "FibreOptions",
    "ImageOptions",
    "MeshTargets",
    "Options",
    "PericardiumOptions",
    "Policy",
    "PurkinjeOptions",
    "StageOptions",
    "SurfaceOptions",
    "SweepOptions",
    "VolumeOptions",
    "WallOptions",
    "choose",
    "likely_preset",
    "require_number",
    "takes",
]
