"""Formats of others: a file in, where what meshio makes of it must be looked at, a volume mesh out."""
