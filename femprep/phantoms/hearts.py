"""Sizes in, phantom hearts out: LV ellipsoid, sphere shell, bent and crescent RV, ventricles, atrium, whole heart.

Defaults are of the size of an adult heart at end-diastole; labels are those of ACDC (rv 1, myo 2, lv 3).
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np

from femprep.errors import OptionError
from femprep.phantoms.bends import Bend
from femprep.phantoms.phantom import Phantom, Region
from femprep.phantoms.solids import EllipsoidBody, LobedBody

Axes = tuple[float, float, float]


def lv_ellipsoid(endo: Axes = (25.0, 25.0, 60.0), epi: Axes = (34.0, 34.0, 69.0), base: float = 20.0) -> Phantom:
    """A left ventricle between two ellipsoids about one centre, cut by a base plane.

    Parameters
    ----------
    endo, epi : tuple of 3 floats
        Semi-axes along x, y and the long axis z, mm.
    base : float
        Height of the base plane above the centre, mm; infinite leaves the ellipsoids whole.

    Returns
    -------
    Phantom
        Regions ``epi`` and ``lv``.

    Raises
    ------
    OptionError
        The endocardium is not inside the epicardium.
    """
    if not all(a < b for a, b in zip(endo, epi)):
        raise OptionError(f"endocardial semi-axes {endo} mm are not all smaller than the epicardial ones {epi} mm")
    return Phantom(
        {
            "epi": Region(EllipsoidBody(epi, high=base), 2, "myo"),
            "lv": Region(EllipsoidBody(endo, high=base), 3, "lv"),
        },
        "LV ellipsoid",
    )


def sphere_shell(inner: float = 20.0, outer: float = 30.0) -> Phantom:
    """A spherical cavity in a wall of even thickness; regions ``epi`` and ``lv``. Radii in mm."""
    return replace(lv_ellipsoid((inner, inner, inner), (outer, outer, outer), inf), name="sphere shell")


def rv_bent(semi_axes: Axes = (14.0, 24.0, 50.0), bend_radius: float = 45.0, base: float = inf) -> Phantom:
    """A flattened ellipsoid whose long axis is bent into an arc, as a right ventricle in the long-axis view.

    Parameters
    ----------
    semi_axes : tuple of 3 floats
        Towards the centre of the arc, across it, and along it, mm.
    bend_radius : float
        Radius of the arc, mm.
    base : float
        Where it is cut, as a length along the arc from its middle, mm; the cut is plane.

    Returns
    -------
    Phantom
        Region ``rv``.
    """
    body = EllipsoidBody(semi_axes, high=base, bend=Bend(2, bend_radius))
    return Phantom({"rv": Region(body, 1, "rv")}, "bent RV")


def rv_crescent(
    semi_axes: Axes = (15.0, 50.0, 60.0),
    epi: Axes = (34.0, 34.0, 69.0),
    base: float = 20.0,
) -> Phantom:
    """A right ventricle that is a crescent in short-axis slices and lies against an LV ellipsoid, on its +x side.

    The ellipsoid's second axis is bent round the long axis of the LV; towards the apex the slices move with the
    epicardium, so that the crescent touches it and does not cross it.

    Parameters
    ----------
    semi_axes : tuple of 3 floats
        Half thickness, half length of the crescent along its arc, half height, mm.
    epi : tuple of 3 floats
        Semi-axes of the LV epicardium it lies against (the first one is used as its radius), mm.
    base : float
        Height of the base plane, mm.

    Returns
    -------
    Phantom
        Region ``rv``.
    """
    return Phantom({"rv": _crescent(semi_axes, epi, base)}, "crescent RV")


def biventricular(
    endo: Axes = (25.0, 25.0, 60.0),
    epi: Axes = (34.0, 34.0, 69.0),
    rv: Axes = (15.0, 50.0, 60.0),
    base: float = 20.0,
) -> Phantom:
    """An LV ellipsoid with a crescent RV cavity beside it; regions ``rv``, ``epi`` and ``lv``, no RV wall, as ACDC."""
    left = lv_ellipsoid(endo, epi, base)
    return Phantom({"rv": _crescent(rv, epi, base), **left.regions}, "biventricular")


def four_chambers(wall: float = 3.0, atrial_wall: float = 2.0) -> Phantom:
    """A whole heart of four closed ellipsoidal chambers with their walls, the right ones on the +x side, atria on top.

    Cavities do not overlap, so that each has its closed-form volume; bodies (cavity and wall) overlap a little, the
    left ventricle's cuts into the others. Labels are those of preset ``rodero``.

    Parameters
    ----------
    wall, atrial_wall : float
        Thickness of the right ventricle's and of the atria's walls along the semi-axes, mm.

    Returns
    -------
    Phantom
        Regions ``ra_epi``, ``la_epi``, ``rv_epi``, ``epi`` (of the left ventricle), ``ra``, ``la``, ``rv``, ``lv``.
    """
    chambers = {
        "ra": ((24.0, 24.0, 22.0), (56.0, 0.0, 65.0), atrial_wall, 7, 8),
        "la": ((21.0, 22.0, 20.0), (0.0, 0.0, 70.5), atrial_wall, 5, 6),
        "rv": ((20.0, 32.0, 40.0), (56.0, 0.0, 0.0), wall, 3, 4),
        "lv": ((25.0, 25.0, 41.0), (0.0, 0.0, 0.0), 9.0, 1, 2),
    }
    bodies, cavities = {}, {}
    for name, (axes, centre, thickness, cavity, tissue) in chambers.items():
        grown = (axes[0] + thickness, axes[1] + thickness, axes[2] + thickness)
        outside, muscle = ("epi", "myo") if name == "lv" else (f"{name}_epi", f"{name}_wall")
        bodies[outside] = Region(EllipsoidBody(grown), tissue, muscle, centre)
        cavities[name] = Region(EllipsoidBody(axes), cavity, name, centre)
    return Phantom({**bodies, **cavities}, "four chambers")


def atrium(radius: float = 20.0, appendage: float = 0.9, sharpness: float = 12.0) -> Phantom:
    """A sphere with a lobe, as an atrium with its appendage.

    Parameters
    ----------
    radius : float
        Of the sphere, mm.
    appendage : float
        Height of the lobe as a fraction of the radius.
    sharpness : float
        The larger, the narrower the lobe.

    Returns
    -------
    Phantom
        Region ``la``.
    """
    return Phantom({"la": Region(LobedBody(radius, appendage, sharpness, (0.6, 0.0, 0.8)), 4, "la")}, "atrium")


def whole_heart(radius: float = 45.0, apex: float = 0.45, sharpness: float = 3.0) -> Phantom:
    """A large sphere with a broad lobe towards the apex, as the epicardium of the whole heart, about 490 mL.

    Parameters
    ----------
    radius : float
        Of the sphere, mm.
    apex : float
        Height of the lobe as a fraction of the radius.
    sharpness : float
        The larger, the more pointed the apex.

    Returns
    -------
    Phantom
        Region ``epi``.
    """
    return Phantom({"epi": Region(LobedBody(radius, apex, sharpness, (-0.3, 0.1, -0.95)), 2, "epi")}, "whole heart")


def _crescent(semi_axes: Axes, epi: Axes, base: float) -> Region:
    """The crescent: bent about the long axis of the LV, its middle on the +x side."""
    thickness, _, height = semi_axes
    radius = epi[0] + thickness
    # In the middle of the crescent its inner side is to follow the epicardium: shift(z) >= wanted(z), close to it.
    # Further round, what shift moves inward by moves the epicardium in by no less, so that they do not cross there.
    z = np.linspace(0.02, 1.0, 500) * min(height, epi[2] * (1.0 - 1e-9))
    wanted = epi[0] * np.sqrt(1.0 - (z / epi[2]) ** 2) + thickness * np.sqrt(1.0 - (z / height) ** 2) - radius
    second = -0.98 * 0.5 * (epi[0] / epi[2] ** 2 + thickness / height**2)
    fourth = float(((wanted - second * z**2) / z**4).max())
    body = EllipsoidBody(semi_axes, high=base, bend=Bend(1, radius, (second, fourth)))
    return Region(body, 1, "rv", (radius, 0.0, 0.0))
