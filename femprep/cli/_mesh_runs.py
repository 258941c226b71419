"""Input and options in, the folder of a run out, with its summary on the screen: what the command ``mesh`` runs."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from femprep.cli._names import mesh_names, sequence_names
from femprep.model.image_file import ImageFile
from femprep.options import Options

#: File of a second label map, labels of its tissues, and images to sample by the name of their field.
SecondImages = tuple[Path | None, dict[str, tuple[int | str, ...]], dict[str, Path]]


def mesh_own(
    surfaces: dict[str, Path], out: Path, options: Options, *, quiet: bool, json: bool, second: SecondImages
) -> int:
    """Run the main job on surfaces; the exit status is 1 where the quality check fails."""
    from femprep.cli._progress import bars
    from femprep.export import require_formats
    from femprep.report.folder.output_folder import require_writable

    require_formats(options.formats)
    require_writable(out, mesh_names(options.formats))

    from femprep.own_surfaces import mesh_surfaces
    from femprep.report.output import write_run
    from femprep.surface import read_surface

    with bars(quiet or json) as progress:
        given = {name: read_surface(path) for name, path in surfaces.items()}
        run = mesh_surfaces(given, options, progress=progress, **read_second(second, options))
        command = shlex.join(["femprep", *sys.argv[1:]])
        manifest = write_run(run, out, source=surfaces, command=command, progress=progress)
    return _told(run, manifest, out, quiet=quiet, json=json)


def mesh_phases(
    paths: list[Path], out: Path, options: Options, *, quiet: bool, json: bool, images: Sequence[ImageFile] = ()
) -> int:
    """Run the main job on the phases of one heart, files or frames of one; the exit status is 1 where a phase fails."""
    from femprep.cli._progress import bars
    from femprep.export import require_formats
    from femprep.report.folder.output_folder import require_writable

    require_formats(options.formats)
    require_writable(out)

    from femprep.image import read_frames, read_segmentation
    from femprep.image.underlay import read_under
    from femprep.model.stages import Stages
    from femprep.report.sequence_output import phase_names, write_sequence
    from femprep.sequence import mesh_sequence

    names = phase_names(paths)
    if len(paths) > 1:
        require_writable(out, sequence_names(names, options.formats))

    with bars(quiet or json) as progress:
        stages = Stages(progress)
        with stages("read"):
            if len(paths) > 1:
                phases = [read_segmentation(path, structures=options.labels, options=options.image) for path in paths]
                times = [float(number) for number in range(len(paths))]
            else:
                frames = read_frames(paths[0], options.labels, options=options.image)
                names, phases = [f"frame{number:03d}" for number in frames], list(frames.values())
                times = [float(number) for number in frames]
                require_writable(out, sequence_names(names, options.formats))
            shown = [read_under(seg, image, options) for seg, image in zip(phases, images)] or None
        found = mesh_sequence(phases, options, times=times, progress=progress)
        found = replace(found, seconds={**stages.seconds, **found.seconds})
        sources = paths if len(paths) > 1 else paths * len(phases)
        command = shlex.join(["femprep", *sys.argv[1:]])
        manifest = write_sequence(
            found, out, sources=sources, names=names, images=shown, command=command, progress=progress
        )
    if json:
        typer.echo(manifest.model_dump_json(indent=2))
    elif not quiet:
        from femprep.cli._summary import print_sequence

        print_sequence(manifest, out)
    return 0 if found.passed else 1


def mesh_file(
    segmentation: Path | dict[str, list[Path]],
    out: Path,
    options: Options,
    *,
    quiet: bool,
    json: bool,
    second: SecondImages = (None, {}, {}),
    image: ImageFile | None = None,
) -> int:
    """Run the main job on one file and print its summary; the exit status is 1 where the quality check fails."""
    from femprep.cli._progress import bars
    from femprep.export import require_formats
    from femprep.report.folder.output_folder import require_writable

    # What can be wrong without any computing is found before anything else.
    require_formats(options.formats)
    require_writable(out, mesh_names(options.formats))

    from femprep.image import read_masks, read_segmentation
    from femprep.image.underlay import read_under
    from femprep.model.stages import Stages

    with bars(quiet or json) as progress:
        stages = Stages(progress)
        with stages("read"):
            if isinstance(segmentation, dict):
                seg, source = read_masks(segmentation, options=options.image), None
            else:
                preset = "slicer" if options.preset == "slicer" else None
                seg = read_segmentation(segmentation, options.labels, preset, options=options.image)
                source = segmentation
            further = read_second(second, options)
            shown = None if image is None else read_under(seg, image, options)
        before = stages.seconds
        run, manifest = mesh_and_write(
            seg, out, options, source=source, image=shown, before=before, progress=progress, **further
        )
    return _told(run, manifest, out, quiet=quiet, json=json)


def read_second(second: SecondImages, options: Options) -> dict[str, Any]:
    """The tissue and the images to sample, as the pipelines take them."""
    from femprep.image import read_image, read_segmentation

    regions, tissues, images = second
    resample = options.image.resample
    return {
        "tissue": read_segmentation(regions, structures=tissues, resample=resample) if regions else None,
        "images": {name: read_image(path, resample=resample) for name, path in images.items()},
    }


def mesh_and_write(
    seg: Any,
    out: Path,
    options: Options,
    *,
    source: Path | None,
    before: dict[str, float],
    progress: Any,
    image: Any = None,
    **second: Any,
) -> tuple[Any, Any]:
    """The pipeline, then its folder; ``before`` are the seconds of earlier stages."""
    from femprep.pipeline import mesh_segmentation
    from femprep.report.output import write_run

    run = mesh_segmentation(seg, options, progress=progress, **second)
    run = replace(run, seconds={**before, **run.seconds})
    command = shlex.join(["femprep", *sys.argv[1:]])
    return run, write_run(run, out, source=source, image=image, command=command, progress=progress)


def _told(run: Any, manifest: Any, out: Path, *, quiet: bool, json: bool) -> int:
    """Print what a run came to, as asked; its exit status."""
    if json:
        from json import dumps

        record = {"run": manifest.model_dump(mode="json"), "quality": run.quality.model_dump(mode="json")}
        typer.echo(dumps(record, indent=2))
    elif not quiet:
        from femprep.cli._summary import print_summary

        print_summary(run, manifest, out)
    return 0 if run.quality.passed else 1
