"""A template in, the same placed on the smooth surface of an object with even triangles out."""
