"""A finished run in, its folder of files out: meshes, decks, quality.json, run.json, report.html."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import InputError
from femprep.export import write_facets, write_format, write_mesh, write_purkinje, write_surface, write_wall
from femprep.export.losses import losses
from femprep.image import IntensityImage, Segmentation
from femprep.model import Notice, Progress, VolumeMesh, noted, verdict_of
from femprep.report.beside import beside_voxels
from femprep.report.folder.output_folder import whole_folder
from femprep.report.folder.record import files_with, stage_records, write_record
from femprep.report.manifest import (
    InputRecord,
    RunManifest,
    SurfaceInput,
    VolumeRecord,
    file_sha256,
    plain,
)
from femprep.report.methods import FILES, Words, methods
from femprep.report.notices import lines
from femprep.report.page.fidelity_tables import fidelity_tables, given_table
from femprep.report.page.quality import quality_charts
from femprep.report.page.subject import report_page
from femprep.report.pictures.bullseyes import report_bulls_eyes, thickness_of_segments
from femprep.report.pictures.colours import colour
from femprep.report.pictures.data_pictures import DataPictures, data_pictures, image_notices, image_record, under_labels
from femprep.report.pictures.mesh_picture import drawn_picture
from femprep.report.pictures.raster import address
from femprep.report.pictures.scene import scene
from femprep.report.pictures.shown import Shown, shown
from femprep.report.run import Run, Surfaces
from femprep.report.volumes import voxel_volume
from femprep.volume import QualityReport
from femprep.wall import cavity_surface


def write_run(
    run: Run,
    out: str | Path,
    *,
    source: str | Path | Mapping[str, Path] | None = None,
    image: IntensityImage | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> RunManifest:
    """Write the folder of one run, whole or not at all.

    Parameters
    ----------
    run : Run
        What :func:`femprep.mesh_segmentation` or :func:`femprep.mesh_surfaces` returned.
    out : path
        Folder to make. Of one that femprep made before, the files it wrote are replaced when the new one is whole;
        whatever else the folder holds stays where it is.
    source : path, optional
        The label map the run began with, or its files of surfaces by name; names and hashes go into ``run.json``.
    image : IntensityImage, optional
        The image that the labels were drawn on: the page shows it under the outlines.
    command : str
        What was typed, for ``run.json`` and the page.
    progress : callable, optional
        Called with ``(stage, fraction)``.

    Returns
    -------
    RunManifest
        What ``run.json`` holds.

    Raises
    ------
    FileError
        The folder cannot be written, was not made by femprep, or holds files in the way: those that were changed
        since an earlier run, or that femprep did not write. The folder is then as it was.
    DiskFullError
        There is no room; nothing new is left.
    InputError
        The image and the labels do not lie in one place.

    Examples
    --------
    >>> manifest = fp.write_run(run, "out")  # doctest: +SKIP
    >>> "mesh.vtu" in manifest.files  # doctest: +SKIP
    True
    """
    return written(run, out, source=source, image=image, command=command, progress=progress).manifest


@dataclass(frozen=True, eq=False)
class Written:
    """The record of a folder, and what its page shows of mesh and data."""

    manifest: RunManifest
    view: Shown
    data: DataPictures


def written(
    run: Run,
    out: str | Path,
    *,
    source: str | Path | Mapping[str, Path] | None = None,
    image: IntensityImage | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> Written:
    """Write the folder of one run as :func:`write_run` does, and keep what its page shows."""
    start = time.perf_counter()
    report = progress or (lambda stage, fraction: None)
    report("write", 0.0)
    under = under_labels(run, image)
    with whole_folder(Path(out)) as folder:
        png = folder / ".picture.png"
        view = shown(run.mesh)
        report("write", 0.1)
        with drawn_picture(view.mesh, png) as is_there:
            left_out = _write_vtk(run, folder)
            report("write", 0.4)
            failed = verdict_of(run.mesh).get("failures", {})
            for name in (name for name in run.options.formats if name not in failed):
                write_format(run.mesh, folder, name, options=run.options.export)
            thickness = thickness_of_segments(run.mesh, view.fields)
            write_quality(run.quality, thickness, folder)
            data, volumes, details = data_pictures(run, under), list(run.volumes), _details(run)
            report("write", 0.8)
            content = _content(run, view)
            picture = address(png.read_bytes()) if is_there() else None
        png.unlink(missing_ok=True)
        left_out += [one for name in run.options.formats for one in losses(run.mesh, name)]
        details["formats"] = noted({}, *left_out)
        if run.solution is not None and run.solution.doubt:
            details["solution"] = noted({}, Notice.of("extrapolated", run.solution.doubt))
        if picture is None:
            line = "no picture of the mesh: VTK could not render it here"
            details["report"] = noted({}, Notice.of("left out", line))
        if under is not None:
            details["image"] = {"notices": image_notices(under)}
        stages = {**run.seconds, "write": time.perf_counter() - start}
        manifest = _manifest(run, stages, source, volumes, details, files_with(folder, "report.html", *FILES))
        manifest = manifest.model_copy(
            update={
                "thickness_mm": thickness,
                "image": None if under is None else image_record(under),
                "tissues": run.quality.tissues,
                "solution": run.solution,
                "command": command or None,
            }
        )
        write_methods(methods(manifest, run.quality), folder)
        (folder / "report.html").write_text(
            report_page(manifest, run.quality, data=data, picture=picture, **content),
            encoding="utf-8",
        )
        manifest = write_record(manifest, folder, run.seconds, start)
    report("write", 1.0)
    return Written(manifest, view, data)


def write_surfaces(
    fitted: Surfaces, out: str | Path, *, source: str | Path | None = None, command: str = ""
) -> RunManifest:
    """Write the folder of closed surfaces alone: ``surfaces/*.vtp`` and ``run.json``, whole or not at all.

    Parameters
    ----------
    fitted : Surfaces
        What :func:`femprep.fit_surfaces` returned.
    out, source, command
        As for :func:`write_run`.

    Returns
    -------
    RunManifest

    Raises
    ------
    FileError
        As for :func:`write_run`.

    Examples
    --------
    >>> fitted = fp.fit_surfaces(seg, {"lv": ("lv",)}, fp.Options(surface={"vertices": 500}))
    >>> fp.write_surfaces(fitted, "fitted").files  # doctest: +SKIP
    ['methods.bib', 'methods.md', 'run.json', 'surfaces/lv.vtp']
    """
    start = time.perf_counter()
    with whole_folder(Path(out)) as folder:
        _write_surfaces(fitted.surfaces, folder)
        volumes = [
            beside_voxels(name, surface.volume, voxel_volume(fitted.objects[name], ()))
            for name, surface in fitted.surfaces.items()
        ]
        details = {**_surface_details(fitted), "failures": list(fitted.failures)}
        manifest = _manifest(fitted, fitted.seconds, source, volumes, details, files_with(folder, *FILES))
        manifest = manifest.model_copy(update={"command": command or None})
        write_methods(methods(manifest), folder)
        return write_record(manifest, folder, fitted.seconds, start)


def _write_vtk(run: Run, folder: Path) -> list[Notice]:
    """Meshes and surfaces of a run; what is left out."""
    write_mesh(run.mesh, folder / "mesh.vtu")
    write_facets(run.mesh, folder / "facets.vtp")
    if run.inflated is not None:
        write_mesh(run.inflated, folder / "solution.vtu")
    if run.mesh.purkinje is not None:
        write_purkinje(run.mesh, folder / "purkinje.vtp")
    _write_surfaces(run.surfaces, folder)
    write_wall(run.wall, folder / "wall.vtp")
    return write_cavities(run.mesh, folder)


def _write_surfaces(surfaces: Mapping[str, Any], folder: Path) -> None:
    (folder / "surfaces").mkdir()
    for name, surface in surfaces.items():
        write_surface(surface, folder / "surfaces" / f"{name}.vtp")


def write_cavities(mesh: VolumeMesh, folder: Path) -> list[Notice]:
    """Each cavity's closed surface, of nodes of the mesh, where its rims are whole; what is left out."""
    (folder / "cavities").mkdir()
    left_out = []
    for facets in (name for name in mesh.facet_names if name.startswith("endo")):
        name = "lv" if facets == "endo" else facets.removeprefix("endo_")
        try:
            write_surface(cavity_surface(mesh, name), folder / "cavities" / f"{name}.vtp")
        except InputError as error:
            words = f"the closed surface of the cavity {name} is left out: {error}"
            left_out.append(Notice.of("left out", words))
    return left_out


def write_quality(quality: QualityReport, thickness: dict[str, float | None] | None, folder: Path) -> None:
    """The quality report as a file of a folder, with the thickness of the wall in each segment."""
    found = quality.model_copy(update={"thickness_mm": thickness})
    (folder / "quality.json").write_text(found.model_dump_json(indent=2) + "\n", encoding="utf-8")


def write_methods(words: Words, folder: Path) -> None:
    """The words for a paper and their references, as files of a folder."""
    for name, text in zip(FILES, (words.markdown, words.bibtex), strict=True):
        (folder / name).write_text(text, encoding="utf-8")


def _manifest(
    run: Run | Surfaces,
    seconds: Mapping[str, float],
    source: str | Path | Mapping[str, Path] | None,
    volumes: list[VolumeRecord],
    details: dict[str, Any],
    files: list[str],
) -> RunManifest:
    seg = run.segmentation
    return RunManifest(
        input=_surfaces_in(run, source) if seg is None else _image_in(seg, source),
        options=run.options,
        stages=stage_records(seconds),
        volumes=volumes,
        fidelity=list(run.fidelity.records),
        given_fidelity=list(run.quality.given_fidelity or ()) if isinstance(run, Run) else [],
        details=details,
        notices=lines({} if seg is None else seg.info, details),
        deterministic=not (isinstance(run, Run) and run.options.volume.mesher == "tetwild"),
        files=files,
    )


def _image_in(seg: Segmentation, source: str | Path | Mapping[str, Path] | None) -> InputRecord:
    path = None if source is None or isinstance(source, Mapping) else Path(source)
    return InputRecord(
        path=path.name if path else None,
        sha256=file_sha256(path) if path else None,
        shape=tuple(seg.labels.shape),
        spacing_mm=tuple(float(s) for s in seg.grid.spacing),
        structures={name: list(labels) for name, labels in seg.structures.items()},
        notes={key: value for key, value in plain(seg.info).items() if key != "file"},
    )


def _surfaces_in(run: Run | Surfaces, source: str | Path | Mapping[str, Path] | None) -> InputRecord:
    assert isinstance(run, Run)
    assert run.given is not None
    files = source if isinstance(source, Mapping) else {}
    surfaces = [
        SurfaceInput(
            name=name,
            path=files[name].name if name in files else None,
            sha256=file_sha256(files[name]) if name in files else None,
            unit=run.given.unit,
            points=len(surface.points),
            triangles=len(surface.triangles),
        )
        for name, surface in run.given.surfaces.items()
    ]
    return InputRecord(path=", ".join(one.path for one in surfaces if one.path) or None, surfaces=surfaces)


def _surface_details(run: Run | Surfaces) -> dict[str, Any]:
    from femprep.mesh.measures.triangles import triangle_quality

    found = {}
    for name, surface in run.surfaces.items():
        quality = triangle_quality(surface.points, surface.triangles)
        found[name] = {
            "vertices": len(surface.points),
            "triangles": len(surface.triangles),
            "quality_mean": float(quality.mean()),
            "quality_min": float(quality.min()),
            **plain(surface.info),
        }
    return {"objects": {name: plain(obj.report) for name, obj in run.objects.items()}, "surfaces": found}


def _details(run: Run) -> dict[str, Any]:
    planes = {name: plane.record() for name, plane in run.wall.planes.items()}
    wall = {**plain(run.wall.info), "planes": planes}
    return {**_surface_details(run), "wall": wall, "volume": plain(run.mesh.info)}


def _content(run: Run, view: Shown) -> dict[str, Any]:
    """What the page holds that depends on the run alone."""
    figures = [("points", run.quality.n_points)]
    figures += [(name, count) for name, count in run.quality.cells.items()]
    figures += [
        (f"facets {name}", int(np.sum(run.mesh.facet_tag == tag))) for name, tag in run.mesh.facet_names.items()
    ]
    return {
        "figures": figures,
        "histograms": quality_charts(run.quality),
        "fidelity": (
            given_table(run.quality.given_fidelity or ())
            if run.given is not None
            else fidelity_tables(run.fidelity.records, run.options.limits.maximum_label_distance)
        ),
        "bulls_eyes": report_bulls_eyes(run.mesh, view.fields),
        "colours": {name: colour(name) for name in run.mesh.facet_names},
        "scene": scene(view, run.quality),
    }
