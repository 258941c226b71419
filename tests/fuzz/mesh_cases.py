"""Cases of mesh files, of femprep's formats and of others': each command that reads one."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from fuzz.common import FILLED, SWEEP, TARGETS, Made, map_for_options, mesh, one_of, write
from fuzz.damage import NUMBERS, Random, choose, file_of
from fuzz.sources import Sources


def _damaged(random: Random, source: Path, folder: Path, share: float = 1.0) -> tuple[Path, str]:
    """A copy of a mesh, one of its files damaged; its path, and what was done."""
    place = folder / "in"
    shutil.copytree(source.parent, place)
    path = place / source.name
    files = sorted(p for p in place.rglob("*") if p.is_file())
    victim = path if path.is_file() and random.random() < 0.7 else choose(random, files)
    assert isinstance(victim, Path)
    if random.random() >= share:
        return path, f"{source.parent.name} as it is"
    return path, f"{victim.name} of {source.parent.name}: {file_of(random, victim)}"


def _one(random: Random, paths: list[Path]) -> Path:
    return paths[int(random.integers(len(paths)))]


def mesh_file(random: Random, sources: Sources, folder: Path) -> Made:
    """Read alone, and written in another format."""
    meshes = sources.meshes if random.random() < 0.7 else sources.foreign
    path, done = _damaged(random, _one(random, meshes), folder)
    way = random.random()
    if way < 0.45:
        return Made(done, ["check", str(path), "-q"])
    if way < 0.5:
        return Made(done, ["bullseye", str(path), "out.svg", "-q"], "out.svg")
    target = one_of(random, TARGETS)
    return Made(done, ["convert", str(path), target, "-q"], target)


def annotate(random: Random, sources: Sources, folder: Path) -> Made:
    """Anyone's mesh with its file, or what is said of it, damaged."""
    meshes = [*sources.hearts, *sources.foreign, *sources.meshes]
    path, done = _damaged(random, _one(random, meshes), folder, 0.8)
    given: list[str] = []
    for _ in range(int(random.integers(0, 3))):
        name = one_of(random, ("--name", "--at", "--base", "--unit", "--endo-angle", "--mirrored", "--format"))
        words = {
            "--name": ("4=epi", "endo=endo_lv", "1=lv", "=", "a=b", "101=epi", "epi=epi", "99=base"),
            "--at": ("endo_lv=0,0,0", "epi=1e300,0,0", "endo_lv=nan,0,0", "x=1,2,3", "base=0,0"),
            "--base": ("0,0,15,0,0,1", "0,0,0,0,0,0", "1,2", "0,0,1e30,0,0,1", "0,0,15,0,0,-1"),
            "--unit": ("mm", "cm", "m", "um", "inch"),
            "--mirrored": ("yes", "no", "auto", "perhaps"),
            "--format": ("abaqus", "med", "opencarp", "febio", "nothing"),
        }.get(name, NUMBERS)
        given += [name, one_of(random, words)]
    if random.random() < 0.5:
        given.append("--no-fibres")
    return Made(f"{done} {' '.join(given)[:60]}".strip(), ["annotate", str(path), "-o", "out", "-q", *given], "out")


def refine(random: Random, sources: Sources, folder: Path) -> Made:
    """A mesh damaged, or a number of levels that is none."""
    path, done = _damaged(random, _one(random, [*sources.meshes, *sources.foreign]), folder, 0.8)
    levels = one_of(random, (*["1"] * 60, "2", "2", *NUMBERS))
    target = one_of(random, TARGETS)
    arguments = ["refine", str(path), "-o", target, "--levels", levels, "-q"]
    return Made(f"{done}, levels {levels[:20]}", arguments, target)


def transfer(random: Random, sources: Sources, folder: Path) -> Made:
    """One of the two meshes damaged; fields that are there and fields that are not."""
    path, done = _damaged(random, _one(random, sources.hearts), folder, 0.9)
    other = str(_one(random, sources.hearts))
    given = []
    for _ in range(int(random.integers(1, 3))):
        given += ["--field", one_of(random, ("aha", "fiber", "transmural", "region", "rotational", "none", "", "a\nb"))]
    ends = [str(path), other] if random.random() < 0.5 else [other, str(path)]
    return Made(f"{done} {' '.join(given)}", ["transfer", *ends, "-o", "out.vtu", "-q", *given], "out.vtu")


_NUMBERS_OF_TREES = (
    *("--branch-length", "--branch-angle", "--repulsion", "--generations", "--segment-length", "--speed", "--seed"),
    *("--fibre-speed", "--sheet-speed", "--normal-speed"),
)


def activate(random: Random, sources: Sources, folder: Path) -> Made:
    """A mesh with fibres damaged, or numbers of the tree and of the speeds."""
    path, done = _damaged(random, _one(random, sources.hearts), folder, 0.7)
    given = [] if random.random() < 0.5 else ["--no-purkinje"]
    given += ["--generations", "4"]
    for _ in range(int(random.integers(0, 3))):
        given += [one_of(random, _NUMBERS_OF_TREES), one_of(random, (*NUMBERS, "0.1", "3", "12", "0.001"))]
    if random.random() < 0.2:
        given += ["--root-lv", one_of(random, ("0,0,0", "1e30,0,0", "nan,0,0", "1,2", ""))]
    target = one_of(random, ("out.vtu", "out.k", "out.pts"))
    done = f"{done} {' '.join(word[:20] for word in given)}"
    return Made(done, ["activate", str(path), "-o", target, "-q", *given], target)


def template(random: Random, sources: Sources, folder: Path) -> Made:
    """A swept mesh that a new one is to follow, or a field of edge lengths, damaged."""
    seg, image = sources.maps["lv"], folder / "map.nii.gz"
    if random.random() < 0.8:
        whole = map_for_options(random, seg, image)
        path, done = _damaged(random, sources.swept, folder, 0.9)
        return Made(done, mesh(image, "lv", *SWEEP, "--template", str(path)), "out", whole)
    write(image, np.asarray(seg.labels), seg.grid.spacing)
    path, done = _damaged(random, _one(random, sources.sizing), folder, 0.9)
    return Made(done, mesh(image, "lv", *FILLED, "--sizing", str(path)), "out", True)
