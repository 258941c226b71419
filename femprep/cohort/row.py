"""The folder of a subject in, its row of the cohort's table out: of a folder made just now or long ago alike."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from femprep.cohort.reasons import DONE, reason_of_failures
from femprep.cohort.records import SubjectRecord, Timing
from femprep.cohort.subjects import Subject

#: Density of the myocardium, g/mL.
_DENSITY: Final = 1.05


def row_of_folder(subject: Subject, folder: Path) -> SubjectRecord:
    """The row of a subject whose folder is whole.

    Parameters
    ----------
    subject : Subject
    folder : path
        Its folder; of a sequence, figures are those of the reference phase, quality the worst of all phases.

    Returns
    -------
    SubjectRecord
    """
    record = _read(folder / "run.json")
    runs = _runs(record, folder)
    main = runs[record.get("reference", 0)]
    quality = [_read(path.with_name("quality.json")) for path, _ in runs if path.with_name("quality.json").is_file()]
    failures = _failures(record, quality)
    reason = reason_of_failures(failures) if failures else DONE
    return SubjectRecord(
        subject=subject.name,
        kind=subject.kind,
        status="check failed" if failures else "meshed",
        exit_status=1 if failures else 0,
        reason=reason,
        message="; ".join(failures),
        images=[image.name for image in subject.images],
        sha256=[run["input"]["sha256"] for _, run in runs],
        ejection_fraction_percent=record.get("ejection_fraction_percent"),
        label_ejection_fraction_percent=record.get("label_ejection_fraction_percent"),
        notices=record["notices"],
        **_volumes(main[1]),
        **_surfaces([run for _, run in runs]),
        **_elements(quality),
        **_solution([run for _, run in runs]),
        thickness_mm=None if (thick := main[1].get("thickness_mm")) is None else list(thick.values()),
    )


def timing_of_folder(subject: Subject, folder: Path) -> Timing:
    """What the stages of a folder took that was made by an earlier run whose timings are lost."""
    stages = stage_seconds(folder)
    return Timing(subject=subject.name, seconds=stages, stages_seconds=stages)


def stage_seconds(folder: Path) -> float:
    """Seconds of all stages of a folder's runs."""
    record = _read(folder / "run.json")
    own = [record] if "phases" in record else []
    runs = [*own, *(run for _, run in _runs(record, folder))]
    return round(sum(float(stage["seconds"]) for run in runs for stage in run["stages"]), 3)


def _read(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_bytes())
    return found


def _runs(record: dict[str, Any], folder: Path) -> list[tuple[Path, dict[str, Any]]]:
    """Records of a folder's runs, with their paths: its own, or those of its phases."""
    paths = [folder / "phases" / phase["name"] / "run.json" for phase in record.get("phases", ())]
    return [(path, _read(path)) for path in paths or [folder / "run.json"]]


def _failures(record: dict[str, Any], quality: list[dict[str, Any]]) -> list[str]:
    if "phases" in record:
        return [f"{phase['name']}: {line}" for phase in record["phases"] for line in phase["failures"]]
    if not quality:  # surfaces alone, which are judged by their distance to the labels
        return list(record["details"].get("failures", ()))
    return list(quality[0]["failures"])


def _volumes(run: dict[str, Any]) -> dict[str, Any]:
    volumes = {item["name"]: item for item in run["volumes"]}
    cavity = volumes.get("cavity") or volumes.get("lv cavity") or volumes.get("lv") or {}
    wall = volumes.get("wall") or volumes.get("lv wall and septum") or {}
    wall_ml = wall.get("mesh_ml")
    return {
        "cavity_ml": cavity.get("mesh_ml"),
        "label_cavity_ml": cavity.get("segmentation_ml"),
        "rv_cavity_ml": (volumes.get("rv cavity") or {}).get("mesh_ml"),
        "wall_ml": wall_ml,
        "mass_g": None if wall_ml is None else _DENSITY * wall_ml,
    }


def _surfaces(runs: list[dict[str, Any]]) -> dict[str, Any]:
    fitted = [surface for run in runs for surface in run["details"].get("surfaces", {}).values()]
    distances = [item for run in runs for item in run["fidelity"]]
    return {
        "surface_quality_mean": min((surface["quality_mean"] for surface in fitted), default=None),
        "surface_quality_min": min((surface["quality_min"] for surface in fitted), default=None),
        "label_distance_mean_pixels": max((item["mean_pixels"] for item in distances), default=None),
        "label_distance_max_pixels": max((item["greatest_pixels"] for item in distances), default=None),
    }


def _elements(quality: list[dict[str, Any]]) -> dict[str, Any]:
    if not quality:
        return {}
    measures = [item["measures"] for item in quality]

    def least(name: str, figure: str = "min") -> float | None:
        return min((item[name][figure] for item in measures if name in item), default=None)

    return {
        "points": quality[0]["n_points"],
        "elements": sum(quality[0]["cells"].values()),
        "mean_ratio_min": least("mean_ratio"),
        "mean_ratio_mean": least("mean_ratio", "mean"),
        "scaled_jacobian_min": least("scaled_jacobian"),
        "dihedral_min_degrees": least("minimum_dihedral"),
    }


def _solution(runs: list[dict[str, Any]]) -> dict[str, Any]:
    found = [run["solution"] for run in runs if run.get("solution")]
    if not found:
        return {}
    inflated = [one["inflated_ml"] for one in found[0]["cavities"]]
    return {
        "solved": all(item["status"] == "solved" for item in found),
        "solved_displacement_mm": found[0]["greatest_displacement_mm"],
        "solved_cavity_ml": None if None in inflated else sum(inflated),
        "solved_strain": max((s for item in found if (s := item["strain"]) is not None), default=None),
        "solved_misfit": max((m for item in found if (m := item["reaction_misfit"]) is not None), default=None),
    }
