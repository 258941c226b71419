"""A wall in, a mesh out, and what it is worth: fTetWild behind a guard, element measures, checks of anyone's mesh."""

from __future__ import annotations

from femprep.volume.quality.check import check
from femprep.volume.quality.report import QualityReport
from femprep.volume.tetrahedra import tetrahedralize

__all__ = ["QualityReport", "check", "tetrahedralize"]
