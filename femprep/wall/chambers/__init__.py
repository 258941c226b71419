"""Surfaces of several chambers in, the same fitting each other out; their openings, and caps of their cavities."""
