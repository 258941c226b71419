"""Mesh of a whole heart in; fibres of its atria, by the openings of their valves and veins, out.

In each element the wall gives the transmural direction, the gradient of a harmonic field from endocardium to
epicardium, and one of three further harmonic fields the direction k that fibres run across (Piersanti et al. 2021,
Algorithms 2 and 3): from the veins to the valve near the valve, from vein to vein near the veins, and one over all
openings between. The fibre is the unit vector along the wall at right angles to k; it is not rotated through the wall.

==================== ======================== ===================
field                left atrium              right atrium
==================== ======================== ===================
``ring``             mitral 1, others 0       tricuspid 1, others 0
``veins``            left veins 1, right 0    inferior cava 1, superior 0
``over``             right veins 2, mitral 1, inferior cava 2, tricuspid 1,
                     left 0, appendage -1     superior 0, appendage -1
==================== ======================== ===================

Of the bundles of the paper those are left out whose landmarks no opening gives: in the right atrium the crista
terminalis, the pectinate muscles, the inter-caval bundle, the isthmus, the septum's own direction; in both the bundles
between the atria. An appendage that has no opening takes no part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from scipy.spatial import cKDTree

from femprep.anatomy.frames import make_frames
from femprep.anatomy.laplace.dirichlet import solve
from femprep.anatomy.laplace.fem import LinearElements
from femprep.anatomy.part import part_of
from femprep.anatomy.thickness import wall_thickness
from femprep.anatomy.veins import VEINS, name_veins
from femprep.errors import InputError
from femprep.mesh.measures.weighted import weighted_percentile
from femprep.model import FACET_TAGS, REGION_TAGS, BoolArray, FloatArray, IntArray, Notice, VolumeMesh, noted
from femprep.options.fibres import Vein

#: Of each atrium: its valve, the veins of the field between veins (1 and 0), its appendage; and from where on the field
#: of the valve, and below and above which that between veins, give the direction (Table 3 of the paper).
_ATRIA: Final[Mapping[str, tuple[str, Vein, Vein, Vein, float, float, float]]] = {
    "la": ("mitral", "left_pulmonary", "right_pulmonary", "left_appendage", 0.65, 0.1, 0.65),
    "ra": ("tricuspid", "inferior_cava", "superior_cava", "right_appendage", 0.9, 0.1, 0.9),
}
#: Numbers of ``atrial_bundle``: round the valve, the first and the second kind of veins, and between.
BUNDLES: Final = {"la": (1, 2, 3, 4), "ra": (5, 6, 7, 8)}
#: A slope below this share of the median one is none.
_FLAT: Final = 1e-6
_NAMES: Final = ("fiber", "sheet", "normal")


def add_atrial_fibres(
    mesh: VolumeMesh,
    veins: Mapping[Vein, Sequence[tuple[float, float, float]]] | None = None,
    centres: Sequence[FloatArray] = (),
) -> VolumeMesh:
    """Add fibre, sheet and normal directions to the atria of a whole heart, by a Laplace-based rule.

    Parameters
    ----------
    mesh : VolumeMesh
        With regions ``la`` or ``ra`` and facets ``endo_la``, ``endo_ra``, ``epi``, ``mitral``, ``tricuspid`` and
        ``veins``; fibres that it has elsewhere stay.
    veins : mapping of str to sequence of points, optional
        What the openings near these points are, mm: ``left_pulmonary``, ``right_pulmonary``, ``left_appendage``,
        ``superior_cava``, ``inferior_cava``, ``right_appendage``. Told from where they lie where not given.
    centres : sequence of (3,) arrays, optional
        Centres of the openings, mm, where rims of several touch.

    Returns
    -------
    VolumeMesh
        With ``fiber``, ``sheet`` and ``normal`` ``(n_cells, 3)`` in the atria too, ``atrial_bundle`` ``(n_cells,)``, 0
        elsewhere, and ``info["atria"]``: openings, bundles, thickness of the walls.

    Raises
    ------
    InputError
        There is no atrium, or an opening that the rule needs is not found; the message holds the line that tells it.

    References
    ----------
    Piersanti et al., Modeling cardiac muscle fibers in ventricular and atrial electrophysiology simulations, Computer
    Methods in Applied Mechanics and Engineering 373, 2021, doi:10.1016/j.cma.2020.113468

    Examples
    --------
    >>> fp.add_atrial_fibres(whole).cell_data["atrial_bundle"].max()  # doctest: +SKIP
    8
    """
    atria = [name for name in _ATRIA if np.any(mesh.region == REGION_TAGS[name])]
    if not atria:
        raise InputError(f"the mesh has no atrium; its regions: {', '.join(mesh.region_names)}")
    named = name_veins(mesh, atria, veins or {}, centres)
    thickness = wall_thickness(mesh)
    bundle = np.zeros(mesh.n_cells, dtype=np.int32)
    triads = {name: np.array(mesh.cell_data.get(name, np.tile(axis, (mesh.n_cells, 1)))) for name, axis in _axes()}
    record: dict[str, Any] = {"rule": "Piersanti et al. 2021", "bundles": {}, "thickness_mm": {}}
    lost = 0
    for name in atria:
        own = mesh.region == REGION_TAGS[name]
        part, cells, nodes, _ = part_of(mesh, own)
        rings = {vein: np.flatnonzero(np.isin(nodes, at)) for vein, at in named.items() if vein in VEINS[name]}
        frames, kind, weak = _fibres(part, name, rings)
        for key, values in zip(_NAMES, (frames[:, :, 0], frames[:, :, 2], frames[:, :, 1])):
            triads[key][cells] = values
        bundle[cells] = kind
        lost += weak
        volume = np.bincount(kind, weights=_volumes(part), minlength=max(BUNDLES[name]) + 1)
        valve, one, other, *_ = _ATRIA[name]
        for number, words in zip(BUNDLES[name], (valve, one, other, f"{name} between")):
            record["bundles"][words] = {"number": number, "ml": round(float(volume[number]) / 1e3, 3)}
        spread = [weighted_percentile(thickness[cells], _volumes(part), q) for q in (10.0, 50.0, 90.0)]
        record["thickness_mm"][name] = dict(zip(("p10", "median", "p90"), (round(float(x), 2) for x in spread)))
    record["openings"] = {
        vein: np.round(mesh.points[at].mean(axis=0), 2).tolist() for vein, at in sorted(named.items())
    }
    untold = [vein for vein in sorted(named) if vein not in (veins or {})]
    if untold:
        words = f"openings of the atria were named by where they lie: {', '.join(untold)}"
        record = noted(record, Notice.of("assumed", words))
    if lost:
        words = "{amount} of the atria, in rims, have no fibre direction of their own: that of the nearest is theirs"
        record = noted(record, Notice.of("assumed", words, amount=lost, unit="elements"))
    found = mesh.with_data(cell={**triads, "atrial_bundle": bundle})
    return replace(found, info={**mesh.info, "atria": record})


def _axes() -> list[tuple[str, FloatArray]]:
    return list(zip(_NAMES, np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])))


def _volumes(part: VolumeMesh) -> FloatArray:
    return LinearElements(part).volume


def _fibres(part: VolumeMesh, atrium: str, rings: Mapping[Vein, IntArray]) -> tuple[FloatArray, IntArray, int]:
    """Columns fibre, normal and sheet of each element, the bundle it is in, and how many have none of their own."""
    valve, one, other, appendage, ring_from, low, high = _ATRIA[atrium]
    space = LinearElements(part)
    compact = np.full(len(part.points), -1)
    compact[space.nodes] = np.arange(space.n)
    endo, epi, at_valve = (space.facet_nodes(FACET_TAGS[name]) for name in (f"endo_{atrium}", "epi", valve))
    for name, nodes in ((f"endo_{atrium}", endo), ("epi", epi), (valve, at_valve)):
        if not len(nodes):
            raise InputError(f"fibres of the atria: region {atrium!r} has no facets tagged {name!r}; cut its openings")
    # A wide rim is held along its middle, so that the fields have a slope across it.
    edge = np.union1d(endo, epi)
    at = {}
    for key, nodes in rings.items():
        own = compact[nodes][compact[nodes] >= 0]
        within = np.setdiff1d(own, edge)
        at[key] = within if len(within) else own
    main = np.bincount(space.piece).argmax()
    matrix = space.stiffness()

    def field(*fixed: tuple[IntArray, float]) -> FloatArray:
        value = np.full(space.n, np.nan)
        value[space.piece != main] = 0.0
        for nodes, wanted in fixed:
            value[nodes] = wanted
        rows = np.flatnonzero(~np.isnan(value))
        return solve(space, matrix, (rows, value[rows]))

    def slope(values: FloatArray) -> FloatArray:
        # Walls of atria are an element or two thick, where slopes of single elements scatter: means at nodes do not.
        return space.to_cells(space.to_nodes(space.gradient(values)))

    none = np.empty(0, dtype=np.int64)
    side = at.get(appendage, none)
    depth = field((endo, 0.0), (epi, 1.0))
    ring = field((at[one], 0.0), (at[other], 0.0), (side, 0.0), (at_valve, 1.0))
    between = field((at[one], 1.0), (at[other], 0.0))
    over = field((at[one], 2.0 if atrium == "ra" else 0.0), (at[other], 0.0 if atrium == "ra" else 2.0), (side, -1.0),
                 (at_valve, 1.0))  # fmt: skip
    near, along = space.to_cells(ring), space.to_cells(between)
    kind = np.select([near >= ring_from, along >= high, along <= low], [0, 1, 2], 3)
    slopes = [slope(values) for values in (ring, between, between, over)]
    stray = space.to_cells((space.piece != main).astype(float)) > 0.5
    centre = space.to_cells(space.points)
    # Elements with all corners on one rim have no slope, nor has a piece that hangs on the rest of the heart alone.
    across, far = _filled(np.choose(kind[:, None], slopes), stray, kind, centre)
    through, deep = _filled(slope(depth), stray, kind, centre)
    frames, weak = make_frames(across, through)
    frames[:, :, 1] = np.cross(frames[:, :, 0], frames[:, :, 2])
    return frames, np.array(BUNDLES[atrium])[kind], int(np.count_nonzero(weak | far | deep))


def _filled(slope: FloatArray, lost: BoolArray, kind: IntArray, centre: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Slopes with those that are none taken from the nearest element of the same bundle; and which these are."""
    size = np.linalg.norm(slope, axis=1)
    lost = lost | (size < _FLAT * np.median(size))
    out = slope.copy()
    for each in np.unique(kind[lost]):
        rows, rest = np.flatnonzero(lost & (kind == each)), np.flatnonzero(~lost & (kind == each))
        rest = rest if len(rest) else np.flatnonzero(~lost)
        out[rows] = slope[rest[cKDTree(centre[rest]).query(centre[rows])[1]]]
    return out, lost
