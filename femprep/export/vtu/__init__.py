"""VTK's unstructured grids."""
