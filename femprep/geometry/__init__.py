"""Geometry of triangle meshes, arrays in and arrays out: quality, topology, intersections, closest points."""
