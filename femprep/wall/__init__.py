"""Landmarks and planes, clipping, rim, booleans with provenance: a closed, tagged Wall.

``find_base`` and ``find_apex`` put planes into a segmentation; ``extend_apex`` continues an epicardium beyond the last
slice; ``build_wall`` clips the fitted surfaces, joins them and tags every facet.
"""

from femprep.wall.apex import extend_apex
from femprep.wall.build import build_wall
from femprep.wall.landmarks import find_apex, find_base

__all__ = ["build_wall", "extend_apex", "find_apex", "find_base"]
