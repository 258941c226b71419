"""Points and cells in, values per cell out: area, volume, angles, Jacobians, mean ratio."""
