"""Coverage-guided fuzzing (atheris) of the readers of others' files: what is no refusal is kept, with its input.

    pip install atheris
    python tests/fuzz/guided.py abaqus --minutes 60 --corpus corpus
    python tests/fuzz/guided.py --list
    python tests/fuzz/guided.py --sum --corpus corpus

One reader a run, in this process: a reader that crashes, waits for longer than 20 s or takes more than 6 GB ends it,
and libFuzzer leaves the input beside the corpus. An exception that is no refusal is noted once for each place it
comes from, and the run goes on; so is a file that takes 300 MB more than any before it. Inputs that reach code that
none before reached stay in the corpus, so that the next run begins with them. What is read is read twice, so that
what is not in the file but in the memory is seen. The process in which a file of VTK's is tried first is forked here,
in a tenth of the time of one that starts anew. Beside the corpus NAME.json adds up the processor's minutes and the
inputs of all runs, of which --sum makes a table: of meshes a line for each ending, by which a reader is chosen,
however many writers its sound files are from.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import atheris
import numpy as np
import pyvista
import SimpleITK as sitk

PACKAGE = Path(__file__).resolve().parents[2] / "femprep"


def module_of(path: Path) -> str:
    """Name of the module in a file."""
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)


#: Compiled functions cannot be followed.
COMPILED = {module_of(path) for path in PACKAGE.rglob("*.py") if "compiled(" in path.read_text()}

with atheris.instrument_imports(include=["meshio", "femprep"], exclude=COMPILED):
    import meshio

    import femprep as fp

    for name in ("export", "image/reading", "mesh/vtk", "surface/files.py"):
        for path in sorted(PACKAGE.joinpath(name).rglob("*.py")) or [PACKAGE / name]:
            import_module(module_of(path).removesuffix(".__init__"))

sys.path[:0] = [str(Path(__file__).resolve().parent.parent)]

from exodus_file import two_steps  # noqa: E402
from exodus_file import write as write_exodus  # noqa: E402
from export.xdmf.test_dolfinx_tags import CELLS  # noqa: E402
from export.xdmf.test_dolfinx_tags import written as write_tags  # noqa: E402
from fuzz.mutate import Damage  # noqa: E402
from fuzz.sources import Sources  # noqa: E402
from image.reading.test_dicom import masks_of, phantom, write_seg  # noqa: E402

from femprep.errors import FemprepError, FileError  # noqa: E402
from femprep.mesh.vtk import reading, trial  # noqa: E402

#: Where atheris follows a comparison of arrays, these stay in memory: some gigabytes in an hour.
SECONDS, MEGABYTES, LONGEST = 20, 6000, 1 << 20
#: Megabytes that one file may add to the most memory so far.
JUMP = 300
#: Files beside the one a mesh is read by, which are damaged in their turn.
BESIDE = {
    "opencarp": ".elem",
    "opencarp-binary": ".belem",
    "medit": ".sol",
    "mesh-node": ".ele",
    "dolfinx": ".h5",
    "mesh-xdmf": ".h5",
}


class Reader(NamedTuple):
    """What reads a file, sound files, and the ending by which it is chosen."""

    read: Callable[[Path], Any]
    sound: list[Path]
    ending: str


def readers(folder: Path) -> dict[str, Reader]:
    """Each reader by name: what reads a file, and sound files (those beside them are needed too)."""
    sources = Sources(folder / "sound")
    found: dict[str, Reader] = {}
    mesh, surface = partial(read_twice, read=fp.read_mesh), partial(read_twice, read=fp.read_surface)
    numbered = partial(read_twice, read=partial(fp.read_segmentation, preset="acdc"))
    for path in [*sources.meshes, *sources.foreign]:
        name = path.parent.name if path.parent.name != "in" else path.stem
        if path.is_file():
            found.setdefault(name, Reader(mesh, [], path.suffix)).sound.append(path)
    for name, ending in BESIDE.items():
        first = found[name].sound[0]
        read = partial(mesh, name=first.name)
        beside = [one for path in found[name].sound for one in sorted(path.parent.glob(f"*{ending}"))]
        found[f"{name}{ending}"] = Reader(read, beside, first.suffix)
    for path in sources.surfaces:
        found[f"surface{path.suffix}"] = Reader(surface, [path], path.suffix)
    dicom = [
        write_seg(folder / f"{kind}.dcm", phantom(), masks_of(phantom()), kind) for kind in ("BINARY", "FRACTIONAL")
    ]
    found["labels.dcm"] = Reader(partial(read_twice, read=fp.read_segmentation), dicom, ".dcm")
    sound = fp.read_mesh(sources.foreign[0])
    for name, kind, ending in (("mesh.xml", "dolfin-xml", ".xml"),):
        path = folder / f"rare-{kind}" / name
        path.parent.mkdir()
        with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere), contextlib.redirect_stderr(nowhere):
            meshio.write(path, meshio.Mesh(sound.points, list(sound.cells.items())), kind)
        found[f"rare-{kind}"] = Reader(mesh, [path], ending)
    for kind in ("classic", "hdf5"):
        path = folder / f"exodus-{kind}" / "mesh.exo"
        path.parent.mkdir()
        found[f"exodus-{kind}"] = Reader(mesh, [write_exodus(path, *two_steps(), hdf5=kind == "hdf5")], path.suffix)
    beside = folder / "dolfinx-tags"
    beside.mkdir()
    tags = ("cells", "Tetrahedron", CELLS, np.array([7, 9])), ("facets", "Triangle", CELLS[:1, :3], np.array([60]))
    found["dolfinx-tags"] = Reader(mesh, [write_tags(beside, *tags)], ".xdmf")
    for name, path in written_in_words(found, folder):
        found[name].sound.append(path)
    for ending in (".nii", ".nii.gz", ".nrrd", ".mha"):
        path = folder / f"labels{ending}"
        fp.write_segmentation(sources.maps["lv"], path)
        plain = folder / f"plain{ending}"
        sitk.WriteImage(sitk.Cast(sitk.ReadImage(str(path)), sitk.sitkFloat32), str(plain), useCompression=False)
        found[f"labels{ending}"] = Reader(numbered, [path, plain], path.suffix)
    return found


def written_in_words(found: dict[str, Reader], folder: Path) -> Iterator[tuple[str, Path]]:
    """Files of readers whose sound ones are binary or compressed, as text, and uncompressed."""
    for name in ("mesh-vtu", "mesh-vtk", "mesh-xdmf"):
        path = folder / f"text.{name.removeprefix('mesh-')}"
        meshio.read(found[name].sound[0]).write(
            path, **({"data_format": "XML"} if "xdmf" in name else {"binary": False})
        )
        yield name, path
    for name in ("surface.vtp", "surface.vtk", "surface.stl", "surface.ply"):
        path = folder / f"text-{name}"
        pyvista.read(found[name].sound[0]).save(path, binary=False)
        yield name, path


def read_twice(path: Path, read: Callable[[Path], Any], name: str = "") -> None:
    """Read a file, or the one of a name that it lies beside; what it holds must not be what was in the memory.

    A mesh is judged as well, as ``femprep check`` does.
    """
    path = path.with_name(name) if name else path
    found = read(path)
    content = list(bytes_in(found))
    np.full(sum(map(len, content)), 170, dtype=np.uint8)  # is freed at once: what is not read then differs
    if content != list(bytes_in(read(path))):
        raise RuntimeError("read twice it holds something else")
    if isinstance(found, fp.VolumeMesh):
        fp.check(found)


def bytes_in(found: Any) -> Iterator[bytes]:
    """The numbers of an array, or of those a mapping, a surface, a mesh or a label map holds."""
    if isinstance(found, np.ndarray):
        yield found.tobytes()
    elif isinstance(found, Mapping):
        for name in sorted(found):
            yield from bytes_in(found[name])
    elif is_dataclass(found) and not isinstance(found, type):
        for field in fields(found):
            yield from bytes_in(getattr(found, field.name))


def try_forked(path: Path) -> None:
    """What ``trial.require_readable`` does, without the start of Python and VTK for each file."""
    for module in ("vtkIOLegacy", "vtkIOXML"):  # not in each child anew
        import_module(f"vtkmodules.{module}")
    child = os.fork()
    if not child:
        for number in ("SEGV", "ABRT", "BUS", "FPE", "ILL", "ALRM"):  # libFuzzer would take them for its own
            signal.signal(getattr(signal, f"SIG{number}"), signal.SIG_DFL)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        signal.alarm(SECONDS // 2)
        try:
            trial.read_within_limits(path)
            os._exit(0)
        finally:
            os._exit(1)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status:
        raise FileError(f"{str(path)!r} is damaged: VTK's reader breaks down on it (status {status})")


class Target:
    """One reader, fed bytes as one file among its sound neighbours; what it said that it must not say.

    Parameters
    ----------
    read : callable
    sound : Path
        A file it reads.
    folder : Path
        For the files it is to read.
    kept : Path
        Folder of what fell short.
    """

    def __init__(self, read: Callable[[Path], Any], sound: Path, folder: Path, kept: Path) -> None:
        self.read, self.kept = read, kept
        place = folder / "in"
        if sound.parent == folder or sound.parent.name == "surfaces":
            place.mkdir()
        else:
            shutil.copytree(sound.parent, place)
        self.path = place / sound.name
        self.told: list[str] = []
        self.peak = most_memory()
        self.count = self.refused = 0

    def __call__(self, data: bytes) -> None:
        self.count += 1
        self.path.write_bytes(data)
        try:
            with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self.read(self.path)
        except FemprepError:
            self.refused += 1
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{type(error).__name__} {Path(last.filename).name}:{last.lineno}"
            self._keep(where, data, "".join(traceback.format_exception(error)))
        if (peak := most_memory()) > self.peak + JUMP:
            self._keep(f"more than {JUMP} MB", data, f"{self.peak} to {peak} MB")
        self.peak = max(self.peak, peak)
        if self.count % 100 == 1:
            tally = {"inputs": self.count, "refused": self.refused, "no refusal": self.told}
            (self.kept / "tally.json").write_text(json.dumps(tally))

    def _keep(self, where: str, data: bytes, words: str) -> None:
        """Keep what fell short, once for each place it comes from."""
        if where not in self.told:
            self.told.append(where)
            (self.kept / f"{len(self.told)}-{self.path.name}").write_bytes(data)
            (self.kept / f"{len(self.told)}.txt").write_text(words)


def most_memory() -> int:
    """The most memory this process had so far, megabytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024


def add_up(record: Path, ending: str, tally: dict[str, Any], minutes: float) -> dict[str, Any]:
    """What all runs of a name came to, in a file."""
    before = json.loads(record.read_text()) if record.is_file() else {}
    total = {
        "ending": ending,
        "minutes": round(before.get("minutes", 0.0) + minutes, 1),
        "inputs": before.get("inputs", 0) + tally["inputs"],
        "refused": before.get("refused", 0) + tally["refused"],
        "reached": tally["reached"],
        "ended": before.get("ended", 0) + (tally["status"] != 0),
        "no refusal": sorted({*before.get("no refusal", []), *tally["no refusal"]}),
    }
    record.write_text(json.dumps(total) + "\n")
    return total


def table(corpus: Path) -> str:
    """Minutes of the processor, inputs and what fell short, of each reader so far."""
    readers: dict[str, list[dict[str, Any]]] = {}
    for record in sorted(corpus.glob("*.json")):
        total = json.loads(record.read_text())
        by_ending = not record.stem.startswith(("surface", "labels"))
        readers.setdefault(total["ending"] if by_ending else record.stem, []).append(total)
    head = "| reader | minutes | inputs | refused | reached new code | ended the process | no refusal |"
    lines = [head, "|---|" + 6 * "---|"]
    for name, totals in sorted(readers.items()):
        counts = " | ".join(f"{sum(one[key] for one in totals):,}" for key in ("inputs", "refused", "reached", "ended"))
        told = "; ".join(line for one in totals for line in one["no refusal"])
        lines.append(f"| {name} | {sum(one['minutes'] for one in totals):.1f} | {counts} | {told or 0} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reader", nargs="?", help="which; --list tells")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--corpus", type=Path, default=Path("corpus"), help="folder of inputs, kept between runs")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--sum", action="store_true", help="the table of all runs")
    given = parser.parse_args()
    if given.sum:
        print(table(given.corpus))
        return
    vars(reading)["require_readable"] = try_forked
    memory = "/dev/shm" if os.path.isdir("/dev/shm") else None
    with tempfile.TemporaryDirectory(dir=memory) as folder:
        found = readers(Path(folder))
        if given.list or given.reader not in found:
            print("\n".join(found))
            return
        read, sound, ending = found[given.reader]
        corpus, kept = given.corpus / given.reader, given.corpus / f"{given.reader}-kept"
        for place in (corpus, kept):
            place.mkdir(parents=True, exist_ok=True)
        for number, path in enumerate(sound):
            shutil.copy(path, corpus / f"sound-{number}{path.suffix}")
        child = os.fork()
        if not child:  # libFuzzer leaves by _exit(): who comes after it is the parent
            limits = [f"-max_total_time={int(60 * given.minutes)}", f"-timeout={SECONDS}", f"-rss_limit_mb={MEGABYTES}"]
            words = [*limits, f"-max_len={LONGEST}", f"-artifact_prefix={kept}/", "-verbosity=0", str(corpus)]
            target = Target(read, sound[0], Path(folder), kept)
            damage = Damage([path.read_bytes() for path in sound], lambda *given: atheris.Mutate(*given))
            atheris.Setup([sys.argv[0], *words], target, custom_mutator=damage)
            atheris.Fuzz()
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        tally = json.loads((kept / "tally.json").read_text())
        tally.update(status=status, reached=len(list(corpus.iterdir())))
        used = resource.getrusage(resource.RUSAGE_CHILDREN)  # on a busy machine less than the clock's
        total = add_up(given.corpus / f"{given.reader}.json", ending, tally, (used.ru_utime + used.ru_stime) / 60.0)
        print(json.dumps({"reader": given.reader, **tally, "all runs": total}))


if __name__ == "__main__":
    main()
