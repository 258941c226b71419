"""Tetrahedra whose worst elements are poor in, the same tetrahedra with points moved out; tags and topology stay.

The quality of a tetrahedron here is the lesser of its mean ratio and its smallest sine of a dihedral angle (over the
regular tetrahedron's, so that it is small both for sharp and for blunt angles); it is negative where the tetrahedron
is inverted. First every point moves to where the mean of the mean ratio around it is better and no element poor;
then every point of a poor element searches for the place where the worst of its elements is best [1]_. Points inside
move in all directions, on a surface along it, on a rim along the rim. Deterministic.

References
----------
.. [1] Freitag & Ollivier-Gooch, Tetrahedral mesh improvement using swapping and smoothing, Int. J. Numer. Meth. Eng.
   40(21), 1997. doi:10.1002/(SICI)1097-0207(19971115)40:21<3979::AID-NME251>3.0.CO;2-9
"""

from __future__ import annotations

from femprep.volume.optimise.improve import LEAST, POOR, Optimised, optimise, tet_quality
from femprep.volume.optimise.quality import REGULAR_SINE

__all__ = ["LEAST", "POOR", "REGULAR_SINE", "Optimised", "optimise", "tet_quality"]
