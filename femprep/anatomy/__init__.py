"""Axes, ventricular coordinates, AHA segments, fibres."""
