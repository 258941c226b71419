"""Landmarks and planes, clipping, rim, booleans with provenance: a closed, tagged Wall.

``find_base``, ``find_common_base`` and ``find_apex`` put planes into a segmentation, ``find_annulus`` finds the ring of
a valve in long-axis views, ``phase_base_offsets`` makes the planes of a heart's phases agree; ``extend_apex`` continues
an epicardium beyond the last slice; ``keep_apart`` and ``Envelope`` make surfaces of several chambers fit each other;
``build_wall`` clips the fitted surfaces, joins them and tags every facet, ``open_wall`` cuts valves and vessels open;
``cavity_surface`` caps a mesh's cavity, ``fill_cavities`` those of a wall, for its blood to be meshed as well.
"""

from femprep.wall.chambers.blood import fill_cavities
from femprep.wall.chambers.cavity import cavity_surface, open_cavities
from femprep.wall.chambers.envelope import Envelope, Part
from femprep.wall.chambers.holes import open_wall
from femprep.wall.chambers.minimum_thickness import keep_apart
from femprep.wall.chambers.openings import Opening, check_openings, find_openings, given_openings
from femprep.wall.chambers.thin_wall import thin_wall
from femprep.wall.joining.build import build_wall
from femprep.wall.planes.annulus import Annulus, find_annulus
from femprep.wall.planes.apex import extend_apex
from femprep.wall.planes.common_base import find_common_base
from femprep.wall.planes.landmarks import find_apex, find_base
from femprep.wall.planes.phase_bases import phase_base_offsets

__all__ = [
    "Annulus",
    "Envelope",
    "Opening",
    "Part",
    "build_wall",
    "cavity_surface",
    "check_openings",
    "extend_apex",
    "fill_cavities",
    "find_annulus",
    "find_apex",
    "find_base",
    "find_common_base",
    "find_openings",
    "given_openings",
    "keep_apart",
    "open_cavities",
    "open_wall",
    "phase_base_offsets",
    "thin_wall",
]
