"""An annotated mesh in, its folder of files out: mesh, decks, quality.json, run.json, report.html, methods.md."""

from __future__ import annotations

import time
from pathlib import Path

from femprep.annotation import Annotation
from femprep.annotation.shell import shell_of
from femprep.export import write_facets, write_format, write_mesh
from femprep.export.losses import losses
from femprep.mesh.measures.volume_elements import all_volumes
from femprep.model import Progress, noted, verdict_of
from femprep.model.markup import escape
from femprep.report.folder.output_folder import whole_folder
from femprep.report.folder.record import files_with, stage_records, write_record
from femprep.report.manifest import (
    AnnotationManifest,
    AttemptRecord,
    NameRecord,
    OpeningRecord,
    file_sha256,
    plain,
)
from femprep.report.methods import FILES
from femprep.report.methods.annotation import annotation_methods
from femprep.report.notices import lines
from femprep.report.output import write_cavities, write_methods, write_quality
from femprep.report.page.quality import write_quality_page
from femprep.report.page.subject import table
from femprep.report.pictures.bullseyes import report_bulls_eyes, thickness_of_segments
from femprep.report.pictures.colours import SCALE
from femprep.report.pictures.scene import scene
from femprep.report.pictures.shown import Shown, shown
from femprep.report.templates import render


def write_annotation(
    found: Annotation,
    out: str | Path,
    *,
    source: str | Path | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> AnnotationManifest:
    """Write the folder of an annotated mesh, whole or not at all.

    Parameters
    ----------
    found : Annotation
        What :func:`femprep.annotate` returned.
    out : path
        Folder to make; of one that femprep made before, the files it wrote are replaced.
    source : path, optional
        The file of the mesh; its name and hash go into ``run.json``.
    command : str
        What was typed, for ``run.json`` and the page.
    progress : callable, optional
        Called with ``(stage, fraction)``.

    Returns
    -------
    AnnotationManifest
        What ``run.json`` holds.

    Raises
    ------
    FileError
        The folder cannot be written, or was not made by femprep.

    Examples
    --------
    >>> manifest = fp.write_annotation(fp.annotate(mesh), "named")  # doctest: +SKIP
    """
    start = time.perf_counter()
    report = progress or (lambda stage, fraction: None)
    report("write", 0.0)
    path = Path(source) if source is not None else None
    with whole_folder(Path(out)) as folder:
        write_mesh(found.mesh, folder / "mesh.vtu")
        write_facets(found.mesh, folder / "facets.vtp")
        left_out = write_cavities(found.mesh, folder)
        for name in found.options.formats:
            write_format(found.mesh, folder, name, options=found.options.export)
        view = shown(found.mesh)
        thickness = thickness_of_segments(found.mesh, view.fields)
        write_quality(found.quality, thickness, folder)
        details = {"mesh": plain(found.mesh.info)}
        details["formats"] = noted(
            {}, *left_out, *(one for name in found.options.formats for one in losses(found.mesh, name))
        )
        failed = [line for own in verdict_of(found.mesh).get("failures", {}).values() for line in own]
        seconds = {**found.seconds, "write": time.perf_counter() - start}
        facets, regions = _names(found)
        manifest = AnnotationManifest(
            command=command or None,
            source=path.name if path else None,
            source_sha256=file_sha256(path) if path and path.is_file() else None,
            source_unit=found.unit,
            options=found.options,
            facets=facets,
            regions=regions,
            openings=[
                OpeningRecord(
                    name=one.name,
                    cavity=one.cavity,
                    centre=tuple(round(float(x), 3) for x in one.centre),
                    normal=tuple(round(float(x), 4) for x in one.normal),
                    area_mm2=round(one.area, 1),
                )
                for one in found.openings
            ],
            attempts=[
                AttemptRecord(way=a.way, taken=a.taken, why=a.why, figures=dict(a.figures)) for a in found.attempts
            ],
            thickness_mm=thickness,
            stages=stage_records(seconds),
            details=details,
            notices=[*lines({}, details), *failed],
            files=files_with(folder, "report.html", *FILES),
        )
        words = annotation_methods(manifest, found.quality)
        write_methods(words, folder)
        write_quality_page(
            found.quality,
            folder / "report.html",
            title=manifest.source or "mesh",
            before=_page(manifest, found, view, words.plain),
        )
        manifest = write_record(manifest, folder, found.seconds, start)
    report("write", 1.0)
    return manifest


def _names(found: Annotation) -> tuple[list[NameRecord], list[NameRecord]]:
    shell = shell_of(found.mesh)
    area = {name: float(shell.area[found.mesh.facet_tag == tag].sum()) for name, tag in found.mesh.facet_names.items()}
    size = all_volumes(found.mesh.points, found.mesh.cells)
    volume = {name: float(size[found.mesh.region == tag].sum()) for name, tag in found.mesh.region_names.items()}

    def records(amounts: dict[str, float]) -> list[NameRecord]:
        told = [(name, amount, found.names.get(name)) for name, amount in amounts.items()]
        return [
            NameRecord(
                name=name,
                sure=round(own.sure, 4) if own else 0.5,
                because=own.because if own else "the facets around it",
                amount=round(amount, 2),
            )
            for name, amount, own in told
        ]

    return records(area), records(volume)


def _page(manifest: AnnotationManifest, found: Annotation, view: Shown, words: str) -> str:
    def rows(records: list[NameRecord]) -> list[tuple[object, ...]]:
        return [(one.name, f"{100 * one.sure:.0f} %", one.amount, one.because) for one in records]

    ways = [(one.way, "taken" if one.taken else "not taken", one.why) for one in manifest.attempts]
    notices = "".join(f"<li>{escape(item)}</li>" for item in manifest.notices) or "<li>Nothing.</li>"
    eyes = report_bulls_eyes(found.mesh, view.fields)
    content = {"scene": scene(view, found.quality), "scale": SCALE}
    made = f"femprep {manifest.femprep}, {manifest.date}: {manifest.command or 'from Python'}"
    segments = f'<h2>AHA segments</h2><div class="grid">{"".join(eyes)}</div>' if eyes else ""
    return (
        f'<h2 id="view">The mesh</h2>{render("view.html", **content)}{render("scripts.html", **content)}'
        f"<h2>Facets</h2>{table(rows(manifest.facets), ('', 'sure', 'area, mm2', 'told by'))}"
        f"<h2>Regions</h2>{table(rows(manifest.regions), ('', 'sure', 'volume, mm3', 'told by'))}"
        f"<h2>Ways of reading the boundary</h2>{table(ways)}"
        f"<h2>What was repaired, assumed or left out</h2><ul>{notices}</ul>{segments}"
        f"<h2>For a paper</h2><p>{escape(words)}</p><p>With citation keys in {FILES[0]}; references in {FILES[1]}.</p>"
        f"<h2>How it was made</h2><p>{escape(made)}</p>"
    )
