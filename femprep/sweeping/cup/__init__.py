"""The connectivity a ventricle's wall is swept from: a cup or tube, its layers, and how its prisms are split."""
