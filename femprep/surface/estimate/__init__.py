"""A LabelObject in, the most likely smooth surface out: bent as evenly as its labels allow."""

from __future__ import annotations

from femprep.surface.estimate.estimate import estimate_surface

__all__ = ["estimate_surface"]
