"""Fields from mesh to mesh by the coordinates of the wall."""
