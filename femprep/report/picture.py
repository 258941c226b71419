"""A picture of a mesh and of a cut through it, drawn by VTK off screen in a child process.

VTK ends the whole process where it finds no way to render, so it is kept out of ours: where it fails there is no
picture, and the page says so. The child loads VTK and draws something small at once, and then waits for what it is to
draw, so that it can be started long before.
"""

from __future__ import annotations

import base64
import logging
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from femprep.elements import ELEMENTS, FACET_CORNERS, boundary_faces, set_numbers
from femprep.model import FACET_TAGS, FloatArray, VolumeMesh

logger = logging.getLogger(__name__)

#: A rendering that takes longer is given up, s.
TIME_LIMIT = 60.0


def start_painter() -> subprocess.Popen[bytes]:
    """Start the process that will draw. It ends when this process does, which closes the pipe it waits at."""
    command = [sys.executable, "-m", "femprep.report.picture"]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def start_picture(painter: subprocess.Popen[bytes], mesh: VolumeMesh, png: Path) -> None:
    """Let a painter draw a mesh into a PNG file; what it needs goes into a file beside it."""
    scene = png.with_suffix(".npz")
    np.savez(scene, **_scene(mesh))
    if painter.stdin is not None:
        try:
            painter.stdin.write(f"{scene}\n{png}\n".encode())
            painter.stdin.close()
        except OSError:
            logger.debug("the process that draws has ended already")


def end_painter(painter: subprocess.Popen[bytes]) -> None:
    """End a painter, whatever it is doing."""
    painter.kill()
    painter.wait()
    if painter.stdin is not None:
        try:
            painter.stdin.close()
        except OSError:
            logger.debug("the process that draws has ended already")


def finish_picture(painter: subprocess.Popen[bytes], png: Path) -> str | None:
    """Wait for a picture; a ``data:`` address of it, or None where it could not be drawn."""
    try:
        painter.wait(timeout=TIME_LIMIT)
    except subprocess.TimeoutExpired:
        logger.warning("no picture: rendering took more than %g s", TIME_LIMIT)
    finally:
        end_painter(painter)
    if painter.returncode != 0 or not png.is_file():
        logger.warning("no picture: VTK could not render off screen (exit status %s)", painter.returncode)
        return None
    return "data:image/png;base64," + base64.b64encode(png.read_bytes()).decode("ascii")


def _scene(mesh: VolumeMesh) -> dict[str, Any]:
    """Arrays of the picture: tagged facets, the boundary of the elements behind a cut along the long axis, a view."""
    _, axes = np.linalg.eigh(np.cov(mesh.points.T))
    up, across, third = axes[:, 2], axes[:, 1], axes[:, 0]
    facets = [block[:, : FACET_CORNERS[kind]] for kind, block in mesh.facets.items()]
    tags = np.split(mesh.facet_tag, np.cumsum([len(block) for block in facets])[:-1])
    base = [block[tag == FACET_TAGS["base"]].ravel() for block, tag in zip(facets, tags)]
    nodes = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *base]))
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
    eye = centre + 3.0 * 0.62 * float(np.linalg.norm(high - low)) * (view + 0.45 * up)
    parts = {"facets": facets, "cut": cut}
    arrays = {f"{name}_{key}": value for name, part in parts.items() for key, value in _polygons(mesh.points, part)}
    return {**arrays, "tag": mesh.facet_tag, "camera": np.stack([eye, centre, up])}


def _cut(mesh: VolumeMesh, side: FloatArray) -> list[np.ndarray]:
    """Faces between the elements whose middle lies on the negative side of a plane and the others."""
    behind, near = {}, {}
    for kind, block in mesh.cells.items():
        own = side[block[:, : ELEMENTS[kind].corners]]
        # Only elements near the plane have such faces: few, quickly matched.
        reached = np.abs(own).min(axis=1) <= np.ptp(own, axis=1)
        near[kind] = block[reached]
        behind[kind] = near[kind][own[reached].mean(axis=1) < 0.0]
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
    """Load VTK, practise on a tetrahedron, wait for two lines that name the scene and the picture, and draw."""
    import pyvista as pv

    # The first picture compiles VTK's shaders, which takes longer than to draw any other.
    practice = pv.PolyData(np.eye(4, 3), np.array([(3, *face) for face in ELEMENTS["tetra"].faces]).ravel())
    practice.cell_data["facet_tag"] = np.arange(4)
    _draw(practice, practice, [(9.0, 9.0, 9.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)], None)
    scene, png = (sys.stdin.readline().rstrip("\n") for _ in range(2))
    if not png:
        return
    with np.load(scene) as arrays:
        facets = pv.PolyData(arrays["facets_points"], arrays["facets_polygons"])
        facets.cell_data["facet_tag"] = arrays["tag"]
        cut = pv.PolyData(arrays["cut_points"], arrays["cut_polygons"])
        camera = arrays["camera"].tolist()
    _draw(facets, cut, camera, Path(png))


def _draw(facets: Any, cut: Any, camera: list[Any], png: Path | None) -> None:
    """Draw two surfaces side by side, the first coloured by its tags, into a file or for nothing."""
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=(1200, 600), border=False)
    edges = {"show_edges": True, "line_width": 0.4, "edge_color": "#444444"}
    plotter.subplot(0, 0)
    plotter.add_mesh(facets, scalars="facet_tag", cmap="Set2", ambient=0.35, **edges, show_scalar_bar=False)
    plotter.camera_position = camera
    plotter.subplot(0, 1)
    plotter.add_mesh(cut, color="#e0a096", ambient=0.35, **edges)
    plotter.camera_position = camera
    plotter.screenshot(png)
    plotter.close()


if __name__ == "__main__":
    main()
