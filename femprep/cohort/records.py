"""The records of a cohort: a row per subject, ``cohort.json`` over all, and what each row took."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from femprep import __version__
from femprep.model.record import Record
from femprep.options import Options

Status = Literal["meshed", "check failed", "refused", "failed", "set aside"]


class SubjectRecord(Record):
    """What became of one subject. Nothing in it depends on when, where or how quickly it was made."""

    subject: str = Field(description="Its name, and that of its folder.")
    kind: Literal["mesh", "sequence", "surfaces"] = Field(description="What was made of it.")
    status: Status = Field(
        description="Meshed; meshed, but a check failed; refused, as input or options are wrong; failed on valid "
        "input; set aside, as it stopped its worker twice or took more than a limit."
    )
    exit_status: int = Field(description="Exit status that femprep mesh has for it.")
    reason: str = Field(description="Why, by a code of the list of reasons; done where nothing is wrong.")
    message: str = Field("", description="The same in words: one line.")
    images: list[str] = Field(description="Files of its label maps.")
    sha256: list[str] = Field(default_factory=list, description="Their hashes.")
    cavity_ml: float | None = Field(None, description="Cavity of the left ventricle below the base, mL.")
    label_cavity_ml: float | None = Field(None, description="The same of its voxels, mL.")
    rv_cavity_ml: float | None = Field(None, description="Cavity of the right ventricle, mL.")
    wall_ml: float | None = Field(None, description="Wall of the left ventricle, with the septum, mL.")
    mass_g: float | None = Field(None, description="Its mass at 1.05 g/mL, g.")
    ejection_fraction_percent: float | None = Field(None, description="Of the meshes of a sequence, %.")
    label_ejection_fraction_percent: float | None = Field(None, description="Of its voxels, %.")
    thickness_mm: list[float | None] | None = Field(
        None, description="Mean thickness of the wall in each AHA segment, mm; where fibres were asked for."
    )
    points: int | None = Field(None, description="Points of the mesh.")
    elements: int | None = Field(None, description="Elements of the mesh.")
    surface_quality_mean: float | None = Field(None, description="Triangles of the fitted surfaces: lowest mean Q.")
    surface_quality_min: float | None = Field(None, description="Least Q of a triangle.")
    label_distance_mean_pixels: float | None = Field(
        None, description="Greatest mean distance of a surface to its labels' outlines, pixels."
    )
    label_distance_max_pixels: float | None = Field(None, description="Greatest distance, pixels.")
    mean_ratio_min: float | None = Field(None, description="Least mean ratio of an element.")
    mean_ratio_mean: float | None = Field(None, description="Mean of it.")
    scaled_jacobian_min: float | None = Field(None, description="Least scaled Jacobian.")
    dihedral_min_degrees: float | None = Field(None, description="Smallest dihedral angle, degrees.")
    solved: bool | None = Field(None, description="Whether it was inflated, by strains its material is valid for.")
    solved_displacement_mm: float | None = Field(None, description="Greatest displacement, mm.")
    solved_cavity_ml: float | None = Field(None, description="Cavities inflated, mL.")
    solved_strain: float | None = Field(None, description="Principal strain that 99 % of the wall stays below.")
    solved_misfit: float | None = Field(None, description="Misfit of reaction and load, as a share of the load.")
    notices: list[str] = Field(default_factory=list, description="What was repaired, assumed or extrapolated.")


class CohortRecord(Record):
    """What ``cohort.json`` holds. Times and memory are in ``timings.tsv``: this is the same for the same work."""

    femprep: str = Field(__version__, description="Version of femprep.")
    length_unit: Literal["mm"] = Field("mm", description="Unit of all lengths.")
    options: Options = Field(description="Options of all; a table's columns may have changed those of a subject.")
    asked: int = Field(description="Subjects asked for; those without a row were not reached.")
    counts: dict[str, int] = Field(description="Subjects by status.")
    reasons: dict[str, int] = Field(description="Subjects by reason.")
    solved: int | None = Field(None, description="Subjects that were solved; null where none was asked to be.")
    subjects: list[SubjectRecord] = Field(description="Rows by name.")


class Timing(Record):
    """What a row took: the one part of a cohort that differs from run to run."""

    subject: str = Field(description="Name of the subject.")
    seconds: float = Field(description="From its label map to its folder, by the clock, s.")
    stages_seconds: float | None = Field(None, description="Sum over its stages, s.")
    peak_memory_mb: float | None = Field(
        None, description="Greatest memory of its worker and the worker's children, MB."
    )
    attempts: int = Field(1, description="How often it was begun: more than once where its worker was lost.")
