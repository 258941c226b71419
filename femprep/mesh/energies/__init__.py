"""Measures of triangles and elements that vertices are moved by, each with its slopes, and their descent."""
