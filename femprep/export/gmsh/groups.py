"""What meshio read of a Gmsh file, in; one number for each element, of the physical group that names it, out."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from femprep.export.deck.groups import naming_groups
from femprep.model.notice import Notice

#: What meshio calls the number of the first physical group of each element.
_TAGS: Final = "gmsh:physical"


@contextlib.contextmanager
def whole_groups() -> Iterator[None]:
    """While this lasts, meshio reads all physical groups, and what is of none.

    Groups are kept by dimension, number and name, ``"2 201 left"``: meshio keeps one group of each name. Entities of no
    group (``Mesh.SaveAll``) are of number 0: meshio refuses them else.
    """
    import meshio.gmsh._gmsh22 as second
    import meshio.gmsh._gmsh40 as fourth
    import meshio.gmsh._gmsh41 as module

    reading, naming = module._read_entities, module._read_physical_names

    def read_names(file: Any, found: dict[str, Any]) -> None:
        naming(file, _Keys(found))

    def read_entities(file: Any, text: bool, size: int) -> Any:
        tags, bounds = reading(file, text, size)
        _add_partitioned(file, text, size, tags, bounds)
        some = any(own for entities in tags for own in entities.values())
        return tuple({n: own or [0] * some for n, own in entities.items()} for entities in tags), bounds

    def put(entities: Callable[..., Any], names: Callable[..., Any]) -> None:
        vars(module)["_read_entities"] = entities
        for one in (second, fourth, module):
            vars(one)["_read_physical_names"] = names

    put(read_entities, read_names)
    try:
        yield
    finally:
        put(reading, naming)


def _add_partitioned(file: Any, text: bool, size: int, tags: Any, bounds: Any) -> None:
    """Add what ``$PartitionedEntities`` lists, where that section comes next; meshio knows the whole ones alone."""
    place = file.tell()
    while (line := file.readline()) and not line.strip():
        pass
    if line.strip() != b"$PartitionedEntities":
        file.seek(place)
        return

    def take(form: str, count: int) -> Any:
        return np.fromfile(file, form, int(count), sep=" " if text else "")

    long = f"u{size}"
    take(long, 1)  # partitions
    take("i", 2 * take(long, 1)[0])  # ghosts
    for dimension, count in enumerate(take(long, 4)):
        for _ in range(count):
            tag = take("i", 3)[0]  # with its parent
            take("i", take(long, 1)[0])  # partitions
            take("d", 3 if dimension == 0 else 6)
            tags[dimension][tag] = list(take("i", take(long, 1)[0]))
            if dimension:
                bounds[dimension][tag] = take("i", take(long, 1)[0])
    while (line := file.readline()) and line.strip() != b"$EndPartitionedEntities":
        pass


class _Keys(dict[str, Any]):
    """Where meshio puts the number and dimension of a name; they go where others of the name leave them."""

    def __init__(self, found: dict[str, Any]) -> None:
        self._found = found

    def __setitem__(self, name: str, value: Any) -> None:
        number, dimension = value
        self._found[f"{dimension} {number} {name}"] = value


def group_names(mesh: Any) -> dict[int, dict[int, str]]:
    """Names of the physical groups that :func:`whole_groups` left, by dimension and number.

    Groups of one dimension and one name stay apart by their numbers.
    """
    keys = [key.split(" ", 2) for key in mesh.field_data]
    times = Counter((dimension, name) for dimension, _, name in keys)
    found: dict[int, dict[int, str]] = {}
    for dimension, number, name in keys:
        written = name if times[dimension, name] == 1 or not name else f"{name}_{number}"
        found.setdefault(int(dimension), {})[int(number)] = written
    return found


def choose_groups(mesh: Any) -> list[Notice]:
    """Give each element of a ``meshio.Mesh`` the number of the physical group that names it, and say what that hides.

    meshio takes the first group of an entity. A number below 0 stands for the same group, turned over. Version 2 lists
    an element once for each of its groups; these become one.
    """
    told: list[Notice] = []
    if _TAGS not in mesh.cell_data:
        return told
    mesh.cell_data[_TAGS] = [np.abs(own) for own in mesh.cell_data[_TAGS]]
    _list_once(mesh)
    names = group_names(mesh)
    tags = mesh.cell_data[_TAGS]
    for dimension in (2, 3):
        here = [i for i, block in enumerate(mesh.cells) if block.dim == dimension]
        known = {key: int(entry[0]) for key, entry in mesh.field_data.items() if entry[1] == dimension}
        sizes = [len(mesh.cells[i].data) for i in here]
        starts = np.cumsum([0, *sizes])
        groups = [
            (key, np.concatenate([start + np.asarray(mesh.cell_sets[key][i], int) for i, start in zip(here, starts)]))
            for key in known
            if here and key in mesh.cell_sets
        ]
        shown = [(names[dimension][known[key]], own) for key, own in groups]
        chosen, said = naming_groups(shown, int(starts[-1]))
        told += said
        numbers = np.array([known[key] for key, _ in groups], dtype=np.int64)
        for i, own in zip(here, np.split(chosen, starts[1:-1])):
            tags[i][own >= 0] = numbers[own[own >= 0]]
    return told


def _list_once(mesh: Any) -> None:
    """Keep the first of elements that are listed again under another group, and note the groups of each."""
    kept, lists = [], {name: [np.empty(0, dtype=np.int64)] * len(mesh.cells) for name in mesh.field_data}
    for i, (block, tags) in enumerate(zip(mesh.cells, mesh.cell_data[_TAGS])):
        _, first, place = np.unique(block.data, axis=0, return_index=True, return_inverse=True)
        pairs = np.unique(np.column_stack([place.ravel(), tags]), axis=0)
        if len(pairs) < len(tags):  # listed again under the same group: whether that is meant is left to a check
            return
        kept.append(np.sort(first))
        rank = np.argsort(np.argsort(first))[place.ravel()]
        for name, (number, dimension) in mesh.field_data.items():
            if block.dim == dimension:
                lists[name][i] = np.unique(rank[tags == number])
    if all(len(own) == len(block.data) for own, block in zip(kept, mesh.cells)):
        return
    mesh.cell_sets = lists
    mesh.cell_data = {name: [a[own] for a, own in zip(arrays, kept)] for name, arrays in mesh.cell_data.items()}
    for own, block in zip(kept, mesh.cells):
        block.data = block.data[own]
