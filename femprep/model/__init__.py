"""The nouns of femprep: Plane, Surface, Wall, BloodPools, VolumeMesh, Notice, and the one table of tag numbers.

All are frozen dataclasses over read-only arrays. Lengths are mm, coordinates LPS (as ITK has them), points
``(n, 3)`` float64, cells int64, tags int32. Surface cells are wound outward, volume cells are positive.
A changed copy comes from ``dataclasses.replace`` or a ``with_...`` method.
"""

from __future__ import annotations

from femprep.model.arrays import BoolArray, FloatArray, IntArray, TagArray, frozen, readonly
from femprep.model.immutable import Immutable
from femprep.model.notice import Notice, noted, records
from femprep.model.plane import Plane, cutting
from femprep.model.progress import Progress
from femprep.model.purkinje import PurkinjeNet
from femprep.model.surface import SphereMap, Surface, split_quads
from femprep.model.tags import FACET_TAGS, REGION_TAGS, TISSUES, endo_tags, endocardium, is_blood, tag_name
from femprep.model.verdict import verdict_of, with_failure, with_verdict, without_failure
from femprep.model.volume_mesh import Nested, VolumeMesh
from femprep.model.wall import BloodPools, Wall

__all__ = [
    "FACET_TAGS",
    "REGION_TAGS",
    "TISSUES",
    "BloodPools",
    "BoolArray",
    "FloatArray",
    "Immutable",
    "IntArray",
    "Nested",
    "Notice",
    "Plane",
    "Progress",
    "PurkinjeNet",
    "SphereMap",
    "Surface",
    "TagArray",
    "VolumeMesh",
    "Wall",
    "cutting",
    "endo_tags",
    "endocardium",
    "frozen",
    "is_blood",
    "noted",
    "readonly",
    "records",
    "split_quads",
    "tag_name",
    "verdict_of",
    "with_failure",
    "with_verdict",
    "without_failure",
]
