"""Surfaces, walls and meshes in, objects of PyVista, meshio and scikit-fem out: in memory, as in the files.

The nouns have methods of these names, which call what stands here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.errors import InputError, MissingDependencyError
from femprep.export.content import require_elements
from femprep.export.deck.data import over_all
from femprep.export.deck.names import facet_names, region_names
from femprep.export.vtk.polydata import surface_polydata, wall_polydata
from femprep.export.vtu.write import unstructured_grid
from femprep.mesh.elements import ELEMENTS, FACET_CORNERS, first_row
from femprep.model import IntArray, Surface, VolumeMesh, Wall, tag_name

#: Data that colour a picture, by what is drawn.
_COLOURS = {Wall: "facet_tag", VolumeMesh: "region"}
#: Classes of scikit-fem by element, and which of our corners each corner of its hexahedra is. Its wedges are left out:
#: in 12.0 their quadrature weights add up to a quarter, where the reference wedge has a volume of a half.
_SKFEM = {"tetra": "MeshTet1", "tetra10": "MeshTet2", "hexahedron": "MeshHex1"}
_SKFEM_HEXAHEDRON = [0, 4, 3, 1, 7, 5, 2, 6]


def to_pyvista(noun: Surface | Wall | VolumeMesh) -> Any:
    """A ``pyvista.PolyData`` or ``UnstructuredGrid`` with all data, as in the files femprep writes for VTK."""
    import pyvista

    if isinstance(noun, VolumeMesh):
        return pyvista.wrap(unstructured_grid(noun))
    return pyvista.wrap(wall_polydata(noun) if isinstance(noun, Wall) else surface_polydata(noun))


def to_meshio(noun: Surface | Wall | VolumeMesh) -> Any:
    """A ``meshio.Mesh``: the cells, behind them the tagged facets, tags as cell data, their names as field data.

    Tags of a volume mesh are one array, ``region``, as most formats have it: on facets it holds their facet tags.

    Raises
    ------
    InputError
        meshio has no such element.
    """
    import meshio

    if isinstance(noun, Surface):
        kind = "triangle" if noun.cells.shape[1] == 3 else "quad"
        return meshio.Mesh(noun.points, [(kind, noun.cells)], point_data=dict(noun.point_data))
    if isinstance(noun, Wall):
        names = {tag_name(int(tag)): np.array([tag, 2]) for tag in np.unique(noun.facet_tag)}
        triangles = [("triangle", noun.triangles)]
        data = {"facet_tag": [noun.facet_tag]}
        return meshio.Mesh(noun.points, triangles, {"template": noun.template}, data, names)
    require_elements(noun)
    names = {name: np.array([tag, 3]) for name, tag in region_names(noun).items()}
    names |= {name: np.array([tag, 2]) for name, tag in facet_names(noun).items()}
    cells, facets = list(noun.cells.items()), list(noun.facets.items())
    # An array has to be there for every block: where it says nothing it is zero.
    every = {"region": np.concatenate([noun.region, noun.facet_tag]), **over_all(noun)}
    ends = np.cumsum([len(block) for _, block in cells + facets])[:-1]
    data = {name: np.split(values, ends) for name, values in every.items()}
    try:
        return meshio.Mesh(noun.points, cells + facets, dict(noun.point_data), data, names)
    except KeyError as error:
        raise InputError(f"meshio has no element {error}; write the mesh by write_mesh instead") from error


def to_skfem(mesh: VolumeMesh) -> Any:
    """A mesh of scikit-fem's, with ``subdomains`` by the names of regions and ``boundaries`` by those of facets.

    Raises
    ------
    InputError
        The mesh has elements of several types, or of one that scikit-fem has not.
    MissingDependencyError
        scikit-fem is not installed.
    """
    try:
        import skfem
    except ImportError as error:
        raise MissingDependencyError("to_skfem needs scikit-fem; install it with pip install scikit-fem") from error
    kinds = list(mesh.cells)
    if len(kinds) != 1 or kinds[0] not in _SKFEM:
        raise InputError(
            f"scikit-fem takes elements of one type of {', '.join(_SKFEM)}, and this mesh has {', '.join(kinds)}"
        )
    kind, block = kinds[0], mesh.cells[kinds[0]]
    cells = block[:, _SKFEM_HEXAHEDRON] if kind == "hexahedron" else block
    out = getattr(skfem, _SKFEM[kind])(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(cells.T))
    # Quadratic meshes have their corners alone as vertices, renumbered.
    corners = np.unique(block[:, : ELEMENTS[kind].corners]) if ELEMENTS[kind].quadratic else None
    own = [block[:, : FACET_CORNERS[kind]] for kind, block in mesh.facets.items()]
    if corners is not None:
        own = [np.searchsorted(corners, block) for block in own]
    number = first_row(_padded(out.facets.T), np.concatenate([np.empty((0, 4), np.int64), *map(_padded, own)]))
    return out.with_subdomains(
        {name: np.flatnonzero(mesh.region == tag) for name, tag in region_names(mesh).items()}
    ).with_boundaries({name: number[mesh.facet_tag == tag] for name, tag in facet_names(mesh).items()})


def plot(noun: Surface | Wall | VolumeMesh, **keywords: Any) -> Any:
    """Show in a window or a notebook, coloured by tags; keywords are those of ``pyvista.DataSet.plot``."""
    colour = {"scalars": name} if (name := _COLOURS.get(type(noun))) else {}
    return to_pyvista(noun).plot(**{"show_edges": True, **colour, **keywords})


def _padded(facets: IntArray) -> IntArray:
    """Corners of facets in order, ``(n, 4)``, triangles with -1 in front; scikit-fem's repeat one of theirs."""
    out = np.full((len(facets), 4), -1, dtype=np.int64)
    out[:, 4 - facets.shape[1] :] = facets
    out.sort(axis=1)
    out[:, 1:][out[:, 1:] == out[:, :-1]] = -1
    out.sort(axis=1)
    return out
