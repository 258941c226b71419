"""Hashes of what femprep makes, to compare before and after a change that ought to change no byte.

    python tests/benchmarks/hash_meshes.py before.json                       30 ACDC maps and the phantoms
    python tests/benchmarks/hash_meshes.py after.json --against before.json  what differs, and by how much
    python tests/benchmarks/hash_meshes.py some.json --maps 6 --phantoms lv biv

Of each: every surface by the default way, both ventricles' common epicardium and wall, the left ventricle's wall, swept
mesh with fibres, and written files of every format. Arrays lie beside the hashes in ``FILE.npz``. Maps need
FEMPREP_DATA.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from bench_determinism import chosen_maps, digest

import femprep as fp
from femprep import phantoms
from femprep.export.table import FORMATS
from femprep.model.stages import Stages
from femprep.pipeline import begin
from femprep.wall.anatomies import ANATOMIES

Arrays = dict[str, np.ndarray]
#: Phantoms by name: anatomy, and the object of those that are no whole anatomy.
PHANTOMS: Final[dict[str, tuple[Callable[[], phantoms.Phantom], str]]] = {
    "lv": (phantoms.lv_ellipsoid, "lv"),
    "shell": (phantoms.sphere_shell, "surfaces"),
    "bent": (phantoms.rv_bent, "surfaces"),
    "crescent": (phantoms.rv_crescent, "surfaces"),
    "atrium": (phantoms.atrium, "surfaces"),
    "body": (phantoms.whole_heart, "surfaces"),
    "biv": (phantoms.biventricular, "biv"),
    "chambers": (phantoms.four_chambers, "whole-heart"),
}
#: Files that tell the time, versions or the machine.
_TIMED: Final = {"run.json", "quality.json", "report.html"}


def made(maps: int, names: list[str]) -> Iterator[tuple[str, Arrays]]:
    """Everything that is compared, with its name."""
    for name in names:
        phantom, anatomy = PHANTOMS[name]
        seg = phantom().segmentation(spacing=(1.8, 1.8, 9.0))
        if anatomy == "surfaces":
            for part in seg.structures:
                for method in ("smooth", "even"):
                    surface = fp.fit_surface(seg.object(part), vertices=800, method=method)
                    yield f"{name} {part} {method}", _arrays(surface)
        else:
            yield from heart(name, seg, anatomy, 700)
    for name, path in chosen_maps(maps):
        seg = fp.read_segmentation(path, preset="acdc")
        yield from heart(name, seg, "biv", 1500)


def heart(name: str, seg: Any, anatomy: str, vertices: int) -> Iterator[tuple[str, Arrays]]:
    """Surfaces and wall of one heart, and the swept left ventricle where it is one or both ventricles."""
    options = fp.Options(anatomy=anatomy, surface={"vertices": vertices})
    seg, layout, _ = begin(seg, options, Stages(None))
    try:
        parts = ANATOMIES[anatomy](seg, layout, options, Stages(None))
    except fp.FemprepError as error:
        yield f"{name} surfaces", _refused(error)
        return
    surfaces = dict(parts.surfaces)
    for own, surface in surfaces.items():
        yield f"{name} {own}", _arrays(surface)
    if anatomy != "lv":
        wall = lambda: fp.build_wall(epi=parts.epi, endo=parts.endo, base=parts.base, apex=parts.apex)  # noqa: E731
        yield f"{name} {anatomy} wall", _tried(wall)
    if anatomy == "whole-heart":
        return
    epi = parts.epi if parts.body is None else parts.body
    endo, base = parts.endo["lv"], fp.find_base(seg)
    yield f"{name} lv wall", _tried(lambda: fp.build_wall(epi=epi, endo={"lv": endo}, base=base))
    yield f"{name} swept", _tried(lambda: swept(seg, endo, epi, base))
    if anatomy == "lv":
        run = fp.mesh_segmentation(seg, options, volume={"mesher": "sweep"}, formats=tuple(FORMATS), fibres={})
        with tempfile.TemporaryDirectory() as folder:
            fp.write_run(run, Path(folder) / "out")
            for file in sorted(Path(folder).rglob("*")):
                if file.is_file() and file.name not in _TIMED:
                    content = np.frombuffer(file.read_bytes(), dtype=np.uint8)
                    yield f"{name} file {file.relative_to(folder)}", {"points": content, "cells": np.empty(0)}


def swept(seg: Any, endo: Any, epi: Any, base: Any) -> Any:
    """The left ventricle between two surfaces, by layers, with fibres."""
    mesh = fp.sweep(fp.match_surfaces(endo=endo, epi=epi, base=base, edge_length=2.5))
    return fp.add_fibres(mesh, axes=fp.ventricular_axes(seg))


def _tried(make: Callable[[], Any]) -> Arrays:
    """What is made, or the words by which it is refused."""
    try:
        return _arrays(make())
    except fp.FemprepError as error:
        return _refused(error)


def _refused(error: Exception) -> Arrays:
    return {"points": np.frombuffer(str(error).encode(), dtype=np.uint8), "cells": np.empty(0)}


def _arrays(thing: Any) -> Arrays:
    cells = (
        thing.triangles if hasattr(thing, "triangles") else np.concatenate([b.ravel() for b in thing.cells.values()])
    )
    # Fibres as three columns of the points, so that one comparison tells of both.
    more = [thing.cell_data[k] for k in ("fiber", "sheet")] if hasattr(thing, "region") else []
    return {"points": np.concatenate([thing.points, *more]), "cells": cells}


def difference(one: Any, two: Any) -> str:
    """How far apart two things of one name are."""
    if one[0].shape != two[0].shape or not np.array_equal(one[1], two[1]):
        return f"other connectivity: {one[0].shape} {one[1].shape} and {two[0].shape} {two[1].shape}"
    return f"{np.abs(one[0].astype(float) - two[0]).max():.1e}"


def main() -> None:
    """Make everything, write hashes and arrays, compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--maps", type=int, default=30)
    parser.add_argument("--phantoms", nargs="*", choices=PHANTOMS, default=list(PHANTOMS))
    given = parser.parse_args()
    start, hashes, arrays = time.perf_counter(), {}, {}
    before = json.loads(given.against.read_text()) if given.against else {}
    old = np.load(given.against.with_suffix(".npz")) if given.against else {}
    differ = 0
    for name, own in made(given.maps, given.phantoms):
        hashes[name] = digest(own)
        arrays |= {f"{name} {key}": value for key, value in own.items()}
        if before and hashes[name] != before.get(name):
            differ += 1
            pair = [[source.get(f"{name} {key}", np.empty(0)) for key in own] for source in (old, own)]
            pair[1] = list(own.values())
            print(f"{name}: {difference(*pair)}", flush=True)
    given.file.write_text(json.dumps(hashes, indent=1) + "\n")
    np.savez_compressed(given.file.with_suffix(".npz"), **arrays)
    print(f"{len(hashes)} things in {time.perf_counter() - start:.0f} s, {differ} differ")


if __name__ == "__main__":
    main()
