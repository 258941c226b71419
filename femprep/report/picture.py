"""A picture of a mesh and of a cut through it, drawn by VTK off screen in a child process.

VTK ends the whole process where it finds no way to render, so it is kept out of ours: where it fails there is no
picture, and the page says so.
"""

from __future__ import annotations

import base64
import logging
import subprocess
import sys
from pathlib import Path

logger = logging.getLogger(__name__)

#: A rendering that takes longer is given up, s.
TIME_LIMIT = 60.0


def start_picture(mesh: Path, facets: Path, png: Path) -> subprocess.Popen[bytes]:
    """Start drawing the mesh of two files of the output folder into a PNG file."""
    command = [sys.executable, "-m", "femprep.report.picture", str(mesh), str(facets), str(png)]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def finish_picture(child: subprocess.Popen[bytes], png: Path) -> str | None:
    """Wait for a picture; a ``data:`` address of it, or None where it could not be drawn."""
    try:
        child.wait(timeout=TIME_LIMIT)
    except subprocess.TimeoutExpired:
        logger.warning("no picture: rendering took more than %g s", TIME_LIMIT)
    except BaseException:
        child.kill()
        child.wait()
        raise
    child.kill()
    child.wait()
    if child.returncode != 0 or not png.is_file():
        logger.warning("no picture: VTK could not render off screen (exit status %s)", child.returncode)
        return None
    return "data:image/png;base64," + base64.b64encode(png.read_bytes()).decode("ascii")


def draw(mesh_path: str, facets_path: str, png_path: str) -> None:
    """Draw the tagged surface, and beside it the elements behind a cut along the long axis."""
    import numpy as np
    import pyvista as pv

    mesh, facets = pv.read(mesh_path), pv.read(facets_path)
    tags = facets.cell_data["facet_tag"]
    _, _, axes = np.linalg.svd(mesh.points - mesh.points.mean(axis=0), full_matrices=False)
    up, across = axes[0], axes[1]
    if "base" in facets.field_data:
        base = facets.extract_cells(tags == int(facets.field_data["base"][0]))
        up = base.center - mesh.points.mean(axis=0)
        up /= np.linalg.norm(up)
        across = np.cross(up, axes[2])
        across /= np.linalg.norm(across)
    view = np.cross(up, across)
    centre = np.asarray(mesh.center)
    half = mesh.extract_cells(np.flatnonzero((mesh.cell_centers().points - centre) @ view < 0.0))
    plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=(1200, 600), border=False)
    camera = [centre + 3.0 * mesh.length * 0.62 * (view + 0.45 * up), centre, up]
    edges = {"show_edges": True, "line_width": 0.4, "edge_color": "#444444"}
    plotter.subplot(0, 0)
    plotter.add_mesh(facets, scalars="facet_tag", cmap="Set2", ambient=0.35, **edges, show_scalar_bar=False)
    plotter.camera_position = camera
    plotter.subplot(0, 1)
    plotter.add_mesh(half, color="#e0a096", ambient=0.35, **edges)
    plotter.camera_position = camera
    plotter.screenshot(png_path)


if __name__ == "__main__":
    draw(*sys.argv[1:4])
