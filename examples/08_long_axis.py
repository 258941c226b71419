"""Displaced short-axis slices and three long-axis views of a phantom: shifts, surfaces against the truth, a picture.

    python examples/08_long_axis.py [--seed 1] [--pictures examples/pictures]

The picture shows the plane of the four-chamber view: what the view itself shows (grey tones), what the short-axis
slices show where they cross it (bars), and where the fitted surfaces cross it (lines). On the left as scanned, in the
middle with slices and views moved back, on the right with the surfaces fitted to both.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

import femprep as fp
from femprep.image import Grid
from femprep.phantoms import four_chambers

#: Angle of each view about the long axis, degrees, from the direction of the right ventricle.
VIEWS: Final = {"4ch": 0.0, "2ch": 60.0, "3ch": 120.0}
COLOURS: Final = {"lv": "#c0392b", "epi": "#7a4a2b", "rv": "#2f6fb5"}
OBJECTS: Final = {"lv": ("lv",), "epi": ("lv", "myo"), "rv": ("rv",)}


def scan(seed: int) -> tuple[fp.Segmentation, np.ndarray]:
    """A stack whose slices are displaced by 3 mm rms, with three views displaced by 2 mm rms; and the shifts."""
    rng = np.random.default_rng(seed)
    heart = four_chambers()
    count = heart.grid((1.4, 1.4, 8.0)).shape[2]
    shifts = rng.normal(scale=3.0 / np.sqrt(2.0), size=(count, 2))
    stack = heart.segmentation((1.4, 1.4, 8.0), shifts=shifts)
    middle = stack.grid.to_world(0.5 * (np.array(stack.grid.shape) - 1.0))
    views = []
    for name, angle in VIEWS.items():
        across = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
        direction = np.column_stack([across, [0.0, 0.0, 1.0], np.cross(across, [0.0, 0.0, 1.0])])
        start = middle - 105.0 * (direction[:, 0] + direction[:, 1])
        labels = heart.segmentation(grid=Grid((151, 151, 1), [1.4, 1.4, 6.0], start, direction), supersample=3).labels
        moved = start + direction[:, :2] @ rng.normal(scale=2.0 / np.sqrt(2.0), size=2)
        views.append(fp.PlaneView(name, labels[:, :, 0], stack.structures, moved, direction[:, :2], [1.4, 1.4], 6.0))
    return stack.with_views(*views), shifts


def surfaces(seg: fp.Segmentation) -> dict[str, fp.Surface]:
    """A surface for each object."""
    return {name: fp.fit_surface(seg.object(*parts, name=name), vertices=1500) for name, parts in OBJECTS.items()}


def error(name: str, surface: fp.Surface) -> float:
    """Mean distance of a surface's vertices from the phantom's, mm."""
    return float(np.abs(four_chambers().distance(name, surface.points)).mean())


def draw(axes: Any, seg: fp.Segmentation, made: dict[str, fp.Surface] | None = None) -> None:
    """The plane of the first view: the view's labels, the stack's where slices cross it, the surfaces' cuts."""
    view = seg.views[0]
    axes.set_aspect("equal")
    axes.axis("off")
    shade = np.zeros(view.labels.shape)
    for value, name in ((0.16, "myo"), (0.32, "lv"), (0.32, "rv"), (0.08, "la"), (0.08, "ra")):
        shade[view.mask(name)] = value
    width, height = np.array(view.labels.shape) * view.spacing
    axes.imshow(shade.T, origin="lower", cmap="Greys", vmin=0, vmax=1, extent=(0.0, width, 0.0, height))
    steps = np.arange(0.0, width, 0.25)
    for k in range(seg.grid.shape[seg.stack_axis]):
        level = seg.grid.to_world([0, 0, k])[2] - view.origin[2]
        points = view.origin + np.column_stack([steps, np.full_like(steps, level)]) @ view.axes.T
        index = seg.grid.to_index(points)
        index[:, seg.stack_axis] = k
        found = seg.grid.values_at(seg.labels, index)
        for name in ("lv", "rv"):
            on = np.isin(found, seg.structures[name])
            axes.scatter(steps[on], np.full(on.sum(), level), s=1.5, color=COLOURS[name])
    for name, surface in (made or {}).items():
        for ring in cuts(surface, view):
            axes.plot(*ring.T, color=COLOURS[name], linewidth=1.4)
    shown = np.argwhere(view.labels > 0) * view.spacing
    axes.set_xlim(shown[:, 0].min() - 6.0, shown[:, 0].max() + 6.0)
    axes.set_ylim(shown[:, 1].min() - 6.0, shown[:, 1].max() + 6.0)


def cuts(surface: fp.Surface, view: fp.PlaneView) -> list[np.ndarray]:
    """Lines in which a surface crosses the plane of a view, in the view's mm."""
    import pyvista as pv

    body = pv.PolyData.from_regular_faces(np.array(surface.points), np.array(surface.triangles))
    lines = body.slice(normal=view.normal, origin=view.origin).strip(join=True)
    return [(np.array(cell.points) - view.origin) @ view.axes for cell in lines.cell]


def run(seed: int, pictures: Path | None = None) -> dict[str, dict[str, float]]:
    """Align and fit, print the errors and return them, draw."""
    seg, true = scan(seed)
    shifts = fp.estimate_shifts(seg)
    aligned = fp.align_slices(seg, shifts)
    left = shifts.shift - true[shifts.index]
    before = true[shifts.index] - true[shifts.index].mean(axis=0)
    rms = [float(np.sqrt((x**2).sum(axis=1).mean())) for x in (before, left - left.mean(axis=0))]
    print(f"shifts {rms[0]:.2f} mm rms; after alignment {rms[1]:.2f} mm, expected {shifts.expected:.2f} mm")
    made = {"as scanned": surfaces(replace(seg, views=())), "aligned": surfaces(aligned)}
    errors = {key: {name: error(name, one) for name, one in found.items()} for key, found in made.items()}
    for key, found in errors.items():
        print(f"{key}: " + ", ".join(f"{name} {value:.2f} mm" for name, value in found.items()))
    if pictures is not None:
        picture(seg, aligned, made["aligned"], pictures)
    return errors


def picture(seg: fp.Segmentation, aligned: fp.Segmentation, made: dict[str, fp.Surface], folder: Path) -> None:
    """Three panels: as scanned, moved back, with surfaces."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 3, figsize=(12, 4.3))
    titles = ("as scanned", "slices and views moved back", "surfaces fitted to both")
    for axes, title, heart, fitted in zip(panels, titles, (seg, aligned, aligned), (None, None, made)):
        draw(axes, heart, fitted)
        axes.set_title(title)
    figure.tight_layout()
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "long-axis.png", dpi=80)


def main() -> None:
    """Read the arguments, run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--pictures", type=Path)
    args = parser.parse_args()
    run(args.seed, args.pictures)


if __name__ == "__main__":
    main()
