"""The paper's method whole: charges and images, sources, field, stopping spline, flow, mapped template."""
