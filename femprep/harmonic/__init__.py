"""The paper's field: charges and images, sources, potential, stopping spline, flow."""
