"""Speed of the method of the paper: seconds of a surface, growth with N, M, V, and kernels beside a bare loop.

    python tests/benchmarks/bench_kernels.py

"Interactions" are pairs of a point and a charge of which a gradient is computed. The bare loop does the same arithmetic
for as many pairs and nothing else: no flow and no stages, the formula as it is printed. Other work on the machine makes
wall-clock seconds upper bounds; processor time is printed beside them, and rates are the best of several paired runs.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from femprep.image import LabelObject, boundary_points
from femprep.phantoms import lv_ellipsoid
from femprep.surface.fit import TABLE_1, fit_surface
from femprep.surface.harmonic import kernels
from femprep.surface.harmonic.field import Field

SPACING = (1.44, 1.44, 8.0)


@numba.njit(parallel=True, fastmath={"reassoc", "contract", "nsz", "arcp"}, error_model="numpy")
def bare(points: Any, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any, times: int, out: Any) -> None:
    """Gradients at points, ``times`` over, as the formula has it (A.6)."""
    for i in numba.prange(points.shape[0]):
        for t in range(times):
            x = points[i, 0] + 1e-9 * t
            y = points[i, 1]
            z = points[i, 2]
            outside = 1.0 - (x * x + y * y + z * z)
            gx = 0.0
            gy = 0.0
            gz = 0.0
            inward = 0.0
            for m in range(sx.shape[0]):
                dx = sx[m] - x
                dy = sy[m] - y
                dz = sz[m] - z
                a = dx * dx + dy * dy + dz * dz
                b = a + gap[m] * outside
                image = weight[m] / (b * np.sqrt(b))
                p = weight[m] / (a * np.sqrt(a)) - image
                gx += dx * p
                gy += dy * p
                gz += dz * p
                inward += gap[m] * image
            out[i, 0] += gx - x * inward
            out[i, 1] += gy - y * inward
            out[i, 2] += gz - z * inward


def objects() -> dict[str, LabelObject]:
    """LV cavity and whole-heart epicardium of the paper's size."""
    heart = lv_ellipsoid((44, 36, 60), (54, 46, 70), base=np.inf)
    return {
        "lv": lv_ellipsoid().segmentation(SPACING).object("lv"),
        "epi": heart.segmentation(SPACING).object("lv", "myo"),
    }


def timed(work: Callable[[], Any], runs: int) -> tuple[float, float, float]:
    """Least and median wall-clock seconds, and least processor seconds."""
    wall, processor = [], []
    for _ in range(runs):
        start, used = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - start)
        processor.append(time.process_time() - used)
    return min(wall), float(np.median(wall)), min(processor)


def seconds(runs: int) -> None:
    """Whole fits, template in the store, kernels compiled."""
    print(
        f"{'':8s}{'M':>5s}{'K':>5s}{'V':>6s}{'N':>7s}{'steps':>7s}{'least s':>9s}{'median s':>10s}"
        f"{'processor s':>13s}{'asked s':>9s}"
    )
    for (name, obj), asked in zip(objects().items(), (0.5, 1.5)):
        numbers = TABLE_1[name]
        surface = fit_surface(obj, method="paper", **numbers)
        least, median, processor = timed(lambda o=obj, n=numbers: fit_surface(o, method="paper", **n), runs)
        print(
            f"{name:8s}{numbers['singularities']:5d}{numbers['control_points']:5d}{numbers['vertices']:6d}"
            f"{len(boundary_points(obj)):7d}{surface.info['flow_steps']:7d}{least:9.2f}{median:10.2f}"
            f"{processor:13.2f}{asked:9.1f}"
        )


def rates(runs: int) -> None:
    """Interactions per second of the flow and of the gradient, and of the bare loop."""
    for name, obj in objects().items():
        field = fit_surface(obj, method="paper", **TABLE_1[name]).shape.field  # type: ignore[union-attr]
        points = boundary_points(obj).points
        unit, charges = field._unit(points), field._charges
        level, out, steps = field.potential(points), np.zeros((len(points), 3)), 20
        pairs = len(points) * len(field.sources)

        def flow(u: Any = unit, v: Any = level, o: Any = out, c: Any = charges, n: int = steps) -> None:
            kernels.flow(kernels.blocks(u), u, v, np.zeros(len(v)), n, *c, o)

        def plain(u: Any = unit, o: Any = out, c: Any = charges, n: int = steps) -> None:
            bare(u, *c, 4 * n, o)

        flow(), plain()
        # In turn, so that other work on the machine falls on both alike.
        pair = [(timed(flow, 1), timed(plain, 1)) for _ in range(runs)]
        ours, loop = (min(run[k][2] for run in pair) for k in range(2))
        print(
            f"{name:8s}flow {4e-6 * steps * pairs / ours:8.0f} million interactions per processor second, bare loop "
            f"{4e-6 * steps * pairs / loop:8.0f}: {loop / ours:.2f} of it"
        )


def growth(runs: int) -> None:
    """Processor time of the flow as N, M and V grow: proportional to N M and V M."""
    rng = np.random.default_rng(0)
    print(f"{'points':>8s}{'charges':>9s}{'processor s':>13s}{'ns per pair and step':>22s}")
    for count, charges in ((2000, 200), (4000, 200), (8000, 200), (2000, 400), (2000, 800), (8000, 800)):
        directions = rng.normal(size=(count + charges, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        field = Field(np.zeros(3), 1.5, 0.8 * directions[:charges], np.full(charges, 1.0 / charges))
        points = directions[charges:]
        level = field.potential(points)
        spent = timed(lambda f=field, p=points, v=level: f.flow(p, v, 0.0, 20), runs)[2]
        print(f"{count:8d}{charges:9d}{spent:13.3f}{1e9 * spent / (count * charges * 80):22.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=7)
    runs = parser.parse_args().runs
    seconds(runs)
    rates(runs)
    growth(min(runs, 3))


if __name__ == "__main__":
    main()
