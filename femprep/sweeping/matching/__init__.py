"""Endocardium and epicardium in, both on the vertices of one cup out."""
