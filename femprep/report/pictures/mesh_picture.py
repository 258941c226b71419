"""A picture of a mesh and of a cut through it, drawn by VTK off screen in a child process.

VTK ends the whole process where it finds no way to render, so it is kept out of ours: where it fails there is no
picture, and the page says so. It draws while its parent writes files.
"""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import DiskFullError, cannot_write
from femprep.mesh.elements import ELEMENTS, FACET_CORNERS, boundary_faces
from femprep.mesh.numbering import set_numbers
from femprep.model import FACET_TAGS, FloatArray, IntArray, VolumeMesh, tag_name
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.report.pictures.colours import colour

logger = logging.getLogger(__name__)

#: A rendering that takes longer is given up, s.
TIME_LIMIT = 60.0

#: Exit status of the child where no room is left for the picture.
_NO_ROOM: Final = 75
#: Width and height of the picture, pixels; colours of the cut and of edges.
_SIZE: Final = (1200, 600)
_CUT_COLOUR: Final = (0.88, 0.63, 0.59)
_EDGE_COLOUR: Final = (0.27, 0.27, 0.27)


def draw_picture(mesh: VolumeMesh, png: Path) -> bool:
    """Draw a mesh into a PNG file; whether that could be done."""
    with drawn_picture(mesh, png) as is_there:
        return is_there()


@contextmanager
def drawn_picture(mesh: VolumeMesh, png: Path) -> Iterator[Callable[[], bool]]:
    """Let a process of its own draw a mesh into a PNG file, as :func:`painted` does; beside it lies what it needs."""
    given = png.with_suffix(".npz")
    np.savez(given, **_scene(mesh))
    try:
        with painted("femprep.report.pictures.mesh_picture", png) as is_there:
            yield is_there
    finally:
        given.unlink(missing_ok=True)


@contextmanager
def painted(module: str, png: Path) -> Iterator[Callable[[], bool]]:
    """A process that draws as a module does when it is run, ended with the block; what waits for the picture."""
    nothing = subprocess.DEVNULL
    command = [sys.executable, "-m", module, str(png)]
    painter = subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing)
    try:
        yield lambda: _is_there(painter, png)
    finally:
        painter.kill()
        painter.wait()


def _is_there(painter: subprocess.Popen[bytes], png: Path) -> bool:
    """Wait for a picture; whether it is there.

    Raises
    ------
    DiskFullError
        There is no room for it.
    """
    try:
        painter.wait(TIME_LIMIT)
    except subprocess.TimeoutExpired:
        logger.warning("no picture: rendering took more than %g s", TIME_LIMIT)
        return False
    if painter.returncode == _NO_ROOM:
        raise DiskFullError(f"no room is left for the picture {str(png)!r}; free some space")
    if painter.returncode != 0 or not png.is_file():
        logger.warning("no picture: VTK could not render off screen (exit status %s)", painter.returncode)
        return False
    return True


def _scene(mesh: VolumeMesh) -> dict[str, Any]:
    """Arrays of the picture: tagged facets, the boundary of the elements behind a cut along the long axis, a view."""
    _, axes = np.linalg.eigh(np.cov(mesh.points.T))
    up, across, third = axes[:, 2], axes[:, 1], axes[:, 0]
    corners = {kind: block[:, : FACET_CORNERS[kind]] for kind, block in mesh.facets.items()}
    facets = [*corners.values()]
    nodes = nodes_of(chosen_rows(corners, mesh.facet_tag == FACET_TAGS["base"]))
    if len(nodes):
        up = mesh.points[nodes].mean(axis=0) - mesh.points.mean(axis=0)
        up /= np.linalg.norm(up)
        across = np.cross(up, third)
        across /= np.linalg.norm(across)
    view = np.cross(up, across)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    centre = 0.5 * (low + high)
    side = (mesh.points - centre) @ view
    cut = [*_cut(mesh, side), *(block[(side[block] < 0.0).any(axis=1)] for block in facets)]
    eye = centre + 2.5 * 0.62 * float(np.linalg.norm(high - low)) * (view + 0.45 * up)
    parts = {"facets": facets, "cut": cut}
    arrays = {f"{name}_{key}": value for name, part in parts.items() for key, value in _polygons(mesh.points, part)}
    return {**arrays, "tag": mesh.facet_tag, "camera": np.stack([eye, centre, up])}


def _cut(mesh: VolumeMesh, side: FloatArray) -> list[np.ndarray]:
    """Faces between the elements whose middle lies on the negative side of a plane and the others."""
    behind, near = {}, {}
    for kind, block in mesh.cells.items():
        corners = block[:, : ELEMENTS[kind].corners]
        # Only elements near the plane have such faces: few, quickly matched. Corner by corner, as rows are short.
        own = [side[column] for column in corners.T]
        span = np.max(own, axis=0) - np.min(own, axis=0)
        reached = np.min(np.abs(own), axis=0) <= span
        near[kind] = block[reached]
        behind[kind] = near[kind][side[corners[reached]].mean(axis=1) < 0.0]
    inside = boundary_faces(near)
    found = []
    for kind, faces in boundary_faces(behind).items():
        rings = faces.nodes[:, : FACET_CORNERS[kind]]
        ends = inside[kind].nodes[:, : FACET_CORNERS[kind]]
        number = set_numbers(rings, ends)
        found.append(rings[~np.isin(number[: len(rings)], number[len(rings) :])])
    return found


def _polygons(points: FloatArray, blocks: list[np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    """Points in use and, as VTK lists them, polygons: the number of corners before the corners of each."""
    used = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *(block.ravel() for block in blocks)]))
    number = np.zeros(len(points), dtype=np.int64)
    number[used] = np.arange(len(used))
    listed = [np.insert(number[block], 0, block.shape[1], axis=1).ravel() for block in blocks]
    yield "points", points[used]
    yield "polygons", np.concatenate([np.empty(0, dtype=np.int64), *listed])


def main() -> None:
    """In the process that draws: the surface of a mesh and its cut half, from the file beside the picture to make."""
    png = Path(sys.argv[1])
    with np.load(png.with_suffix(".npz")) as arrays:
        facets = _polydata(arrays["facets_points"], arrays["facets_polygons"], arrays["tag"])
        cut = _polydata(arrays["cut_points"], arrays["cut_polygons"])
        camera = arrays["camera"].tolist()
    try:
        _draw((facets, cut), camera, png)
    except OSError as error:
        os._exit(_NO_ROOM if isinstance(cannot_write(str(png), error, ""), DiskFullError) else 1)
    os._exit(0)  # the picture is there: VTK and Python would take half as long again to clear up


def _polydata(points: FloatArray, polygons: IntArray, tag: IntArray | None = None) -> Any:
    """VTK polygons, coloured by their tags where there are any."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    places, cells, mesh = vtkPoints(), vtkCellArray(), vtkPolyData()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(np.ascontiguousarray(polygons, dtype=np.int64), deep=True))
    mesh.SetPoints(places)
    mesh.SetPolys(cells)
    if tag is not None:
        tags, rank = np.unique(tag, return_inverse=True)
        shades = [bytes.fromhex(colour(tag_name(number)).removeprefix("#")) for number in tags]
        colours = np.array([list(shade) for shade in shades], dtype=np.uint8)[rank.ravel()]
        mesh.GetCellData().SetScalars(numpy_to_vtk(colours, deep=True))
    return mesh


def _draw(meshes: tuple[Any, Any], camera: list[Any], png: Path) -> None:
    """Draw two surfaces side by side into a file."""
    # The parts of VTK that are needed and no others: all of it takes a second longer to load.
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOImage import vtkPNGWriter
    from vtkmodules.vtkRenderingCore import (
        vtkActor,
        vtkLightKit,
        vtkPolyDataMapper,
        vtkRenderer,
        vtkRenderWindow,
        vtkWindowToImageFilter,
    )

    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetSize(*_SIZE)
    for number, mesh in enumerate(meshes):
        mapper, actor, renderer, lights = vtkPolyDataMapper(), vtkActor(), vtkRenderer(), vtkLightKit()
        mapper.SetInputData(mesh)
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetColor(*_CUT_COLOUR)
        look.SetAmbient(0.35)
        look.SetInterpolationToFlat()
        look.SetEdgeVisibility(True)
        look.SetEdgeColor(*_EDGE_COLOUR)
        look.SetLineWidth(0.4)
        renderer.SetBackground(1.0, 1.0, 1.0)
        renderer.SetViewport(0.5 * number, 0.0, 0.5 * number + 0.5, 1.0)
        renderer.AddActor(actor)
        lights.AddLightsToRenderer(renderer)
        view = renderer.GetActiveCamera()
        view.SetPosition(*camera[0])
        view.SetFocalPoint(*camera[1])
        view.SetViewUp(*camera[2])
        renderer.ResetCameraClippingRange()
        window.AddRenderer(renderer)
    window.Render()
    shot, writer = vtkWindowToImageFilter(), vtkPNGWriter()
    shot.SetInput(window)
    shot.ShouldRerenderOff()  # it is drawn already
    shot.ReadFrontBufferOff()
    writer.SetCompressionLevel(1)  # of edges and flat colours smaller than by higher levels, and quicker
    writer.SetInputConnection(shot.GetOutputPort())
    writer.WriteToMemoryOn()  # on a full disk its own writing may end the process
    writer.Write()
    png.write_bytes(vtk_to_numpy(writer.GetResult()).tobytes())
    window.Finalize()


if __name__ == "__main__":
    main()
