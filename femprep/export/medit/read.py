"""A ``.mesh`` file and the ``.sol`` files of ours beside it in; its mesh, with fibres, sheets and AHA segments, out."""

from __future__ import annotations

import re
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import FileError
from femprep.export.deck.units import units_of
from femprep.export.deck.unread import with_unread
from femprep.export.foreign import from_meshio
from femprep.export.medit.write import MEDIT_SECTIONS, OURS
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh
from femprep.model.notice import Notice, noted

#: What a file ends with.
_END: Final = re.compile(r"^\s*End\s*$", re.MULTILINE | re.IGNORECASE)
_AXES: Final = ("fiber", "sheet")


#: What comments of ours say at the top: a tag, and its name.
_NAME: Final = re.compile(r"^# (\d+) (\w+)$", re.MULTILINE)


def read(path: Path) -> VolumeMesh:
    """Read a mesh. A file of ours names its unit and its tags near its top; of anyone else's lengths stay as they are.

    Raises
    ------
    FileError
        The file is damaged, or one beside it does not fit.
    """
    file = _until_end(path)
    file.field_data.update(_names(path, file))
    mesh, scale = from_meshio(file), units_of(path).per_mm
    used = np.unique(np.asarray(file.point_data.get("medit:ref", []), dtype=np.int64))
    told = used[used != 0].tolist() if len(used) > 1 else ()  # one for all says nothing
    mesh = with_unread(mesh, "references of vertices", map(str, told))
    if scale != 1.0:
        mesh = replace(mesh, points=mesh.points / scale)
    return _with_end(path, mesh.with_data(cell=_solutions(path, mesh)))


def _until_end(path: Path) -> Any:
    """What meshio reads of a file up to its ``End``: it goes on behind that."""
    text = path.read_text("latin-1")
    end = _END.search(text)
    if end is None or not text[end.end() :].strip():
        return meshio_mesh(path)
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "mesh.mesh"
        whole.write_text(text[: end.end()] + "\n", "latin-1")
        return meshio_mesh(whole, path)


def _names(path: Path, file: Any) -> dict[str, np.ndarray]:
    """Tag and dimension of each name in comments of ours, which stand before the numbers."""
    head = path.read_text("latin-1").partition("\nDimension")[0]
    if OURS not in head:
        return {}
    tags = file.cell_data.get("medit:ref", [])
    regions = {tag for block, own in zip(file.cells, tags) if block.dim == 3 for tag in np.unique(own).tolist()}
    return {name: np.array([int(tag), 3 if int(tag) in regions else 2]) for tag, name in _NAME.findall(head)}


def _solutions(path: Path, mesh: VolumeMesh) -> dict[str, np.ndarray]:
    """Fibres, sheets and AHA segments of the ``.sol`` files of ours beside a ``.mesh`` file; none where there are none.

    Raises
    ------
    FileError
        A file does not fit the elements.
    """
    found: dict[str, np.ndarray] = {}
    for suffix in ("fiber", "aha"):
        file = path.with_suffix(f".{suffix}.sol")
        if file.is_file():
            parts = [_values(file, MEDIT_SECTIONS[kind], len(block)) for kind, block in mesh.cells.items()]
            values = np.concatenate(parts)
            if suffix == "aha":
                found["aha"] = values[:, 0].astype(np.int32)
            else:
                found.update(
                    {name: values[:, 3 * i : 3 * i + 3] for i, name in enumerate(_AXES[: values.shape[1] // 3])}
                )
    return found


def _values(file: Path, section: str, count: int) -> np.ndarray:
    """The numbers of one section of a ``.sol`` file, a row per element."""
    text = file.read_text(encoding="ascii").partition(f"\nSolAt{section}\n")[2]
    head, _, rest = text.partition("\n")
    kinds, _, rest = rest.partition("\n")
    sizes = [{1: 1, 2: 3, 3: 6}[int(kind)] for kind in kinds.split()[1:]]
    numbers = rest.split(None, count * sum(sizes))[: count * sum(sizes)]
    if not head.strip().isdigit() or int(head) != count or len(numbers) < count * sum(sizes):
        raise FileError(f"{str(file)!r} holds {head.strip() or 'no'} values for the {count} elements of {section}")
    return np.array(numbers, dtype=np.float64).reshape(count, -1)


def _with_end(path: Path, mesh: VolumeMesh) -> VolumeMesh:
    """The mesh of a text file, with a notice where that does not end as it should: a part of it may be lost."""
    if _END.search(path.read_text("latin-1")):
        return mesh
    words = "the file has no End, and was read to where it ends: whether it is cut short cannot be told"
    return replace(mesh, info=noted(mesh.info, Notice.of("assumed", words)))
