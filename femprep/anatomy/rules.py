"""Fields at any sites of a wall in, fibre triads out: the rules that turn Laplace fields into fibre directions.

``linear`` (the default) interpolates the *unrotated* frames of Bayer et al. and gives them one helix angle,

    angle = (endocardial angle) W + (epicardial angle) E,

W from 1 at the LV endocardium to -1 at the RV endocardium, E from 0 at the endocardia to 1 at the epicardium; in a free
wall this is linear in depth, and mid-septum it is 0. ``bayer`` is Algorithm 2 of Bayer et al. 2012
(doi 10.1007/s10439-012-0593-5) as printed: frames are rotated first, then interpolated. There the angle bends (twice
the depth enters), and where endocardial and epicardial angle differ by more than 90 degrees the interpolation takes the
shorter way round and jumps; that is why it is not the default.

``doste`` is ``linear`` with the longitudinal direction and the angles of Doste et al. 2019 (doi 10.1002/cnm.3185):
towards the outflow valve fibres turn to run along the outflow tract at the endocardium and round it at the epicardium.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from femprep.anatomy.frames import bislerp, make_frames, rotate
from femprep.anatomy.laplace.fem import LinearElements
from femprep.anatomy.laplace.fields import WallFields
from femprep.anatomy.laplace.shapes import shape_functions
from femprep.anatomy.laplace.valves import closed_valves, valve_fields
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.model.products import unit_vectors
from femprep.options import FibreOptions

#: Helix angles at the RV's endocardium and epicardium by Doste et al. 2019, degrees.
DOSTE_RV: Final = (90.0, -25.0)


@dataclass(frozen=True)
class Sites:
    """The fields at some sites: nodes, element centres or quadrature points, n in all.

    Attributes
    ----------
    across, across_distance : (n,) arrays
        1 on the LV endocardium, 0 on the epicardium, -1 on the RV endocardium: harmonic, and linear in distance.
    outside : (n,) array
        Harmonic, 1 on the epicardium, 0 on the endocardia.
    side : (n,) array
        Positive in the left ventricle, negative in the right one.
    to_across, to_outside, to_base : (n, 3) arrays
        Gradients of ``across`` (where there is one ventricle, of ``across_distance``), ``outside`` and of the
        apicobasal field, interpolated from the nodes.
    outflow : (n,) array
        0 in the ventricles, 1 at the opening of an outflow tract; 0 by rules that know no outflow tracts.
    """

    across: FloatArray
    across_distance: FloatArray
    outside: FloatArray
    side: FloatArray
    to_across: FloatArray
    to_outside: FloatArray
    to_base: FloatArray
    outflow: FloatArray

    @property
    def beyond(self) -> FloatArray:
        """``outside`` made linear in distance: E of the angle rule."""
        harmonic, distance = 1 - np.abs(self.across), 1 - np.abs(self.across_distance)
        share = np.divide(self.outside, harmonic, out=np.zeros_like(harmonic), where=harmonic > 1e-9)
        return np.asarray(np.clip(share, 0.0, 1.0) * distance, dtype=np.float64)

    def each(self, change: Callable[[FloatArray], FloatArray]) -> Sites:
        """The fields at other sites, each brought there in the same way."""
        return Sites(*(change(getattr(self, name)) for name in self.__dataclass_fields__))


def node_fields(fields: WallFields, rule: str = "linear") -> Sites:
    """The fields at the nodes, with gradients averaged over the elements around each.

    By the rule ``doste`` "to the base" is from the apex to the inflow valve, near the outflow tract to the outflow
    valve, of each ventricle by itself; in the septum from one to the other by depth. Where but one ventricle has both
    valves open, the other has no outflow tract.
    """
    space = fields.space
    field = fields.across if fields.biventricular else fields.across_distance
    to_across = space.to_nodes(space.gradient(field))
    to_outside = space.to_nodes(space.gradient(fields.outside)) if fields.biventricular else -to_across
    outflow = np.zeros(space.n)
    if rule == "doste":
        to_base, outflow = _toward_valves(fields)
    else:
        to_base = space.to_nodes(space.gradient(fields.upward))
    found = (fields.across, fields.across_distance, fields.outside, fields.side, to_across, to_outside)
    return Sites(*found, to_base, outflow)


def _toward_valves(fields: WallFields) -> tuple[FloatArray, FloatArray]:
    """Direction to the valves ``(n, 3)`` and share of the outflow tract ``(n,)`` at the nodes (Doste et al. 2019)."""
    space, found = fields.space, {}
    ventricles = ("lv", "rv") if fields.biventricular else ("lv",)
    shut = closed_valves(fields)
    for ventricle in ventricles:
        if ventricle in shut and len(shut) < len(ventricles):
            found[ventricle] = unit_vectors(space.to_nodes(space.gradient(fields.upward))), np.zeros(space.n)
            continue
        inflow, outflow, share = valve_fields(fields, ventricle)
        ways = [space.to_nodes(space.gradient(field)) for field in (inflow, outflow)]
        share = np.clip(share, 0.0, 1.0)
        found[ventricle] = unit_vectors((1 - share)[:, None] * ways[0] + share[:, None] * ways[1]), share
    if not fields.biventricular:
        return found["lv"]
    # Right of the middle of the septum the right ventricle's, and on the epicardium that of the side it is on.
    right = np.where(np.abs(fields.across) > 1e-9, np.clip(0.5 - 0.5 * fields.across, 0.0, 1.0), fields.side < 0)
    septal = fields.outside < 0.5 * (1 - np.abs(fields.across))
    right = np.where(septal, right, (fields.side < 0).astype(float))
    (left_way, left_share), (right_way, right_share) = found["lv"], found["rv"]
    way = (1 - right)[:, None] * left_way + right[:, None] * right_way
    return way, (1 - right) * left_share + right * right_share


def at_centres(nodes: Sites, corners: IntArray) -> Sites:
    """The fields at the centres of elements, given by their corner nodes ``(c, p)``."""
    return nodes.each(lambda values: values[corners].mean(axis=1))


def at_points(space: LinearElements, nodes: Sites, name: str, points: FloatArray) -> Sites:
    """The fields at reference points ``(q, 3)`` of the elements of one type, flat: k q sites, q fastest."""
    value, _ = shape_functions(name, points)
    at = space.block_names.index(name)

    def inside(values: FloatArray) -> FloatArray:
        corner = space.corners(values)[at]
        flat = corner.reshape(len(corner), corner.shape[1], -1)
        return np.asarray(np.einsum("qp,kpi->kqi", value, flat).reshape((-1, *corner.shape[2:])), dtype=np.float64)

    return nodes.each(inside)


def triads(sites: Sites, options: FibreOptions, *, biventricular: bool, mirrored: bool) -> tuple[FloatArray, BoolArray]:
    """Fibre, sheet and normal at sites.

    Parameters
    ----------
    sites : Sites
        The fields there.
    options : FibreOptions
        Angles and rule.
    biventricular : bool
        Whether there are two ventricles.
    mirrored : bool
        Whether the heart is a mirror image: its fibres then are the mirror image of an anatomical heart's.

    Returns
    -------
    triads : (n, 3, 3) array
        Columns fibre, sheet, normal.
    degenerate : (n,) bool array
        Where a frame had no direction of its own.
    """
    linear = options.depth == "distance"
    w = sites.across_distance if linear else sites.across
    e = sites.beyond if linear else sites.outside
    angles = _Angles.of(options, -1.0 if mirrored else 1.0)
    if options.rule != "bayer":
        return _linear(sites, angles, w, e, biventricular)
    return _bayer(sites, angles, w, e, biventricular)


@dataclass(frozen=True)
class _Angles:
    """Helix and sheet angles, degrees, of the left ventricle and of the right one."""

    helix_endo: tuple[float, float]
    helix_epi: tuple[float, float]
    sheet_endo: float
    sheet_epi: float
    outflow_endo: float
    outflow_epi: float

    @classmethod
    def of(cls, options: FibreOptions, sign: float) -> _Angles:
        # "angle or default" would take an angle of 0 for none.
        usual = DOSTE_RV if options.rule == "doste" else (options.endo_angle, options.epi_angle)
        rv_endo = usual[0] if options.rv_endo_angle is None else options.rv_endo_angle
        rv_epi = usual[1] if options.rv_epi_angle is None else options.rv_epi_angle
        return cls(
            (sign * options.endo_angle, sign * rv_endo),
            (sign * options.epi_angle, sign * rv_epi),
            options.endo_sheet_angle,
            options.epi_sheet_angle,
            sign * options.outflow_endo_angle,
            sign * options.outflow_epi_angle,
        )

    def at(self, which: Literal["helix_endo", "helix_epi"], side: FloatArray) -> FloatArray:
        left, right = getattr(self, which)
        return np.asarray(np.where(side >= 0, left, right), dtype=np.float64)


def _linear(
    sites: Sites, angles: _Angles, w: FloatArray, e: FloatArray, biventricular: bool
) -> tuple[FloatArray, BoolArray]:
    if not biventricular:
        frames, weak = make_frames(sites.to_base, -sites.to_across)
        sign = np.ones(len(w))
    else:
        lv, rv, depth = _ventricles(sites)
        left, weak_left = make_frames(sites.to_base, -_gradient_lv(sites))
        right, weak_right = make_frames(sites.to_base, _gradient_rv(sites))
        epi, weak_epi = make_frames(sites.to_base, sites.to_outside)
        inner, turned = bislerp(left, right, depth)
        frames, outer = bislerp(inner, epi, sites.outside)
        sign = np.where(depth < 0.5, turned[:, 2], 1.0) * outer[:, 2]
        weak = np.where(sites.outside > 0.5, weak_epi, np.where(lv > rv, weak_left, weak_right))
    out = sites.outflow
    inside = (1 - out) * angles.at("helix_endo", sites.side) + out * angles.outflow_endo
    outside = (1 - out) * angles.at("helix_epi", sites.side) + out * angles.outflow_epi
    helix = sign * inside * w + outside * e
    sheet = sign * angles.sheet_endo * w + angles.sheet_epi * e
    return rotate(frames, helix, sheet), weak


def _bayer(
    sites: Sites, angles: _Angles, w: FloatArray, e: FloatArray, biventricular: bool
) -> tuple[FloatArray, BoolArray]:
    inside, outside = angles.at("helix_endo", sites.side), angles.at("helix_epi", sites.side)
    helix_wall, sheet_wall = inside * (1 - e) + outside * e, angles.sheet_endo * (1 - e) + angles.sheet_epi * e
    epi, weak = make_frames(sites.to_base, sites.to_outside, keep="longitudinal")
    epi = rotate(epi, helix_wall, sheet_wall)
    if not biventricular:
        inner, _ = make_frames(sites.to_base, -sites.to_across, keep="longitudinal")
        inner = rotate(inner, inside, np.full(len(w), angles.sheet_endo))
    else:
        lv, rv, depth = _ventricles(sites)
        left, weak_left = make_frames(sites.to_base, -_gradient_lv(sites), keep="longitudinal")
        right, weak_right = make_frames(sites.to_base, _gradient_rv(sites), keep="longitudinal")
        helix, sheet = inside * (1 - 2 * depth), angles.sheet_endo * (1 - 2 * depth)
        inner, _ = bislerp(rotate(left, helix, sheet), rotate(right, helix, sheet), depth)
        weak = np.where(sites.outside > 0.5, weak, np.where(lv > rv, weak_left, weak_right))
    return bislerp(inner, epi, e)[0], weak


def _ventricles(sites: Sites) -> tuple[FloatArray, FloatArray, FloatArray]:
    """phi_LV, phi_RV of Bayer et al., and phi_RV / (phi_LV + phi_RV), the depth in the septum from left to right."""
    lv = np.maximum((1 - sites.outside + sites.across) / 2, 0.0)
    rv = np.maximum((1 - sites.outside - sites.across) / 2, 0.0)
    total = lv + rv
    return lv, rv, np.divide(rv, total, out=(sites.across < 0).astype(float), where=total > 1e-12)


def _gradient_lv(sites: Sites) -> FloatArray:
    return (sites.to_across - sites.to_outside) / 2


def _gradient_rv(sites: Sites) -> FloatArray:
    return (-sites.to_across - sites.to_outside) / 2
