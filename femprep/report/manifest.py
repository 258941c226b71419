"""The record of one run, ``run.json``: versions, options, input, seconds per stage, what was repaired."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Mapping
from datetime import datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, Field

from femprep import __version__
from femprep.model.record import Record
from femprep.model.shared_records.label_fidelity import FidelityRecord
from femprep.model.shared_records.solution import SolutionRecord
from femprep.model.shared_records.surface_fidelity import SurfaceFidelity
from femprep.model.shared_records.tissue import TissuesRecord
from femprep.options import AnnotateOptions, Options

#: Libraries whose version can change a result.
LIBRARIES = (
    *("numpy", "scipy", "numba", "trimesh", "manifold3d", "pytetwild", "meshio", "pyvista", "vtk"),
    *("SimpleITK", "h5py", "pydantic"),
)


class SurfaceInput(Record):
    """A surface a run began with."""

    name: str = Field(description="What it is a surface of.")
    path: str | None = Field(None, description="File name as given, without its folder; null for data made in memory.")
    sha256: str | None = Field(None, description="SHA-256 of the file.")
    unit: str = Field(description="Its unit of length, guessed or given.")
    points: int = Field(description="Points it has, mended.")
    triangles: int = Field(description="Triangles it has, mended.")


class InputRecord(Record):
    """The image, or the surfaces, a run began with."""

    path: str | None = Field(None, description="File name as given, without its folder; null for data made in memory.")
    sha256: str | None = Field(None, description="SHA-256 of the file.")
    shape: tuple[int, int, int] | None = Field(
        None, description="Voxels along i, j, k; null where surfaces were given in place of an image."
    )
    spacing_mm: tuple[float, float, float] | None = Field(None, description="Voxel sizes, mm; null likewise.")
    structures: dict[str, list[int]] = Field(default_factory=dict, description="Label numbers by structure.")
    surfaces: list[SurfaceInput] = Field(default_factory=list, description="The surfaces a run began with.")
    notes: dict[str, Any] = Field(default_factory=dict, description="What the reader found and did.")


class ImageRecord(Record):
    """The image that the labels were drawn on, as the page shows it; no figure depends on it."""

    path: str | None = Field(None, description="File name as given, without its folder; null for data made in memory.")
    sha256: str | None = Field(None, description="SHA-256 of the file.")
    frame: int | None = Field(None, description="Which frame of the file, from 1; null where it holds one.")
    shape: tuple[int, int, int] = Field(description="Voxels along i, j, k.")
    spacing_mm: tuple[float, float, float] = Field(description="Voxel sizes, mm.")
    resampled: bool = Field(description="Whether it has other voxels than the labels, and was interpolated at theirs.")
    covered_percent: float = Field(description="Labelled voxels that lie in it, %.")


class StageRecord(Record):
    """One stage of a run."""

    name: str = Field(description="Name of the stage.")
    seconds: float = Field(description="Wall-clock time, s.")


class VolumeRecord(Record):
    """A volume of the mesh compared with that of the segmentation, or of the surfaces given."""

    name: str = Field(description="What is measured.")
    part: str = Field(
        "in all",
        description="Which part of it: below the base, between base and apex plane, or in all where no plane cuts it. "
        "All volumes are of this part but whole_ml.",
    )
    mesh_ml: float = Field(description="Volume enclosed by the mesh, mL.")
    segmentation_ml: float | None = Field(
        None, description="Volume of the voxels labelled so, before any repair, between the same planes, mL."
    )
    given_ml: float | None = Field(
        None, description="Volume of the surfaces that were given, between the same planes, mL."
    )
    whole_ml: float | None = Field(
        None,
        description="Volume of all voxels labelled so, also beyond the planes, mL; null where surfaces were given.",
    )
    difference_percent: float | None = Field(
        None, description="Mesh less segmentation, or less what was given, per cent of that."
    )
    extrapolated_ml: float = Field(
        0.0, description="Volume of the mesh beyond the last slice with labels at the apex, mL: no voxel is beside it."
    )


class _Made(Record):
    """When and by what a folder was made."""

    femprep: str = Field(__version__, description="Version of femprep.")
    command: str | None = Field(None, description="The command line as typed; null from Python or a cohort.")
    date: str = Field(
        default_factory=lambda: datetime.now().astimezone().isoformat(timespec="seconds"),
        description="When the folder was written: ISO 8601, with the offset from UTC.",
    )
    python: str = Field(default_factory=platform.python_version, description="Version of Python.")
    system: str = Field(default_factory=platform.platform, description="Operating system.")
    libraries: dict[str, str] = Field(default_factory=lambda: library_versions(), description="Versions of libraries.")
    length_unit: Literal["mm"] = Field("mm", description="Unit of all lengths.")


class RunManifest(_Made):
    """What ``run.json`` holds."""

    coordinates: Literal["LPS"] = Field("LPS", description="World coordinates: left, posterior, superior.")
    input: InputRecord
    image: ImageRecord | None = Field(
        None, description="The image that the page shows under the outlines; null where none was given."
    )
    options: Options = Field(description="All options of the run, defaults included.")
    stages: list[StageRecord] = Field(description="Stages in order.")
    volumes: list[VolumeRecord] = Field(default_factory=list, description="Volumes beside the segmentation's.")
    fidelity: list[FidelityRecord] = Field(
        default_factory=list, description="How far each surface lies from the outlines of its labels, slice by slice."
    )
    given_fidelity: list[SurfaceFidelity] = Field(
        default_factory=list, description="How far each surface lies from the one that was given for it."
    )
    thickness_mm: dict[str, float | None] | None = Field(
        None,
        description="Mean thickness of the wall in each of the 17 AHA segments by its name, in their order, mm; null "
        "without segments.",
    )
    tissues: TissuesRecord | None = Field(
        None, description="Scar, border zone or other tissue of a second image, by AHA segment; null without one."
    )
    solution: SolutionRecord | None = Field(
        None, description="What a solver made of the mesh; null where none was asked for."
    )
    details: dict[str, Any] = Field(
        default_factory=dict, description="What each stage reports: parameters, residuals, thickness."
    )
    notices: list[str] = Field(
        default_factory=list,
        description="What was repaired, assumed, extrapolated, moved or left out, a line each; with figures and places "
        "under notices in the details and the input's notes.",
    )
    deterministic: bool = Field(description="Whether a second run gives the same bytes (fTetWild does not).")
    files: list[str] = Field(default_factory=list, description="Files of the output folder.")
    sha256: dict[str, str] = Field(
        default_factory=dict, description="SHA-256 of each of them but run.json; a later run replaces no other file."
    )


class NameRecord(Record):
    """A name that an annotation gave."""

    name: str = Field(description="Name of facets or of a region.")
    sure: float = Field(description="How sure it is, from 0 to 1; 1 where nothing else is possible.")
    because: str = Field(description="What it was told by.")
    amount: float = Field(description="Area of the facets, mm2, or volume of the region, mm3.")


class AttemptRecord(Record):
    """A way of reading the boundary that was tried."""

    way: str = Field(description="Its name.")
    taken: bool = Field(description="Whether it was taken.")
    why: str = Field(description="Why, or why not.")
    figures: dict[str, float | int | str] = Field(default_factory=dict, description="What it found.")


class OpeningRecord(Record):
    """An opening of a cavity."""

    name: str = Field(description="Name of the facets of its ring.")
    cavity: str = Field(description="The cavity it opens.")
    centre: tuple[float, float, float] = Field(description="Centre, mm.")
    normal: tuple[float, float, float] = Field(description="Unit normal out of the cavity.")
    area_mm2: float = Field(description="Area, mm2.")


class AnnotationManifest(_Made):
    """What ``run.json`` of an annotated mesh holds."""

    coordinates: str = Field("as in the file", description="World coordinates: those of the mesh that was read.")
    source: str | None = Field(None, description="File name of that mesh; null for one made in memory.")
    source_sha256: str | None = Field(None, description="SHA-256 of that file.")
    source_unit: str = Field(description="Its unit of length, guessed or given.")
    options: AnnotateOptions = Field(description="All options, defaults included.")
    facets: list[NameRecord] = Field(description="Names of facets.")
    regions: list[NameRecord] = Field(description="Names of regions.")
    openings: list[OpeningRecord] = Field(default_factory=list, description="Openings of cavities.")
    thickness_mm: dict[str, float | None] | None = Field(
        None, description="Mean thickness of the wall in each AHA segment by its name, mm; null without segments."
    )
    attempts: list[AttemptRecord] = Field(description="Ways of reading the boundary, in the order they were tried.")
    stages: list[StageRecord] = Field(description="Stages in order.")
    details: dict[str, Any] = Field(default_factory=dict, description="What each stage reports.")
    notices: list[str] = Field(default_factory=list, description="What was repaired, assumed or left out, a line each.")
    files: list[str] = Field(default_factory=list, description="Files of the output folder.")
    sha256: dict[str, str] = Field(
        default_factory=dict, description="SHA-256 of each of them but run.json; a later run replaces no other file."
    )


class PhaseRecord(Record):
    """One phase of a sequence; its own ``run.json`` and ``quality.json`` stand in its folder."""

    name: str = Field(description="Folder of the phase, below phases/.")
    source: str | None = Field(None, description="File name of its label map.")
    sha256: str | None = Field(None, description="SHA-256 of that file.")
    image: ImageRecord | None = Field(None, description="The image that pages show under its outlines.")
    time: float = Field(description="Its time in the series.")
    passed: bool = Field(description="Whether the quality check passed.")
    failures: list[str] = Field(default_factory=list, description="What failed.")
    cavity_ml: float = Field(description="Cavity of the mesh below the base plane, mL.")
    label_cavity_ml: float = Field(description="Voxels of the cavity below the base plane, mL.")
    label_total_ml: float = Field(description="All voxels of the cavity, mL.")
    base_offset_mm: float = Field(
        description="How far below the centre of its last closed ring the base plane lies, so that all phases leave "
        "out the same share of the cavity, mm."
    )
    displacement_mean_mm: float = Field(description="Mean displacement of the nodes from the reference phase, mm.")
    displacement_maximum_mm: float = Field(description="Greatest one, mm.")


class SequenceManifest(_Made):
    """What ``run.json`` of a sequence holds."""

    coordinates: Literal["LPS"] = Field("LPS", description="World coordinates: left, posterior, superior.")
    options: Options | None = Field(None, description="All options of the sequence, defaults included.")
    reference: int = Field(description="Number of the phase the displacements are from.")
    template: dict[str, int | str] = Field(description="Element, columns, rows and layers all phases share.")
    phases: list[PhaseRecord] = Field(description="Phases in order.")
    stages: list[StageRecord] = Field(
        default_factory=list, description="Stages beside those of the phases, which stand in their own records."
    )
    ejection_fraction_percent: float = Field(
        description="Greatest less least cavity of the meshes, per cent of the greatest."
    )
    label_ejection_fraction_percent: float = Field(description="The same of all voxels of the cavity.")
    notices: list[str] = Field(
        default_factory=list,
        description="What was repaired, assumed or extrapolated, a line each: first what holds for every phase, then "
        "with the name of the phase.",
    )
    files: list[str] = Field(default_factory=list, description="Files of the output folder.")
    sha256: dict[str, str] = Field(
        default_factory=dict, description="SHA-256 of each of them but run.json; a later run replaces no other file."
    )


def library_versions() -> dict[str, str]:
    """Versions of the libraries that can change a result."""
    return {name: _version(name) for name in LIBRARIES}


@cache
def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return "not installed"


def hashes(folder: Path, files: Iterable[str]) -> dict[str, str]:
    """SHA-256 of each of a folder's files but ``run.json``, by name."""
    return {name: file_sha256(folder / name) for name in sorted(files) if name != "run.json"}


def file_sha256(path: Path) -> str:
    """SHA-256 of a file, hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def plain(value: Any) -> Any:
    """The same value in plain JSON types: NumPy scalars and arrays, tuples and mappings unwrapped."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, str | int | float | bool) or value is None:
        return value
    return str(value)
