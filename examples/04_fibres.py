"""Fibres of a left ventricle as streamlines coloured by helix angle, and its wall thickness as a bull's eye.

    python examples/04_fibres.py [--edge 3] [--picture examples/pictures/fibres.png]

The phantom has a right ventricle beside the left one, so that its label map tells where the septum lies. Its surfaces
are known exactly, and with them its thickness and its helix angles, which the figures are compared with.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import femprep as fp
from femprep.anatomy import bulls_eye, segment_means
from femprep.anatomy.fibres import helix_angle
from femprep.phantoms import biventricular

ENDO_ANGLE, EPI_ANGLE = 60.0, -60.0


def streamlines(mesh: fp.VolumeMesh, angle: np.ndarray, count: int) -> Any:
    """Lines along the fibres through places spread over the wall, with the helix angle on them."""
    import pyvista as pv

    cells = np.column_stack([np.full(mesh.n_cells, 4), mesh.cells["tetra"]]).ravel()
    grid = pv.UnstructuredGrid(cells, np.full(mesh.n_cells, pv.CellType.TETRA), np.array(mesh.points))
    grid["fiber"] = np.array(mesh.point_data["fiber"])
    grid["helix angle, degrees"] = angle
    # Within elements, not at nodes: a line from a node of the surface often leaves the wall at once.
    random = np.random.default_rng(0)
    chosen = mesh.points[mesh.cells["tetra"][random.integers(mesh.n_cells, size=count)]]
    seeds = np.einsum("ij,ijk->ik", random.dirichlet(np.ones(4), count), chosen)
    return grid.streamlines_from_source(
        pv.PolyData(seeds),
        vectors="fiber",
        integration_direction="both",
        max_length=60.0,
        initial_step_length=0.5,
        max_step_length=0.5,
        step_unit="l",
        compute_vorticity=False,
    )


def draw(mesh: fp.VolumeMesh, axes: fp.VentricularAxes, angle: np.ndarray, values: np.ndarray, picture: Path) -> None:
    """Streamlines on the left, the bull's eye of the thickness on the right."""
    import matplotlib as mpl
    import pyvista as pv

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    plotter = pv.Plotter(off_screen=True, window_size=(1200, 1200))
    tubes = streamlines(mesh, angle, 1500).tube(radius=0.35)
    plotter.add_mesh(tubes, scalars="helix angle, degrees", cmap="coolwarm", clim=(EPI_ANGLE, ENDO_ANGLE),
                     ambient=0.3, show_scalar_bar=False)  # fmt: skip
    up, centre = axes.long_axis, mesh.points.mean(axis=0)
    side = axes.anterior - axes.septal
    view = side / np.linalg.norm(side) + 0.65 * up
    plotter.camera_position = [centre + 180.0 * view, centre - 4.0 * up, up]
    image = plotter.screenshot(return_img=True)
    plotter.close()
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5.6), width_ratios=(1.1, 1.0), layout="constrained")
    left.imshow(image)
    left.set_axis_off()
    colours = mpl.cm.ScalarMappable(mpl.colors.Normalize(EPI_ANGLE, ENDO_ANGLE), "coolwarm")
    figure.colorbar(colours, ax=left, label="helix angle, degrees", shrink=0.7)
    bulls_eye(values, mesh, ax=right, label="wall thickness, mm", text="{:.1f}")
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=100)
    plt.close(figure)


def main(edge: float = 3.0, picture: Path | None = None) -> dict[str, Any]:
    """Mesh the phantom with fibres, measure, compare with the exact heart.

    Returns
    -------
    dict
        Tetrahedra; empty AHA segments; helix angles at endo- and epicardium by the straight line through those of the
        elements, degrees, and their correlation with depth; mean errors of angle and thickness against the exact heart;
        thickness of the 17 segments, mm.
    """
    phantom = biventricular()
    seg = phantom.segmentation(spacing=(1.4, 1.4, 8.0))
    fibres = {"endo_angle": ENDO_ANGLE, "epi_angle": EPI_ANGLE, "nodes": True}
    mesh = fp.mesh_segmentation(seg, volume={"edge_length": edge}, fibres=fibres).mesh
    axes = fp.ventricular_axes(mesh)

    def angles(data: Any) -> np.ndarray:
        # The sheet runs straight through the wall where its angle is 0: outward.
        return helix_angle(data["fiber"], np.tile(axes.long_axis, (len(data["fiber"]), 1)), data["sheet"])

    centre = mesh.points[mesh.cells["tetra"]].mean(axis=1)
    depth, angle = np.asarray(mesh.cell_data["transmural"]), angles(mesh.cell_data)
    found = fp.wall_thickness(mesh)
    inner, outer = (np.abs(phantom.distance(name, centre)) for name in ("lv", "epi"))
    # Beyond the end of the cavity, and at the rim, nearest points are not across the wall; the ring between tells.
    height = axes.height(centre) / axes.length
    ring = (height > 0.3) & (height < 0.9)
    wanted = ENDO_ANGLE + (EPI_ANGLE - ENDO_ANGLE) * inner / (inner + outer)
    line = np.polynomial.Polynomial.fit(depth[ring], angle[ring], 1)
    figures = {
        "tetrahedra": mesh.n_cells,
        "empty_segments": mesh.info["aha"]["empty"],
        "endo_angle_degrees": float(line(0.0)),
        "epi_angle_degrees": float(line(1.0)),
        "depth_angle_correlation": mesh.info["fibres"]["depth_angle_correlation"]["lv"],
        "angle_error_degrees": float(np.abs(angle - wanted)[ring].mean()),
        "thickness_error_mm": float(np.abs(found - inner - outer)[ring].mean()),
        "thickness_mm": [round(float(value), 2) for value in segment_means(mesh, found)],
    }
    if picture is not None:
        draw(mesh, axes, angles(mesh.point_data), found, picture)
    for name, value in figures.items():
        print(f"{name:24s} {value:.4g}" if isinstance(value, float) else f"{name:24s} {value}")
    return figures


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edge", type=float, default=3.0, help="edge length, mm")
    parser.add_argument("--picture", type=Path)
    given = parser.parse_args()
    main(given.edge, given.picture)
