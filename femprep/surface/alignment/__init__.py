"""Slices and long-axis views of a heart in, how each of them is displaced, and the heart with them moved back, out."""

from __future__ import annotations

from femprep.surface.alignment.align import align_slices, estimate_shifts

__all__ = ["align_slices", "estimate_shifts"]
