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

from collections.abc import Iterable
from functools import cached_property
from typing import Final

import numpy as np
import scipy.sparse as sp

from femprep.anatomy.axes.find_axes import ventricular_axes
from femprep.anatomy.axes.insertions import with_insertions
from femprep.anatomy.axes.ventricular_axes import BASE_FACETS, VentricularAxes
from femprep.anatomy.laplace.dirichlet import solve
from femprep.anatomy.laplace.fem import LinearElements
from femprep.anatomy.laplace.multilevel import LevelSolution, solve_coarsest, solve_nested
from femprep.anatomy.part import refuse_blood
from femprep.errors import InputError
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS, FloatArray, IntArray, Progress, VolumeMesh
from femprep.model.products import unit_vectors

#: Conductivity across the gradient lines, relative to that along them, by coordinate. Round the wall no boundary holds
#: the lines' beginnings together, so there it has to be larger.
CROSS: Final = {"across": 1e-2, "upward": 1e-3, "turn": 5e-2}


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

    Notes
    -----
    On a mesh of linear elements that is a refinement (``mesh.nested``) each problem is solved on the coarser meshes
    first, which makes it as many times quicker as the mesh is larger.

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
        self.lv = self.facet_nodes("endo", "endo_lv")
        self.rv = self.facet_nodes("endo_rv")
        self.epi = self.facet_nodes("epi")
        self.base = self.facet_nodes(*BASE_FACETS, "base_rv")
        self.has_apex_plane = bool(np.any(mesh.facet_tag == tags["apex"]))
        self._solved: dict[str, LevelSolution] = {}
        if self.biventricular and not self.axes.insertions and not self._is_coarser:
            side = self.space.to_points(self.side)
            self._take(with_insertions(mesh, self.axes, side, keep_septal=axes is not None))

    #: Whether these are the fields of a coarser mesh, which keeps what helps to solve them on the finer one.
    _is_coarser = False

    def _take(self, axes: VentricularAxes) -> None:
        """Have other axes from now on, on the coarser meshes too."""
        self.axes = axes
        if self._coarser is not None:
            self._coarser._take(axes)

    @cached_property
    def _coarser(self) -> WallFields | None:
        """The fields on the mesh that this one is a refinement of."""
        nested = self.mesh.nested
        if nested is None or any(ELEMENTS[name].quadratic for name in (*self.mesh.cells, *nested.coarse.cells)):
            return None
        return _CoarserFields(nested.coarse, self.axes)

    @cached_property
    def _down(self) -> sp.csr_array:
        """Values at the nodes from those of the coarser mesh."""
        assert self.mesh.nested is not None
        assert self._coarser is not None
        down = self.mesh.nested.down
        ours, theirs = self.space.nodes, self._coarser.space.nodes
        if (len(ours), len(theirs)) == down.shape:
            return down
        return down[ours][:, theirs]

    def _solve(
        self,
        field: str,
        matrix: sp.csr_array,
        sides: tuple[IntArray, FloatArray],
        rhs: FloatArray | None = None,
        step: int = 0,
    ) -> FloatArray:
        """Solve one of the problems of a field, on the coarser meshes first where there are any."""
        coarser, key = self._coarser, f"{field} {step}"
        if coarser is not None:
            getattr(coarser, field)
            solved = solve_nested(self.space, matrix, sides, rhs, self._down, coarser._solved.pop(key))
        elif self._is_coarser:
            solved = solve_coarsest(self.space, matrix, sides, rhs)
        else:
            return solve(self.space, matrix, sides, rhs)
        if self._is_coarser:
            self._solved[key] = solved
        return solved.values

    def solve(self, progress: Progress | None = None) -> None:
        """Solve for all fields now, which are solved when first asked for otherwise; ``progress`` is told of each."""
        names = ("across", "upward", "across_distance", "upward_distance", "turn")
        for done, name in enumerate(names, 1):
            getattr(self, name)
            if progress is not None:
                progress("fields", done / len(names))

    def facet_nodes(self, *names: str) -> IntArray:
        """Nodes of the facets of some names."""
        return self.space.facet_nodes(*(FACET_TAGS[name] for name in names))

    @property
    def biventricular(self) -> bool:
        """Whether the mesh has an RV endocardium."""
        return len(self.rv) > 0

    @cached_property
    def laplace(self) -> sp.csr_array:
        """The stiffness matrix of equal conductivity everywhere."""
        return self.space.stiffness()

    def prescribed(self, *sides: tuple[IntArray, float]) -> tuple[IntArray, FloatArray]:
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
        return self._solve("across", self.laplace, self._transmural_sides)

    @property
    def _transmural_sides(self) -> tuple[IntArray, FloatArray]:
        return self.prescribed((self.epi, 0.0), (self.lv, 1.0), (self.rv, -1.0))

    @cached_property
    def across_distance(self) -> FloatArray:
        """As :attr:`across`, made linear in distance through the wall."""
        return np.clip(self._linear("across", self.across, self._transmural_sides), -1.0, 1.0)

    @cached_property
    def side(self) -> FloatArray:
        """Positive in the left ventricle, negative in the right one; on the epicardium, where w is 0, as inside."""
        inner = self.space.to_nodes(self.space.to_cells(self.across))
        return np.where(np.abs(self.across) > 1e-9, self.across, inner)

    @cached_property
    def outside(self) -> FloatArray:
        """Harmonic field: 1 on the epicardium, 0 on the endocardia (phi_epi of Bayer et al.)."""
        if not self.biventricular:
            return 1.0 - self.across
        sides = self.prescribed((self.epi, 1.0), (self.lv, 0.0), (self.rv, 0.0))
        return self._solve("outside", self.laplace, sides)

    @cached_property
    def upward(self) -> FloatArray:
        """Harmonic field: 0 at the apex, 1 at the base (psi_ab of Bayer et al.)."""
        return self._solve("upward", self.laplace, self._apicobasal_sides)

    @cached_property
    def upward_distance(self) -> FloatArray:
        """As :attr:`upward`, made linear in distance along its gradient lines."""
        return np.clip(self._linear("upward", self.upward, self._apicobasal_sides), 0.0, 1.0)

    @property
    def _apicobasal_sides(self) -> tuple[IntArray, FloatArray]:
        return self.prescribed((self.apex_nodes, 0.0), (self.base, 1.0))

    @cached_property
    def apex_nodes(self) -> IntArray:
        """Nodes where the apicobasal field is 0: the apex plane, or the line through the wall at a closed apex.

        A single node would make the field singular, the more so the finer the mesh. The line is the long axis below
        the endocardium; its nodes are those within three quarters of an edge length of it.
        """
        if self.has_apex_plane:
            return self.facet_nodes("apex")
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

    def _linear(self, name: str, field: FloatArray, sides: tuple[IntArray, FloatArray]) -> FloatArray:
        """The field with the same gradient lines and boundary values that is linear along each line."""
        gradient = self.space.gradient(field)
        size = np.linalg.norm(gradient, axis=1)
        weight = np.maximum(size, 1e-9 * size.max())
        matrix = self.space.stiffness(unit_vectors(gradient), weight, CROSS[name])
        return self._solve(f"{name}_distance", matrix, sides)

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
        v = self._solve("turn", space.stiffness(weight=weight), anchor, -space.load(start * weight[:, None]))
        total = start + space.gradient(v)
        length = np.linalg.norm(total, axis=1)
        direction, weight = unit_vectors(total), np.maximum(weight * length, 1e-9 * (weight * length).max())
        along = np.sum(direction * start, axis=1, keepdims=True) * direction
        cross = CROSS["turn"]
        flow = weight[:, None] * (along + cross * (start - along))
        v = self._solve("turn", space.stiffness(direction, weight, cross), anchor, -space.load(flow), step=1)
        mass = space.to_cells(v)
        v -= np.average(mass, weights=space.volume)
        return np.cos(angle + v), np.sin(angle + v)


class _CoarserFields(WallFields):
    """Fields on a coarser mesh."""

    _is_coarser = True
