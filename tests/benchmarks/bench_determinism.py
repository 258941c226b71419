"""The same bytes on every machine: hashes of templates, surfaces, walls and swept meshes by processor and threads.

    python tests/benchmarks/bench_determinism.py                  10 ACDC maps and the largest epicardium of a phantom
    python tests/benchmarks/bench_determinism.py --maps 3         fewer of them
    python tests/benchmarks/bench_determinism.py --libraries      other kernels of OpenBLAS, NumPy and the C library too

Each column is a process of its own, with its own store of templates, that compiles for the named processor
(NUMBA_CPU_NAME) and runs with so many threads of numba and of BLAS. Processors that this one cannot stand in for are
left out: code for AVX-512 ends in an illegal instruction elsewhere. Where hashes of a row differ, the largest
difference from the first column is told in mm, and whether the connectivity is the same.

Maps need FEMPREP_DATA; without it only templates and the phantom are compared.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))
from processors import processors

#: Numbers of vertices that defaults and the paper ask for.
TEMPLATES: Final = (58, 204, 227, 300, 1180, 1500, 6750)
#: Other code of the libraries: an older processor, another one of the same instructions, numpy and libm without FMA.
LIBRARIES: Final = {
    "BLAS Prescott": {"OPENBLAS_CORETYPE": "Prescott"},
    "BLAS Sandybridge": {"OPENBLAS_CORETYPE": "Sandybridge"},
    "plain numpy": {
        "NPY_DISABLE_CPU_FEATURES": " ".join(np.show_config(mode="dicts")["SIMD Extensions"].get("found", []))
    },
    "libm without FMA": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable"},
}


def settings(libraries: bool) -> dict[str, dict[str, str]]:
    """Environments by their names in the table."""
    found = {}
    for name in processors():
        for threads in ("1", "2"):
            found[f"{name} {threads}"] = {
                "NUMBA_CPU_NAME": name,
                "NUMBA_NUM_THREADS": threads,
                "OPENBLAS_NUM_THREADS": threads,
            }
    one = {"NUMBA_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "1", "NUMBA_CPU_NAME": processors()[-1]}
    return found | ({name: one | changes for name, changes in LIBRARIES.items()} if libraries else {})


def chosen_maps(count: int) -> list[tuple[str, str]]:
    """Names and paths of maps, spread over all."""
    from bench_acdc import cases

    data = Path(os.environ.get("FEMPREP_DATA", "-"))
    if not data.is_dir() or not count:
        return []
    rows = cases(data)
    return [(row["id"], str(data / "acdc" / row["file"])) for row in rows[:: max(1, len(rows) // count)][:count]]


def made(count: int, templates: tuple[int, ...], phantom: bool) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Everything that is compared: names, and points and cells of each."""
    import femprep as fp
    from femprep.phantoms import whole_heart
    from femprep.template import charge_template

    for vertices in templates:
        template = charge_template(vertices)
        yield f"template {vertices}", {"points": template.directions, "cells": template.cells}
    if phantom:
        heart = whole_heart().segmentation(spacing=(1.4, 1.4, 8.0)).object("epi", name="epi")
        yield "whole heart epicardium", _surface(fp.fit_surface(heart, vertices=6750))
    for name, path in chosen_maps(count):
        seg = fp.orient(fp.read_segmentation(path, preset="acdc"))
        yield from stages(name, seg)


def stages(name: str, seg: Any, vertices: int = 1500, edge: float = 2.5) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Surfaces, wall and swept mesh of one segmentation."""
    import femprep as fp

    endo = fp.fit_surface(seg.object("lv", name="lv"), vertices=vertices)
    yield f"{name} endocardium", _surface(endo)
    heart = seg.object("lv", "myo", name="epi")
    epi = fp.fit_surface(heart, boundary=fp.extend_apex(seg, heart), vertices=vertices)
    yield f"{name} epicardium", _surface(epi)
    base = fp.find_base(seg)
    toward = (1.0, 0.0, 0.0) if seg.frame is None else tuple(seg.frame[:, 0].tolist())
    yield f"{name} wall", _or_refusal(lambda: _wall(fp.build_wall(epi=epi, endo={"lv": endo}, base=base)))
    match = partial(fp.match_surfaces, endo=endo, epi=epi, base=base, toward=toward, edge_length=edge)
    yield f"{name} swept mesh", _or_refusal(lambda: _mesh(fp.sweep(match())))


def _or_refusal(make: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """What is made, or the words by which it is refused."""
    from femprep import FemprepError

    try:
        return make()
    except FemprepError as error:
        return {"points": np.frombuffer(str(error).encode(), dtype=np.uint8), "cells": np.empty(0)}


def _wall(wall: Any) -> dict[str, np.ndarray]:
    return {"points": wall.points, "cells": wall.triangles}


def _mesh(mesh: Any) -> dict[str, np.ndarray]:
    return {"points": mesh.points, "cells": mesh.cells["tetra"]}


def _surface(surface: Any) -> dict[str, np.ndarray]:
    return {"points": surface.points, "cells": surface.triangles}


def child(folder: Path, count: int, phantom: bool) -> None:
    """Make everything and keep it in a folder."""
    for number, (name, arrays) in enumerate(made(count, TEMPLATES, phantom)):
        np.savez(folder / f"{number:03d} {name}.npz", **arrays)


def digest(arrays: Any) -> str:
    """Short hash of points and cells."""
    return sha256(b"".join(np.ascontiguousarray(arrays[key]).tobytes() for key in ("points", "cells"))).hexdigest()[:8]


def difference(one: Any, two: Any) -> str:
    """Largest difference of two files in mm, and whether their connectivity is the same."""
    if one["points"].shape != two["points"].shape or not np.array_equal(one["cells"], two["cells"]):
        return "other connectivity"
    return f"{np.abs(one['points'].astype(float) - two['points']).max():.1e} mm"


def run(environment: dict[str, str], folder: Path, arguments: list[str]) -> None:
    """One child with its own stores."""
    code = folder.parent / f"code for {environment['NUMBA_CPU_NAME']}"
    stores = {"FEMPREP_CACHE": str(folder / "templates"), "NUMBA_CACHE_DIR": str(code)}
    for made_here in (folder / "templates", folder / "out", code):
        made_here.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, __file__, "--child", str(folder / "out"), *arguments]
    subprocess.run(command, env={**os.environ, **environment, **stores}, check=True)


def table(columns: dict[str, dict[str, Any]]) -> None:
    """Print hashes, a row for each thing made; differences where there are any."""
    names, first = list(columns), next(iter(columns.values()))
    print("| | " + " | ".join(names) + " | differ by |")
    print("|---|" + "---|" * (len(names) + 1))
    equal = 0
    for row in first:
        hashes = [digest(columns[name][row]) for name in names]
        told = sorted({difference(first[row], columns[n][row]) for n, h in zip(names, hashes) if h != hashes[0]})
        equal += not told
        shown = [hashes[0], *("same" if h == hashes[0] else h for h in hashes[1:])]
        print(f"| {row} | " + " | ".join(shown) + f" | {', '.join(told) or '-'} |")
    print(f"\n{equal} of {len(first)} the same bytes in all {len(names)} columns")


def main(arguments: list[str] | None = None) -> None:
    """Run the children and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", type=int, default=10, help="number of ACDC maps")
    parser.add_argument("--phantom", choices=("yes", "no"), default="yes", help="whether to fit the whole heart")
    parser.add_argument("--libraries", action="store_true", help="other kernels of the libraries as well")
    parser.add_argument("--columns", nargs="+", help="only these columns, by name")
    parser.add_argument("--jobs", type=int, default=1, help="columns at a time")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.child:
        child(given.child, given.maps, given.phantom == "yes")
        return
    chosen = {n: e for n, e in settings(given.libraries).items() if not given.columns or n in given.columns}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(given.jobs) as pool:
        places = {name: Path(folder) / name.replace(" ", "-") for name in chosen}
        arguments = ["--maps", str(given.maps), "--phantom", given.phantom]
        list(pool.map(lambda name: run(chosen[name], places[name], arguments), chosen))
        columns = {n: {f.stem[4:]: np.load(f) for f in sorted((p / "out").iterdir())} for n, p in places.items()}
        table(columns)


if __name__ == "__main__":
    main()
