"""VTK files read as arrays."""
