"""A mesh in, meshes of 8, 64, 512... times as many elements out, nested, and what carries fields between them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
import scipy.sparse as sp

from femprep.errors import InputError, OptionError
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.sample_points import family
from femprep.model import FloatArray, IntArray, Notice, Progress, VolumeMesh, Wall, noted
from femprep.options import require_number
from femprep.volume.optimise import POOR
from femprep.volume.refine.amount import check_levels
from femprep.volume.refine.boundary import untagged_faces
from femprep.volume.refine.origin import Origin
from femprep.volume.refine.sheets import Sheets, find_sheets
from femprep.volume.refine.step import State, step
from femprep.volume.refine.transfer import restriction

#: More levels at once than this are a slip: eight times as many elements each.
MOST_LEVELS: Final = 6
#: Name of the cell data that tells the element of the mesh given that each element is a part of.
PARENT: Final = "parent"
#: Distances from the surface below this are not worth a word, mm.
_GAP: Final = 0.01


@dataclass(frozen=True, eq=False)
class Level:
    """A mesh, and the one its elements were cut into.

    Attributes
    ----------
    coarse, fine : VolumeMesh
    ways : dict of str to array
        Which way each element of the coarse mesh was cut, by type.
    """

    coarse: VolumeMesh
    fine: VolumeMesh

    @property
    def down(self) -> sp.csr_array:
        """Values at the fine mesh's nodes from those of the coarse one, ``(fine, coarse)``."""
        assert self.fine.nested is not None, "a refined mesh knows what it was cut from"
        return self.fine.nested.down

    @cached_property
    def up(self) -> sp.csr_array:
        """Values at the coarse mesh's nodes from those of the fine one, ``(coarse, fine)``."""
        return restriction(self.coarse, self.fine)


@dataclass(frozen=True, eq=False)
class Refinement:
    """A mesh and its refinements, coarse to fine.

    Attributes
    ----------
    levels : tuple of Level
        From the mesh given on.

    Examples
    --------
    >>> nested = fp.Refinement.of(mesh, levels=1)
    >>> height = nested.prolong(mesh.points[:, 2])
    >>> bool(abs(height - nested.fine.points[:, 2]).max() < 1e-9)
    True
    """

    levels: tuple[Level, ...]

    def __repr__(self) -> str:
        return f"Refinement({self.coarse.n_cells} -> {self.fine.n_cells} elements)"

    @classmethod
    def of(
        cls,
        mesh: VolumeMesh,
        levels: int = 1,
        *,
        wall: Wall | None = None,
        optimised: bool = True,
        poor: float = POOR,
        progress: Progress | None = None,
    ) -> Refinement:
        """Refine a mesh; arguments as of :func:`refine`.

        Examples
        --------
        >>> nested = fp.Refinement.of(mesh, levels=1)
        >>> nested.fine.n_cells == 8 * mesh.n_cells
        True
        """
        return cls(tuple(_refined(mesh, levels, wall, optimised, poor, progress)))

    @property
    def coarse(self) -> VolumeMesh:
        """The mesh given.

        Examples
        --------
        >>> nested = fp.Refinement.of(mesh, levels=1)
        >>> nested.coarse.n_cells == mesh.n_cells
        True
        """
        return self.levels[0].coarse

    @property
    def fine(self) -> VolumeMesh:
        """The finest mesh.

        Examples
        --------
        >>> nested = fp.Refinement.of(mesh, levels=1)
        >>> nested.fine.n_cells == 8 * mesh.n_cells
        True
        """
        return self.levels[-1].fine

    @property
    def parent(self) -> IntArray:
        """The element of the mesh given that each element of the finest is a part of, ``(n_cells,)``.

        Examples
        --------
        >>> nested = fp.Refinement.of(mesh, levels=1)
        >>> nested.parent[:9].tolist()
        [0, 0, 0, 0, 0, 0, 0, 0, 1]
        """
        return np.asarray(self.fine.cell_data[PARENT], dtype=np.int64)

    def prolong(self, values: Any) -> FloatArray:
        """Values ``(n, ...)`` at the nodes of the mesh given, at those of the finest; exact for linear fields.

        On quadratic elements their shape functions are used.

        Examples
        --------
        >>> nested = fp.Refinement.of(mesh, levels=1)
        >>> height = nested.prolong(mesh.points[:, 2])
        >>> bool(abs(height - nested.fine.points[:, 2]).max() < 1e-9)
        True
        """
        return self._carry(values, [level.down for level in self.levels], len(self.coarse.points))

    def restrict(self, values: Any) -> FloatArray:
        """Values ``(n, ...)`` at the nodes of the finest mesh, at those of the mesh given; exact for linear fields.

        Examples
        --------
        >>> nested = fp.Refinement.of(mesh, levels=1)
        >>> height = nested.restrict(nested.fine.points[:, 2])
        >>> bool(abs(height - mesh.points[:, 2]).max() < 1e-9)
        True
        """
        return self._carry(values, [level.up for level in self.levels[::-1]], len(self.fine.points))

    def to_children(self, values: Any) -> Any:
        """A value per element of the mesh given, for each element of the finest.

        Examples
        --------
        >>> nested = fp.Refinement.of(mesh, levels=1)
        >>> bool((nested.to_children(mesh.region) == nested.fine.region).all())
        True
        """
        return np.asarray(values)[self.parent]

    def to_parents(self, values: Any) -> FloatArray:
        """Mean over the elements of the finest mesh in each of the mesh given, by volume.

        Examples
        --------
        >>> nested = fp.Refinement.of(mesh, levels=1)
        >>> nested.to_parents(nested.fine.region).shape == (mesh.n_cells,)
        True
        """
        from femprep.mesh.measures.volume_elements import element_volumes

        volume = np.concatenate([element_volumes(self.fine.points, b, n) for n, b in self.fine.cells.items()])
        array = np.asarray(values, dtype=float)
        flat = array.reshape(len(array), -1)
        count = self.coarse.n_cells
        total = np.bincount(self.parent, weights=volume, minlength=count)
        columns = [np.bincount(self.parent, weights=volume * c, minlength=count) / total for c in flat.T]
        return np.stack(columns, axis=1).reshape(count, *array.shape[1:])

    @staticmethod
    def _carry(values: Any, matrices: list[sp.csr_array], count: int) -> FloatArray:
        array = np.asarray(values, dtype=float)
        if array.ndim == 0 or len(array) != count:
            raise InputError(f"values have shape {array.shape}, expected one for each of {count} nodes")
        flat = array.reshape(count, -1)
        for matrix in matrices:
            flat = matrix @ flat
        return np.asarray(flat).reshape(-1, *array.shape[1:])


def refine(
    mesh: VolumeMesh,
    levels: int = 1,
    *,
    wall: Wall | None = None,
    optimised: bool = True,
    poor: float = POOR,
    progress: Progress | None = None,
) -> VolumeMesh:
    """Cut every element of a mesh into eight, as often as asked, with new boundary nodes on the smooth surfaces.

    Tetrahedra are cut along the shortest diagonal of the octahedron inside [1]_, wedges and hexahedra into halves;
    quadratic elements along their curves. New nodes of endocardia and epicardia lie on the smooth surfaces of the
    wall, those of flat facets in their plane, those of rims in both. Facets, regions, names and interfaces are nested.
    Where a new place would spoil an element, a node goes there half of the way, a quarter, an eighth or not at all.
    Then poor tetrahedra are improved; nodes of surfaces stay on them.

    Parameters
    ----------
    mesh : VolumeMesh
        Of any element types; not collapsed.
    levels : int
        How often: each level halves the edges.
    wall : Wall, optional
        What the mesh fills. Without it, smooth surfaces are laid through the nodes of its own facets of each
        endocardium and epicardium: they repeat what its facets tell, and no more.
    optimised : bool
        Whether to improve poor tetrahedra; all nodes of other elements stay where they are cut.
    poor : float
        Quality below which a tetrahedron is poor, of :func:`femprep.volume.optimise.tet_quality`.
    progress : callable, optional
        Called with ``("refine", fraction)``.

    Returns
    -------
    VolumeMesh
        Eight elements for each, one after the other. Point data are interpolated, cell and facet data those of the
        element or facet cut; new are the cell data ``parent``, its number, and ``info["refinement"]``: levels, nodes
        held back, improvement. See :class:`Refinement` for fields between the levels.

    Raises
    ------
    InputError
        An element is collapsed or inverted, or a facet is the face of none.
    OptionError
        ``levels`` or ``poor`` is out of range.
    ResourceError
        So many elements do not fit into the memory of the machine.

    References
    ----------
    .. [1] Bey, Tetrahedral grid refinement, Computing 55, 1995. doi:10.1007/BF02238487

    Examples
    --------
    >>> fp.refine(mesh).n_cells == 8 * mesh.n_cells
    True
    """
    require_number("poor", poor, 0, 1)
    return _refined(mesh, levels, wall, optimised, poor, progress)[-1].fine


def _refined(
    mesh: VolumeMesh, levels: int, wall: Wall | None, optimised: bool, poor: float, progress: Progress | None
) -> list[Level]:
    """All levels, coarse to fine."""
    if not isinstance(levels, int | np.integer) or not 1 <= levels <= MOST_LEVELS:
        raise OptionError(f"levels is {levels!r}, expected a whole number from 1 to {MOST_LEVELS}")
    if mesh.n_cells == 0:
        raise InputError("the mesh has no elements; there is nothing to refine")
    if len({ELEMENTS[name].quadratic for name in mesh.cells}) > 1:
        raise InputError(f"the mesh mixes linear and quadratic elements ({', '.join(mesh.cells)}); give it one order")
    check_levels(mesh, levels)
    sheets = find_sheets(mesh, wall)
    improve = optimised and all(family(name) == "tetra" for name in mesh.cells)
    held = np.empty((0, 3), dtype=np.int64)
    if improve:
        ((name, block),) = mesh.cells.items()
        held = untagged_faces(name, block, mesh.region, mesh.facets)
    given = mesh.with_data(cell={PARENT: np.arange(mesh.n_cells, dtype=np.int64)})
    state = State(given, sheets.of_facet, held)
    found: list[Level] = []
    records: list[dict[str, Any]] = []
    # Each level has eight times the work of the one before.
    work = np.cumsum([8.0**k for k in range(levels)]) / sum(8.0**k for k in range(levels))
    for number in range(levels):
        coarse = state.mesh
        state, ways, record = step(state, sheets, bool(number == 0 and wall is not None), improve, poor)
        records.append(record)
        if number == levels - 1:
            state.mesh = _told(state.mesh, records, sheets, wall)
        state.mesh = replace(state.mesh, nested=Origin(coarse, state.mesh.points, state.mesh.cells, ways))
        found.append(Level(coarse, state.mesh))
        if progress is not None:
            progress("refine", float(work[number]))
    return found


def _told(mesh: VolumeMesh, records: list[dict[str, Any]], sheets: Sheets, wall: Wall | None) -> VolumeMesh:
    """The mesh with the record of its levels and what users have to know."""
    smooth = "of the wall" if wall is not None else "through the facets' own nodes"
    info = {**mesh.info, "refinement": {"levels": len(records), "surfaces": smooth, "steps": records}}
    notices = []
    if wall is None and sheets.surfaces:
        words = (
            "that new nodes lie on smooth surfaces through the nodes of the endocardium's and epicardium's facets: the "
            "surfaces the mesh was made of are not in its file"
        )
        notices.append(Notice.of("assumed", words))
    if sheets.kept:
        words = f"facets tagged {', '.join(sheets.kept)} are neither flat nor a known surface: they keep their shape"
        notices.append(Notice.of("assumed", words))
    if mesh.info.get("purkinje"):
        notices.append(
            Notice.of("left out", "the Purkinje fibres, which ended in nodes of the coarse mesh; add new ones")
        )
        info.pop("purkinje")
    gap = records[-1]["greatest_distance_from_surface_mm"]
    if gap >= _GAP:
        words = "that no element is spoiled, some boundary nodes were left up to {amount} off their smooth surface"
        notices.append(Notice.of("moved", words, amount=gap, unit="mm"))
    return replace(mesh, info=noted(info, *notices))
