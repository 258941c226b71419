"""Two matched surfaces in, a volume mesh of layers between them out; its boundary as a Wall; phases of one heart."""

from __future__ import annotations

from femprep.sweeping.boundary import boundary_wall
from femprep.sweeping.elements.build import sweep
from femprep.sweeping.phases import displacements, template_of

__all__ = ["boundary_wall", "displacements", "sweep", "template_of"]
