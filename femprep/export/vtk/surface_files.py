"""VTK polygons or lines in, a file of the kind that its ending names out."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from femprep.errors import OptionError
from femprep.export.vtk.xml import save

#: Formats of triangles, which hold no data.
_TRIANGLES: Final = (".stl", ".ply", ".obj", ".off")
#: Data that number points and elements, or place them on a template: nobody misses them in a file of triangles.
_NUMBERING: Final = frozenset({"direction", "template", "GlobalNodeID", "GlobalElementID"})


def save_polydata(data: Any, path: Path) -> list[str]:
    """Write polygons or lines; return the names of the data that the file does not hold.

    Raises
    ------
    OptionError
        The ending is of no format that holds them.
    """
    ending = path.suffix.lower()
    if ending == ".vtp":
        save(data, path)
        return []
    endings = () if data.GetNumberOfLines() else _TRIANGLES
    if ending not in endings:
        raise OptionError(f"{path.name!r}: unknown ending {ending!r}; expected one of {', '.join(('.vtp', *endings))}")
    import pyvista
    import trimesh

    shown = pyvista.wrap(data)
    cut = shown.triangulate()
    content = trimesh.Trimesh(cut.points, cut.regular_faces, process=False).export(file_type=ending[1:])
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return [name for name in (*shown.cell_data.keys(), *shown.point_data.keys()) if name not in _NUMBERING]
