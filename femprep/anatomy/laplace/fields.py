"""VolumeMesh in; the Laplace fields that coordinates and fibres share out, each solved once, when first asked for.

A harmonic field is not linear in distance: through a thick wall it bends, because the area it flows through grows.
Along a line of its gradient |grad u| is inversely proportional to that area, so diffusion along the line alone, with
the conductivity |grad u|, has a solution that is linear in the length of the line and keeps the boundary values:

    div( |grad u| T (T . grad x) ) = 0,    T = grad u / |grad u|.

This is the trajectory distance d0 / (d0 + d1) of Cobiveco (Schuler et al. 2021, doi 10.1016/j.media.2021.102247), in
one symmetric problem in place of its two least-squares problems. A hundredth of the conductivity across the lines keeps
it well posed.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from femprep.anatomy.axes import BASE_FACETS, VentricularAxes
from femprep.anatomy.find_axes import ventricular_axes
from femprep.anatomy.frames import normalise
from femprep.anatomy.laplace.dirichlet import solve
from femprep.anatomy.laplace.fem import LinearElements
from femprep.anatomy.part import refuse_blood
from femprep.errors import InputError
from femprep.model import FACET_TAGS, FloatArray, IntArray, VolumeMesh
from femprep.model.blocks import chosen_rows

logger = logging.getLogger(__name__)

#: Conductivity across the gradient lines, relative to that along them, by coordinate. Round the wall no boundary holds
#: the lines' beginnings together, so there it has to be larger.
CROSS: Final = {"across": 1e-2, "upward": 1e-3, "turn": 5e-2}
#: Facets of the inflow and the outflow valve of each ventricle.
VALVES: Final = {"lv": ("mitral", "aortic"), "rv": ("tricuspid", "pulmonary")}


def require_ventricle(facets: Iterable[str]) -> None:
    """Make sure that a wall has the facets that coordinates, segments and fibres begin from.

    Raises
    ------
    InputError
        Endocardium, epicardium, or base and valves are not among the names of its facets.
    """
    have = list(facets)
    for names in (("endo", "endo_lv"), ("epi",), BASE_FACETS):
        if not set(names) & set(have):
            wanted = " or ".join(map(repr, names[:2]))
            raise InputError(f"the mesh has no facets tagged {wanted}; its facets: {', '.join(have) or 'none'}")


class WallFields:
    """Fields at the nodes of a ventricular wall.

    Parameters
    ----------
    mesh : VolumeMesh
        Facets tagged ``endo`` or ``endo_lv``, ``epi``, ``base`` (or valves), ``apex`` where it is cut there, and
        ``endo_rv`` for both ventricles.
    axes : VentricularAxes, optional
        Found from the mesh where not given.

    Raises
    ------
    InputError
        Facets are missing, the mesh has blood pools, an element is inverted, or a piece of the mesh touches no tagged
        boundary.
    """

    def __init__(self, mesh: VolumeMesh, axes: VentricularAxes | None = None) -> None:
        refuse_blood(mesh)
        require_ventricle(mesh.facet_names)
        self.mesh = mesh
        self.axes = axes or ventricular_axes(mesh)
        self.space = LinearElements(mesh)
        tags = FACET_TAGS
        self.lv = self._nodes("endo", "endo_lv")
        self.rv = self._nodes("endo_rv")
        self.epi = self._nodes("epi")
        self.base = self._nodes(*BASE_FACETS)
        self.has_apex_plane = bool(np.any(mesh.facet_tag == tags["apex"]))
        if self.biventricular and not self.axes.insertions:
            self.axes = self._with_insertions(keep_septal=axes is not None)

    def _nodes(self, *names: str) -> IntArray:
        return self.space.facet_nodes(*(FACET_TAGS[name] for name in names))

    @property
    def biventricular(self) -> bool:
        """Whether the mesh has an RV endocardium."""
        return len(self.rv) > 0

    @cached_property
    def _laplace(self):  # type: ignore[no-untyped-def]
        return self.space.stiffness()

    def _dirichlet(self, *sides: tuple[IntArray, float]) -> tuple[IntArray, FloatArray]:
        """Nodes and values; where two sides share a node (the rim), the later one has it."""
        value = np.full(self.space.n, np.nan)
        for nodes, number in sides:
            value[nodes] = number
        nodes = np.flatnonzero(np.isfinite(value))
        return nodes, value[nodes]

    @cached_property
    def across(self) -> FloatArray:
        """Harmonic field w: 1 on the LV endocardium, 0 on the epicardium, -1 on the RV endocardium.

        Its zeros are the epicardium and the middle of the septum: w > 0 is the left ventricle, w < 0 the right one,
        and 1 - |w| runs from each endocardium to the epicardium or to the middle of the septum.
        """
        return solve(self.space, self._laplace, self._transmural_sides)

    @property
    def _transmural_sides(self) -> tuple[IntArray, FloatArray]:
        return self._dirichlet((self.epi, 0.0), (self.lv, 1.0), (self.rv, -1.0))

    @cached_property
    def across_distance(self) -> FloatArray:
        """As :attr:`across`, made linear in distance through the wall."""
        return np.clip(self.linear_in_distance(self.across, self._transmural_sides, CROSS["across"]), -1.0, 1.0)

    @cached_property
    def side(self) -> FloatArray:
        """Positive in the left ventricle, negative in the right one; on the epicardium, where w is 0, as inside."""
        inner = self.space.to_nodes(self.space.to_cells(self.across))
        return np.where(np.abs(self.across) > 1e-9, self.across, inner)

    def _with_insertions(self, keep_septal: bool) -> VentricularAxes:
        """The axes with the RV insertion points: where on the epicardium the two ventricles meet.

        Half-way up, as from labels: the median, before and behind, over the middle half of the heights of the groove.
        The middle between them becomes the septal direction, unless axes were given.
        """
        axes, centres = self.axes, [np.empty((0, 3))]
        side = self.space.to_points(self.side)
        for chosen in chosen_rows(self.mesh.facets, self.mesh.facet_tag == FACET_TAGS["epi"]).values():
            mixed = (side[chosen] < 0).any(axis=1) & (side[chosen] > 0).any(axis=1)
            centres.append(self.mesh.points[chosen[mixed]].mean(axis=1))
        groove = np.concatenate(centres)
        if not len(groove):
            return axes
        height = axes.height(groove)
        groove = groove[(height >= np.percentile(height, 25)) & (height <= np.percentile(height, 75))]
        turn = (axes.angle(groove) + 180.0) % 360.0 - 180.0
        if not ((turn > 0).any() and (turn < 0).any()):
            return axes
        ends = np.radians([np.median(turn[turn < 0]), np.median(turn[turn > 0])])
        out = float(np.median(axes.radius(groove)))
        at = axes.apex + float(np.median(axes.height(groove))) * axes.long_axis
        ways = [np.cos(a) * axes.septal + np.sin(a) * axes.anterior for a in (*ends, ends.mean())]
        points = {"inferior": at + out * ways[0], "anterior": at + out * ways[1]}
        septal = axes.septal if keep_septal else ways[2]
        return replace(axes, septal=septal, insertions=points)

    @cached_property
    def outside(self) -> FloatArray:
        """Harmonic field: 1 on the epicardium, 0 on the endocardia (phi_epi of Bayer et al.)."""
        if not self.biventricular:
            return 1.0 - self.across
        return solve(self.space, self._laplace, self._dirichlet((self.epi, 1.0), (self.lv, 0.0), (self.rv, 0.0)))

    @cached_property
    def upward(self) -> FloatArray:
        """Harmonic field: 0 at the apex, 1 at the base (psi_ab of Bayer et al.)."""
        return solve(self.space, self._laplace, self._apicobasal_sides)

    @cached_property
    def upward_distance(self) -> FloatArray:
        """As :attr:`upward`, made linear in distance along its gradient lines."""
        return np.clip(self.linear_in_distance(self.upward, self._apicobasal_sides, CROSS["upward"]), 0.0, 1.0)

    def valves(self, ventricle: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Harmonic fields of a ventricle with open valves (Doste et al. 2019, doi 10.1002/cnm.3185, section 2.3).

        Parameters
        ----------
        ventricle : {"lv", "rv"}

        Returns
        -------
        inflow, outflow : (n,) arrays
            0 at the ventricle's apex, 1 at its inflow and its outflow valve.
        share : (n,) array
            Of the outflow tract: 0 at the apex and the inflow valve, 1 at the outflow valve.

        Raises
        ------
        InputError
            Facets of a valve are missing.
        """
        names = VALVES[ventricle]
        rings = [self._nodes(name) for name in names]
        for name, ring in zip(names, rings):
            if not len(ring):
                have = ", ".join(self.mesh.facet_names)
                raise InputError(
                    f"rule doste needs facets tagged {name}, where the {ventricle} is open; the mesh has {have}; take "
                    "rule linear, or open the valves"
                )
        inflow, outflow = rings
        apex = self.apex_nodes
        if ventricle == "rv":
            centre = self.space.points[inflow].mean(axis=0)
            apex = self.rv[[np.argmax(np.linalg.norm(self.space.points[self.rv] - centre, axis=1))]]
        sides = (((inflow, 1.0),), ((outflow, 1.0),), ((inflow, 0.0), (outflow, 1.0)))
        first, second, third = (
            solve(self.space, self._laplace, self._dirichlet((apex, 0.0), *valve)) for valve in sides
        )
        return first, second, third

    @property
    def _apicobasal_sides(self) -> tuple[IntArray, FloatArray]:
        return self._dirichlet((self.apex_nodes, 0.0), (self.base, 1.0))

    @cached_property
    def apex_nodes(self) -> IntArray:
        """Nodes where the apicobasal field is 0: the apex plane, or the line through the wall at a closed apex.

        A single node would make the field singular, the more so the finer the mesh. The line is the long axis below
        the endocardium; its nodes are those within three quarters of an edge length of it.
        """
        if self.has_apex_plane:
            return self._nodes("apex")
        axes, points = self.axes, self.space.points
        height, radius = axes.height(points), axes.radius(points)
        near = self.lv[np.argsort(height[self.lv], kind="stable")[:1]]
        low = height < height[near[0]] + 1e-6 * axes.length
        edge = np.cbrt(np.sqrt(2.0) * 6.0 * self.space.volume[self._elements_at(low)].mean())
        chosen = low & (radius < 0.75 * edge)
        if not chosen.any():
            chosen = np.zeros_like(low)
        chosen[near] = True
        lowest = self.epi[np.argmin(height[self.epi] + radius[self.epi])]
        chosen[lowest] = True
        return np.flatnonzero(chosen)

    def _elements_at(self, nodes: np.ndarray) -> np.ndarray:
        return np.concatenate([flags.any(axis=1) for flags in self.space.corners(nodes)])

    def linear_in_distance(self, field: FloatArray, sides: tuple[IntArray, FloatArray], cross: float) -> FloatArray:
        """The field with the same gradient lines and boundary values that is linear along each line."""
        gradient = self.space.gradient(field)
        size = np.linalg.norm(gradient, axis=1)
        weight = np.maximum(size, 1e-9 * size.max())
        matrix = self.space.stiffness(normalise(gradient), weight, cross)
        return solve(self.space, matrix, sides)

    @cached_property
    def turn(self) -> tuple[FloatArray, FloatArray]:
        """Cosine and sine at nodes of the angle about the long axis, made linear in distance round the wall.

        The angle has a jump, but its difference v from the geometric angle has none. Two problems for v: first the
        harmonic angle, then the one that is linear along its gradient lines. Both are weighed with the squared
        distance from the axis, which takes out the singularity on the axis and leaves a body of revolution exact: there
        the geometric angle is both.
        """
        space, axes = self.space, self.axes
        angle = np.radians(axes.angle(space.points))
        around = np.cross(axes.long_axis, space.to_cells(space.points) - axes.apex)
        if np.cross(axes.long_axis, axes.septal) @ axes.anterior < 0:
            around = -around
        square = np.maximum(np.sum(around**2, axis=1), 1e-6 * axes.length**2)
        start = around / square[:, None]  # the gradient of the geometric angle
        weight = square / square.max()
        anchor = (np.array([0]), np.array([0.0]))
        v = solve(space, space.stiffness(weight=weight), anchor, -space.load(start * weight[:, None]))
        total = start + space.gradient(v)
        length = np.linalg.norm(total, axis=1)
        direction, weight = normalise(total), np.maximum(weight * length, 1e-9 * (weight * length).max())
        along = np.sum(direction * start, axis=1, keepdims=True) * direction
        cross = CROSS["turn"]
        flow = weight[:, None] * (along + cross * (start - along))
        v = solve(space, space.stiffness(direction, weight, cross), anchor, -space.load(flow))
        mass = space.to_cells(v)
        v -= np.average(mass, weights=space.volume)
        return np.cos(angle + v), np.sin(angle + v)
