"""Nested refinement: every element cut into eight, new boundary nodes on the smooth surfaces, fields between levels."""

from __future__ import annotations

from femprep.volume.refine.refinement import PARENT, Level, Refinement, refine

__all__ = ["PARENT", "Level", "Refinement", "refine"]
