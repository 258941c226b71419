"""The four-chamber view that surfaces from displaced short-axis slices imply, against the true one.

    python tests/benchmarks/bench_four_chamber.py                    phantom, and Rodero 01 where FEMPREP_DATA is set
    python tests/benchmarks/bench_four_chamber.py --hearts rodero --seeds 0 1

Hearts are sliced and displaced as in bench_long_axis.py. Surfaces fitted to the stack are cut by the plane of the
four-chamber view, and the cavities and the left ventricle with its wall compared there with the heart itself: Dice
overlap and Hausdorff distance, mm. Variants: the stack as it is (as-is), corrected from itself (stack), and with the
two- and three-chamber views, which leaves the four-chamber view as a test (views). For the right ventricle, as
short-axis segmentations of real scans imply it, arXiv 2602.11436 reports .91 and 6.2 mm.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
import pyvista as pv
from bench_long_axis import Heart, hearts, scan, surfaces
from scipy.spatial.distance import directed_hausdorff
from vtkmodules.vtkFiltersModeling import vtkSelectEnclosedPoints

from femprep.image import PlaneView
from femprep.image.views import mask_edges
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.surface.alignment import align_slices

VARIANTS = ("as-is", "stack", "views")


def inside(view: PlaneView, points: FloatArray, cells: IntArray) -> BoolArray:
    """Pixels of a view whose centres a closed surface encloses."""
    shape = view.labels.shape
    world = view.to_world(np.stack(np.indices(shape), axis=-1).reshape(-1, 2))
    chosen = vtkSelectEnclosedPoints()
    chosen.SetInputData(pv.PolyData(world))
    chosen.SetSurfaceData(pv.PolyData.from_regular_faces(points, cells))
    chosen.Update()
    return np.asarray(pv.wrap(chosen.GetOutput())["SelectedPoints"], dtype=bool).reshape(shape)


def compared(view: PlaneView, made: BoolArray, true: BoolArray) -> tuple[float, float]:
    """Dice overlap, and Hausdorff distance of the outlines, mm."""
    dice = 2.0 * float((made & true).sum()) / float(made.sum() + true.sum())
    a, b = (mask_edges(np.pad(m, 1), view.origin, view.axes, view.spacing).points for m in (made, true))
    return dice, max(directed_hausdorff(a, b)[0], directed_hausdorff(b, a)[0])


def rows(heart: Heart, seed: int) -> dict[str, dict[str, tuple[float, float]]]:
    """Each variant's figures by structure."""
    moved, true = scan(heart, seed).seg, scan(heart, seed, slices=0.0, views=0.0).seg.views[0]
    found = {}
    for variant in VARIANTS:
        seg = replace(moved, views=moved.views[1:] if variant == "views" else ())
        made = surfaces(seg if variant == "as-is" else align_slices(seg), heart)
        found[variant] = {
            name: compared(true, inside(true, *surface), true.mask(*heart.objects[name]))
            for name, surface in made.items()
            if true.mask(*heart.objects[name]).any()
        }
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hearts", nargs="+", default=["four", "rodero"])
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(8)))
    args = parser.parse_args()
    for heart in hearts(args.hearts):
        every = [rows(heart, seed) for seed in args.seeds]
        for variant in VARIANTS:
            names = [name for name in heart.objects if all(name in row[variant] for row in every)]
            mean = {name: np.mean([row[variant][name] for row in every], axis=0) for name in names}
            words = "  ".join(f"{name} {dice:.3f} {far:.1f} mm" for name, (dice, far) in mean.items())
            print(f"{heart.name:8s} {variant:6s} {words}", flush=True)


if __name__ == "__main__":
    main()
