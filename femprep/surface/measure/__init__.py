"""Surfaces in, figures out: quality, distances in space and in slices, sections."""
