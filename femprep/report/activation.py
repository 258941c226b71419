"""A mesh with times of activation in, a picture of the map with the Purkinje fibres out, drawn in a child process.

VTK ends the whole process where it finds no way to render, so it is kept out of ours, as in
:mod:`femprep.report.pictures.mesh_picture`.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import InputError, cannot_write
from femprep.model import VolumeMesh
from femprep.report.pictures.mesh_picture import painted

#: Width and height of the picture, pixels; distance of the isochrones, ms.
_SIZE: Final = (1500, 800)
_STEP: Final = 10.0


def draw(mesh: VolumeMesh, png: Path) -> Path | None:
    """Draw the map on the epicardium, and on a cut with the fibres; ``None`` where VTK cannot render.

    Parameters
    ----------
    mesh : VolumeMesh
        With the point data ``activation``.
    png : Path

    Raises
    ------
    InputError
        It has no times of activation.
    FileError
        The picture cannot be written.
    """
    if "activation" not in mesh.point_data:
        raise InputError("the mesh has no point data activation to draw; add them (add_activation)")
    with tempfile.TemporaryDirectory(prefix="femprep-") as folder:
        mesh.to_pyvista().save(Path(folder) / "mesh.vtu")
        np.save(Path(folder) / "view.npy", _view(mesh))
        if mesh.purkinje is not None:
            from femprep.export import write_purkinje

            write_purkinje(mesh, Path(folder) / "purkinje.vtp")
        made = Path(folder) / "map.png"
        with painted("femprep.report.activation", made) as is_there:
            if not is_there():
                return None
        try:
            shutil.copyfile(made, png)
        except OSError as error:
            raise cannot_write(f"picture {str(png)!r}", error, "choose another name") from None
    return png


def _view(mesh: VolumeMesh) -> np.ndarray:
    """Up, and two directions to look along: at the front of the heart, and into its lateral half."""
    axes = mesh.info.get("axes")
    if axes:
        up = np.subtract(axes["base"], axes["apex"])
        up /= np.linalg.norm(up)
        front = np.cross(up, axes["septal"]) * (-1.0 if axes.get("mirrored") else 1.0)
    else:
        _, own = np.linalg.eigh(np.cov(mesh.points.T))
        up, front = own[:, 2], own[:, 0]
    return np.stack([up, front])


def _paint(picture: Path) -> None:
    """In the child process: the epicardium seen from the front, and the half behind a cut with the fibres."""
    import pyvista as pv

    folder = picture.parent
    mesh = pv.read(folder / "mesh.vtu")
    up, front = np.load(folder / "view.npy")
    times = np.asarray(mesh.point_data["activation"])
    reached = times >= 0
    middle = mesh.points.mean(axis=0)
    latest = float(times.max(initial=1.0))
    look: dict[str, Any] = {
        "scalars": "activation",
        "cmap": "viridis_r",
        "clim": (0.0, latest),
        "smooth_shading": False,
    }
    bar = {"title": "activation, ms", "color": "black", "fmt": "%.0f", "n_labels": 5, "position_x": 0.3, "width": 0.4}
    levels = np.arange(_STEP, latest, _STEP)
    plotter = pv.Plotter(shape=(1, 2), off_screen=True, window_size=list(_SIZE), border=False)
    wall = mesh.extract_points(np.flatnonzero(reached), adjacent_cells=False)
    for column, part in enumerate((wall, wall.clip(normal=front, origin=middle, crinkle=True))):
        plotter.subplot(0, column)
        plotter.set_background("white")
        skin = part.extract_surface(algorithm=None)
        plotter.add_mesh(skin, show_scalar_bar=column == 0, scalar_bar_args=bar, **look)
        lines = skin.contour(levels, scalars="activation") if len(levels) else None
        if lines is not None and lines.n_points:
            plotter.add_mesh(lines, color="white", line_width=1.5, show_scalar_bar=False)
        if column == 1 and (folder / "purkinje.vtp").is_file():
            net = pv.read(folder / "purkinje.vtp")
            plotter.add_mesh(net, color="black", line_width=2.0, show_scalar_bar=False)
            ends = net.points[np.asarray(net.point_data["GlobalNodeID"]) > 0]
            plotter.add_mesh(pv.PolyData(ends), color="red", point_size=5.0, render_points_as_spheres=True)
        reach = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
        plotter.camera_position = [middle + 1.7 * reach * (front + 0.35 * up), middle, up]
    plotter.screenshot(picture)


if __name__ == "__main__":
    _paint(Path(sys.argv[1]))
