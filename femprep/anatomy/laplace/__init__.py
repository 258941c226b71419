"""Laplace problems on a wall's mesh: linear elements, their solution, and the fields that are shared."""
