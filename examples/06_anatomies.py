"""Left ventricle, both ventricles and whole heart, each with the blood in its cavities: phantoms' meshes, and pictures.

    python examples/06_anatomies.py [--edge 3] [--only lv biv whole-heart] [--pictures examples/pictures]

Each picture shows the surface by its tags, a cut through wall and blood by their regions, and the cut wall coloured by
the smallest dihedral angle of each element. The volumes of the blood stand beside the exact cavities'.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Final

import numpy as np

import femprep as fp
from femprep.model import is_blood, tag_name
from femprep.phantoms import biventricular, four_chambers, lv_ellipsoid

#: Phantom, its voxels in mm, and least thickness of its wall, mm, by anatomy.
HEARTS: Final = {
    "lv": (lv_ellipsoid, (1.4, 1.4, 8.0), 1.0),
    "biv": (biventricular, (1.4, 1.4, 8.0), 1.0),
    "whole-heart": (four_chambers, (2.0, 2.0, 2.0), 1.5),
}
#: Colours of facets and regions.
COLOURS: Final = {
    "epi": "#e8c4a0",
    "base": "#c9c9c9",
    "cap_lv": "#f2b5ad",
    "cap_rv": "#aecbe8",
    "lv": "#c0392b",
    "septum": "#8e5ba6",
    "rv": "#2f6fb5",
    "la": "#e08e3c",
    "ra": "#3c9e83",
    "blood_lv": "#f2b5ad",
    "blood_rv": "#aecbe8",
    "blood_la": "#f6d7b0",
    "blood_ra": "#b9e0d3",
}


def grid(mesh: fp.VolumeMesh, chosen: np.ndarray) -> Any:
    """Some of the elements as VTK has them, with their quality."""
    import pyvista as pv

    cells = mesh.cells["tetra"][chosen]
    rows = np.column_stack([np.full(len(cells), 4), cells]).ravel()
    out = pv.UnstructuredGrid(rows, np.full(len(cells), pv.CellType.TETRA), np.array(mesh.points))
    out["angle"] = np.array(mesh.cell_data["smallest_dihedral"])[chosen]
    return out


def draw(mesh: fp.VolumeMesh, across: np.ndarray, up: np.ndarray, picture: Path) -> None:
    """Surface, cut by region, cut by quality, side by side."""
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, shape=(1, 3), window_size=(1200, 455), border=False)
    centre = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
    middle = mesh.points[mesh.cells["tetra"]].mean(axis=1)
    kept = (middle - centre) @ across < 0.0
    blood = is_blood(mesh.region)
    edges = {"show_edges": True, "edge_color": "#444444", "line_width": 0.4, "edge_opacity": 0.45, "ambient": 0.45}
    for name, tag in mesh.facet_names.items():
        if name.startswith("endo"):
            continue
        facets = mesh.facets["triangle"][mesh.facet_tag == tag]
        rows = np.column_stack([np.full(len(facets), 3), facets]).ravel()
        plotter.add_mesh(pv.PolyData(np.array(mesh.points), rows), color=COLOURS[name], **edges)
    plotter.subplot(0, 1)
    for tag in np.unique(mesh.region):
        part = grid(mesh, kept & (mesh.region == tag))
        plotter.add_mesh(part, color=COLOURS[tag_name(int(tag))], **edges)
    plotter.subplot(0, 2)
    wall = grid(mesh, kept & ~blood)
    bar = {"title": "smallest dihedral angle, degrees\n", "n_labels": 4, "title_font_size": 16, "label_font_size": 14,
           "position_x": 0.15, "width": 0.7, "position_y": 0.0, "height": 0.07}  # fmt: skip
    plotter.add_mesh(wall, scalars="angle", cmap="viridis", clim=(10, 70), scalar_bar_args=bar, **edges)
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    for panel in range(3):
        plotter.subplot(0, panel)
        plotter.set_background("white")
        plotter.camera_position = [centre + 2.0 * size * (across + 0.35 * up), centre, up]
        plotter.camera.zoom(1.25)
    picture.parent.mkdir(parents=True, exist_ok=True)
    image = plotter.screenshot(return_img=True)
    plotter.close()
    save(image, picture)


def save(image: np.ndarray, picture: Path) -> None:
    """A small PNG: few colours are enough for plain surfaces."""
    from PIL import Image

    Image.fromarray(image).quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
        picture, optimize=True
    )


def main(
    edge: float = 3.0, only: tuple[str, ...] = tuple(HEARTS), pictures: Path | None = None, vertices: int = 1500
) -> dict[str, dict[str, Any]]:
    """Mesh the phantoms with their blood, say how the meshes compare with the exact hearts.

    Returns
    -------
    dict
        By anatomy: elements, regions in mL, exact cavities in mL, element quality, failures of the check.
    """
    found = {}
    for anatomy in only:
        make, spacing, least = HEARTS[anatomy]
        phantom = make()
        seg = phantom.segmentation(spacing=spacing)
        run = fp.mesh_segmentation(
            seg,
            anatomy=anatomy,
            blood_pool=True,
            surface={"vertices": vertices},
            wall={"minimum_thickness": least},
            volume={"edge_length": edge},
        )
        planes = run.wall.planes
        high = float(phantom.height(planes["base"].point[None])[0]) if planes else np.inf
        regions = {name: record.volume / 1000.0 for name, record in run.quality.regions.items()}
        measures = run.quality.measures
        figures = {
            "tetrahedra": run.mesh.n_cells,
            **{f"{name}_ml": value for name, value in regions.items()},
            **{
                f"exact_{name}_ml": phantom.volume(name.removeprefix("blood_"), high=high) / 1000.0
                for name in regions
                if name.startswith("blood_")
            },
            "smallest_dihedral": measures["minimum_dihedral"].min,
            "median_dihedral": measures["minimum_dihedral"].median,
            "mean_ratio": measures["mean_ratio"].mean,
            "interface_facets": run.quality.validity.interface_facets,
            "failures": "; ".join(run.quality.failures) or "none",
        }
        print(f"\n{anatomy}")
        for name, value in figures.items():
            print(f"  {name:24s} {value:.4g}" if isinstance(value, float) else f"  {name:24s} {value}")
        found[anatomy] = figures
        if pictures is not None:
            angles = smallest_angles(run.mesh)
            mesh = run.mesh.with_data(cell={"smallest_dihedral": angles})
            draw(mesh, np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0]), pictures / f"anatomy-{anatomy}.png")
    return found


def smallest_angles(mesh: fp.VolumeMesh) -> np.ndarray:
    """Smallest dihedral angle of each tetrahedron, degrees."""
    from femprep.mesh.measures.volume_elements import element_measures

    return element_measures(mesh.points, mesh.cells["tetra"], "tetra")["minimum_dihedral"]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edge", type=float, default=3.0)
    parser.add_argument("--only", nargs="+", choices=tuple(HEARTS), default=tuple(HEARTS))
    parser.add_argument("--pictures", type=Path)
    given = parser.parse_args()
    main(given.edge, tuple(given.only), given.pictures)
