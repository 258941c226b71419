"""Elements and facets as a file lists them, in parts of one type each, in; a tagged volume mesh out."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from femprep.errors import InputError
from femprep.export.deck.names import Numbers
from femprep.export.deck.unread import no_elements
from femprep.mesh.elements import ELEMENTS, FACET_CORNERS, element_faces
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.model.notice import Notice, noted

log = logging.getLogger(__name__)


@dataclass
class DeckParts:
    """What a reader found, in the order of the file.

    Attributes
    ----------
    cells : list of (kind, nodes, region, data)
        Elements of one type: nodes ``(n, p)``, region tags ``(n,)``, arrays ``(n, ...)`` by name.
    facets : list of (kind, nodes, tag)
        Facets of one type and tag.
    numbers : Numbers
        Tags of the names met.
    left_out : set of str
        Types of elements that femprep does not know.
    """

    cells: list[tuple[str, IntArray, IntArray, Mapping[str, np.ndarray]]] = field(default_factory=list)
    facets: list[tuple[str, IntArray, int]] = field(default_factory=list)
    numbers: Numbers = field(default_factory=Numbers)
    left_out: set[str] = field(default_factory=set)

    def mesh(self, points: FloatArray, region_from: str, facets_from: str) -> VolumeMesh:
        """The mesh of these parts, elements of a type together; data that not all parts have are left out, and told.

        Raises
        ------
        InputError
            There are no volume elements, or a node number is out of range.
        """
        if self.left_out:
            log.warning("elements of types %s are left out", ", ".join(sorted(self.left_out)))
        if not any(len(nodes) for _, nodes, _, _ in self.cells):
            raise no_elements([*sorted(self.left_out), *dict.fromkeys(kind for kind, *_ in self.facets)])
        kinds = list(dict.fromkeys(kind for kind, *_ in self.cells))
        ordered = [part for kind in kinds for part in self.cells if part[0] == kind]
        facet_kinds = list(dict.fromkeys(kind for kind, *_ in self.facets))
        sides = [part for kind in facet_kinds for part in self.facets if part[0] == kind]
        for nodes in [*(part[1] for part in ordered), *(part[1] for part in sides)]:
            if nodes.size and (nodes.min() < 0 or nodes.max() >= len(points)):
                wrong = int(nodes.max()) if nodes.max() >= len(points) else int(nodes.min())
                raise InputError(f"node {wrong} (from 0) is used, but there are {len(points)} nodes")
        once = [(kind, _once(nodes), tag) for kind, nodes, tag in sides]
        repeated = sum(len(nodes) for _, nodes, _ in sides) - sum(len(nodes) for _, nodes, _ in once)
        shared = [name for name in ordered[0][3] if all(name in data for *_, data in ordered)]
        info = noted(self.numbers.info, *self._partly(shared), *_told(repeated))
        none = np.empty(0, dtype=np.int32)
        return VolumeMesh(
            points=points,
            cells={kind: np.concatenate([nodes for k, nodes, *_ in ordered if k == kind]) for kind in kinds},
            region=np.concatenate([region for _, _, region, _ in ordered]),
            facets={kind: np.concatenate([nodes for k, nodes, _ in once if k == kind]) for kind in facet_kinds},
            facet_tag=np.concatenate([none, *(np.full(len(nodes), tag) for _, nodes, tag in once)]),
            cell_data={name: np.concatenate([data[name] for *_, data in ordered]) for name in shared},
            info={
                "source": {"region": region_from, "facet_tag": facets_from, "left_out": sorted(self.left_out)},
                **info,
            },
        )

    def _partly(self, shared: list[str]) -> Iterator[Notice]:
        """What some elements have and others do not."""
        for name in sorted({name for *_, data in self.cells for name in data}.difference(shared)):
            without = sum(len(nodes) for _, nodes, _, data in self.cells if name not in data)
            total = sum(len(nodes) for _, nodes, *_ in self.cells)
            words = f"{name} is left out: {{amount}} of {total} have none"
            yield Notice.of("left out", words, amount=without, unit="elements")


def _once(facets: IntArray) -> IntArray:
    """The facets of one name, each once."""
    if not len(facets):
        return facets
    first = np.unique(np.sort(facets, axis=1), axis=0, return_index=True)[1]
    return facets[np.sort(first)]


def _told(repeated: int) -> list[Notice]:
    if not repeated:
        return []
    words = "{amount} facets are listed again under the same name, and taken once"
    return [Notice.of("repaired", words, amount=repeated)]


def rows_of_nodes(rows: Iterable[Iterable[int]], place: Mapping[int, int]) -> IntArray:
    """Rows of nodes by their places, of rows by their labels.

    Raises
    ------
    InputError
        A node is not defined.
    """
    try:
        return np.array([[place[n] for n in row] for row in rows], dtype=np.int64)
    except KeyError as error:
        raise InputError(f"node {error.args[0]} is used, but not defined") from None


def require_once(labels: Iterable[int], what: str) -> None:
    """Check that nodes or elements are defined once.

    Raises
    ------
    InputError
        One is defined more often: programs differ in which definition they take.
    """
    label, times = max(Counter(labels).items(), key=lambda one: one[1], default=(0, 0))
    if times > 1:
        raise InputError(f"{what} {label} is defined {times} times; keep one of the definitions")


def with_mid_side_nodes(kind: str, corners: IntArray, cells: Mapping[str, IntArray]) -> tuple[str, IntArray]:
    """Facets of which a file gives the corners alone, with the mid-side nodes of the quadratic elements they lie on.

    A facet that lies on no quadratic element stays as it is; where not all of them do, all stay.
    """
    grown = {"triangle": "triangle6", "quad": "quad8"}[kind]
    faces = element_faces({name: block for name, block in cells.items() if ELEMENTS[name].quadratic}).get(grown)
    if faces is None or not len(corners):
        return kind, corners
    count = FACET_CORNERS[kind]
    where = {tuple(sorted(row)): i for i, row in enumerate(faces.nodes[:, :count].tolist())}
    rows = [where.get(tuple(sorted(row)), -1) for row in corners.tolist()]
    if min(rows) < 0:
        return kind, corners
    found = faces.nodes[rows]
    # The face may begin at another corner, or be seen from its other side: each edge has its node all the same.
    out = np.empty((len(corners), 2 * count), dtype=np.int64)
    out[:, :count] = corners
    for i, row in enumerate(found.tolist()):
        middle = {frozenset((row[k], row[(k + 1) % count])): row[count + k] for k in range(count)}
        own = corners[i].tolist()
        out[i, count:] = [middle[frozenset((own[k], own[(k + 1) % count]))] for k in range(count)]
    return grown, out
