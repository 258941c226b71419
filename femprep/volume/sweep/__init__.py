"""Two matched surfaces in, a volume mesh of layers between them out; its boundary as a Wall; phases of one heart."""

from __future__ import annotations

from femprep.volume.sweep.boundary import boundary_wall
from femprep.volume.sweep.build import sweep
from femprep.volume.sweep.phases import displacements, template_of

__all__ = ["boundary_wall", "displacements", "sweep", "template_of"]
