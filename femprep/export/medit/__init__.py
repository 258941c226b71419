"""Medit's mesh files (FreeFEM, MMG)."""
