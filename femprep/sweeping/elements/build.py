"""Two matched surfaces in, a tagged VolumeMesh of layers out: wedges, hexahedra, or tetrahedra split from either."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.errors import OptionError, StageError
from femprep.mesh.measures.sample_points import CORNER_EDGES
from femprep.model import FACET_TAGS, REGION_TAGS, FloatArray, IntArray, Progress, VolumeMesh
from femprep.options import SweepOptions, choose, takes
from femprep.options.advice import LONGER_EDGES
from femprep.options.run import TETWILD
from femprep.sweeping.cup.matched import MatchedSurfaces
from femprep.sweeping.cup.prism_split import checkerboard
from femprep.sweeping.elements.lay import lay
from femprep.sweeping.elements.quadratic import quadratic
from femprep.sweeping.elements.split import (
    checkered,
    hexahedron_tetrahedra,
    prisms,
    rising,
    sides,
    wedge_tetrahedra,
)


@takes(SweepOptions)
def sweep(
    matched: MatchedSurfaces,
    *,
    options: SweepOptions | None = None,
    progress: Progress | None = None,
    **changes: Any,
) -> VolumeMesh:
    """Fill the wall between two matched surfaces with layers of elements.

    Parameters
    ----------
    matched : MatchedSurfaces
        Both surfaces on one cup.
    options, **changes
        :class:`~femprep.options.SweepOptions`; ``element``, ``layers``, ``grading`` and ``order`` matter here.
    progress : callable, optional
        Called with ``("volume", fraction)``.

    Returns
    -------
    VolumeMesh
        Point ``i`` of layer ``l`` is number ``l * V + i``: layer by layer from the endocardium, template vertex first;
        mid-side nodes follow. Facets are tagged ``endo``, ``epi``, ``base`` and, where clipped, ``apex``, in order.
        ``point_data``: ``transmural`` (0 on the endocardium, 1 on the epicardium, along the line between),
        ``thickness`` (length of that line, mm), ``template`` (vertex of the cup; -1 for mid-side nodes).
        ``cell_data``: ``layer``. The same cup and number of layers give the same connectivity. Lines are straight, but
        where poor elements were mended: there nodes inside the wall have moved, and those on the surfaces along them.

    Raises
    ------
    OptionError
        The element does not go with the cup: wedges need triangles, hexahedra quadrilaterals.
    StageError
        An element is inverted.

    Examples
    --------
    >>> matched = fp.match_surfaces(endo=endo, epi=epi, base=fp.find_base(seg), edge_length=8.0)
    >>> fp.sweep(matched, edge_length=8.0)
    VolumeMesh(... points, ... tetra, ... facets: lv, endo, epi, base)
    """
    chosen = choose(SweepOptions, options, changes)
    tell = progress or (lambda stage, fraction: None)
    tell("volume", 0.0)
    cup = matched.cup
    count, corners = len(cup.disk), cup.cells.shape[1]
    shape = "wedge" if corners == 3 else "hexahedron"
    if chosen.element not in ("tetra", shape):
        raise OptionError(
            f"option 'element' is {chosen.element!r}, but the surfaces are matched on a cup of "
            f"{'triangles' if corners == 3 else 'quadrilaterals'}; choose tetra or {shape}"
        )
    layers = chosen.layers or matched.layers
    points, depth, mended = lay(matched, chosen)
    thickness = np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0)
    for name, rim in (("base", cup.base), ("apex", cup.apex)):
        if len(rim):
            points[:, rim] = matched.planes[name].feet(points[:, rim])
    points = points.reshape(-1, 3)
    name, cells, facets, tags = _connect(cup.cells, count, layers, cup.base, cup.apex, chosen.element)
    tell("volume", 0.5)
    _check_positive(points, cells, name)
    number = np.arange((layers + 1) * count)
    info: dict[str, Any] = {
        "mesher": "sweep",
        "element": name,
        "layers": layers,
        "columns": cup.columns,
        "rows": cup.rows,
        "template_vertices": count,
        "template": "triangle" if corners == 3 else "quad",
        "grading": chosen.grading,
        "matching": dict(matched.info),
        "mended": mended,
    }
    mesh = VolumeMesh(
        points,
        {name: cells},
        np.full(len(cells), REGION_TAGS["lv"]),
        facets,
        tags.astype(np.int32),
        cell_data={"layer": np.repeat(np.arange(layers, dtype=np.int32), len(cells) // layers)},
        point_data={
            "transmural": depth.ravel(),
            "thickness": np.tile(thickness, layers + 1),
            "template": (number % count).astype(np.int32),
        },
        planes=matched.planes,
        info=info,
    )
    if chosen.order == 2:
        mesh = quadratic(mesh, matched, depth.ravel())
    tell("volume", 1.0)
    return mesh


def least_corner(points: FloatArray, cells: IntArray, name: str) -> FloatArray:
    """Least determinant of the three edges at a corner of each element ``(m,)``, mm3; not positive where inverted."""
    corner = points[cells]
    least = np.full(len(cells), np.inf)
    for own, near in enumerate(CORNER_EDGES[name]):
        one, two, three = (corner[:, other] - corner[:, own] for other in near)
        np.minimum(least, np.einsum("ij,ij->i", one, np.cross(two, three)), out=least)
    return least


def _check_positive(points: FloatArray, cells: IntArray, name: str) -> None:
    """Make sure that no element of this type is inverted."""
    least = least_corner(points, cells, name)
    if least.min() <= 0.0:
        worst = points[cells[int(np.argmin(least))]].mean(axis=0)
        raise StageError(
            f"{int(np.count_nonzero(least <= 0.0))} of {len(cells)} {name} elements are inverted, the worst near "
            f"{np.round(worst, 1).tolist()} (mm LPS)",
            advice=[LONGER_EDGES, TETWILD],
        )


def _connect(
    cells: IntArray, count: int, layers: int, base: IntArray, apex: IntArray, element: str
) -> tuple[str, IntArray, dict[str, IntArray], IntArray]:
    """Elements, facets by type, and the facets' tags."""
    solid = prisms(cells, count, layers)
    inner, outer = cells[:, ::-1], cells + layers * count
    rims = [("base", sides(base, count, layers, inward=False))]
    if len(apex):
        rims.append(("apex", sides(apex, count, layers, inward=True)))
    groups = [("endo", inner), ("epi", outer), *rims]
    if element != "tetra":
        blocks: dict[str, list[IntArray]] = {}
        numbers: dict[str, list[IntArray]] = {}
        for tag, facets in groups:
            kind = "triangle" if facets.shape[1] == 3 else "quad"
            blocks.setdefault(kind, []).append(facets)
            numbers.setdefault(kind, []).append(np.full(len(facets), FACET_TAGS[tag]))
        together = {kind: np.concatenate(parts) for kind, parts in blocks.items()}
        return element, solid, together, np.concatenate([n for kind in together for n in numbers[kind]])
    if cells.shape[1] == 3:
        tetrahedra = wedge_tetrahedra(solid, cells, layers)
        groups = [(tag, f if f.shape[1] == 3 else rising(f, count)) for tag, f in groups]
    else:
        colour, odd = checkerboard(cells, count, layers)
        tetrahedra = hexahedron_tetrahedra(solid, odd)
        groups = [(tag, checkered(f, colour, count)) for tag, f in groups]
    tags = np.concatenate([np.full(len(f), FACET_TAGS[tag]) for tag, f in groups])
    return "tetra", tetrahedra, {"triangle": np.concatenate([f for _, f in groups])}, tags
