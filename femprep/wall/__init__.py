"""Landmarks and planes, clipping, rim, booleans with provenance: a closed, tagged Wall."""
