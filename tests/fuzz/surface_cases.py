"""Cases of surfaces: files to compare, and one's own surfaces to mesh between."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from fuzz.common import SWEEP, Made, one_of
from fuzz.damage import Random, choose, file_of
from fuzz.sources import Sources
from fuzz.surface_damage import SURFACES, Shape

#: Names that surfaces are given by: most often the right ones.
_NAMES = (*(("lv", "epi"),) * 8, ("epi", "lv"), ("lv",), ("epi",), ("lv", "epi", "rv"), ("la", "epi"), ("lv", "none"))


def surface_file(random: Random, sources: Sources, folder: Path) -> Made:
    source = choose(random, sources.surfaces)
    assert isinstance(source, Path)
    path = folder / source.name
    shutil.copy(source, path)
    return Made(f"{source.name}: {file_of(random, path)}", ["compare", str(path), str(source), "--json"])


def own_surfaces(random: Random, sources: Sources, folder: Path) -> Made:
    """Endocardium and epicardium, one or both damaged, as shapes or as files."""
    names = _NAMES[int(random.integers(len(_NAMES)))]
    given, done = [], []
    both = bool(random.random() < 0.2)
    hurt = int(random.integers(len(names)))
    for number, name in enumerate(names):
        wall = sources.walls["epi" if name == "epi" else "lv"]
        surface = Shape(np.array(wall.points), np.array(wall.triangles))
        path = folder / f"{number}{one_of(random, ('.stl', '.ply', '.obj', '.off', '.vtp', '.vtk'))}"
        kinds = [one_of(random, SURFACES) for _ in range(int(random.integers(0, 3)))] if both or number == hurt else []
        for kind in kinds:
            surface = SURFACES[kind](random, surface)
        write(surface, path)
        if kinds:
            done.append(f"{name} {', '.join(kinds)}")
        elif number == hurt:
            done.append(f"{path.name}: {file_of(random, path)}")
        given += ["--surface", f"{name}={path}"]
    more = one_of(
        random, (*("",) * 6, "--unit=mm", "--unit=m", "--base=0,0,10,0,0,1", "--base=0,0,900,0,0,1", "--fibres")
    )
    arguments = ["mesh", "-o", "out", *given, *SWEEP, *more.split()]
    return Made(f"{'; '.join(done)} {more}".strip(), arguments, "out", True)


def write(surface: Shape, path: Path) -> None:
    """Write the triangles of a surface as other programs do."""
    import pyvista
    import trimesh

    if path.suffix in (".vtp", ".vtk"):
        pyvista.PolyData.from_regular_faces(surface.points, surface.triangles).save(path)
    else:
        trimesh.Trimesh(surface.points, surface.triangles, process=False).export(path)
