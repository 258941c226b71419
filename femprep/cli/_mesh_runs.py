"""Input and options in, the folder of a run out, with its summary on the screen: what the command ``mesh`` runs."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from femprep.cli._names import mesh_names, require_output, sequence_names
from femprep.errors import OptionError
from femprep.model.image_file import ImageFile, piece_of
from femprep.options import Options

if TYPE_CHECKING:
    from femprep.image import Segmentation

#: File of a second label map, labels of its tissues, and images to sample by the name of their field.
SecondImages = tuple[Path | None, dict[str, tuple[int | str, ...]], dict[str, Path]]


def typed() -> str:
    """The command as it was typed, for records and pages."""
    return shlex.join(["femprep", *sys.argv[1:]])


def mesh_own(
    surfaces: dict[str, Path], out: Path, options: Options, *, quiet: bool, json: bool, second: SecondImages
) -> int:
    """Run the main job on surfaces; the exit status is 1 where the quality check fails."""
    require_output(out, options.formats, partial(mesh_names, solve=options.solve))

    from femprep.annotation.pieces import read_piece, read_surfaces
    from femprep.cli._progress import bars
    from femprep.own_surfaces import mesh_surfaces
    from femprep.report.output import write_run

    with bars(quiet or json) as progress:
        if "1" in surfaces:
            given = read_surfaces(*surfaces.values())
            surfaces = dict.fromkeys(given, next(iter(surfaces.values()))) if len(surfaces) == 1 else surfaces
        else:
            given = {name: read_piece(path) for name, path in surfaces.items()}
        surfaces = {name: piece_of(path)[0] for name, path in surfaces.items()}
        run = mesh_surfaces(given, options, progress=progress, **_read_second(second, options))
        manifest = write_run(run, out, source=surfaces, command=typed(), progress=progress)
    return _told(run, manifest, out, quiet=quiet, json=json)


def mesh_phases(
    paths: list[Path], out: Path, options: Options, *, quiet: bool, json: bool, images: Sequence[ImageFile] = ()
) -> int:
    """Run the main job on the phases of one heart, files or frames of one; the exit status is 1 where a phase fails.

    Without paths, on the files of contours that the options name.
    """
    require_output(out, options.formats)

    from femprep.cli._progress import bars
    from femprep.image import read_frames, read_segmentation
    from femprep.image.reading.contours import contour_files
    from femprep.image.reading.long_axis import require_one_phase
    from femprep.image.underlay import read_under
    from femprep.model.stages import Stages
    from femprep.report.sequence_output import phase_names, write_sequence
    from femprep.sequence import mesh_sequence

    drawn = [] if paths else list(contour_files(options.image.contours, options.image.frame))
    if len(drawn) == 1:
        raise OptionError("--sequence takes the contours of several phases, a file for each: --contours 'GPFile_*.txt'")
    paths = paths or [path for path, _ in drawn]
    require_one_phase(options.image.long_axis + (() if drawn else options.image.contours), len(paths))
    names = phase_names(paths)
    if len(paths) > 1:
        require_output(out, options.formats, partial(sequence_names, names))

    with bars(quiet or json) as progress:
        stages = Stages(progress)
        with stages("read"):
            if drawn:
                phases = [contours.to_segmentation() for _, contours in drawn]
                times = [float(number) for number in range(len(paths))]
            elif len(paths) > 1:
                phases = [read_segmentation(path, options.structures, options.preset, options.image) for path in paths]
                times = [float(number) for number in range(len(paths))]
            else:
                frames = read_frames(paths[0], options.structures, options.preset, options.image)
                names, phases = [f"frame{number:03d}" for number in frames], list(frames.values())
                times = [float(number) for number in frames]
                require_output(out, options.formats, partial(sequence_names, names))
            shown = [read_under(seg, image, options) for seg, image in zip(phases, images)] or None
        found = mesh_sequence(phases, options, times=times, progress=progress)
        found = replace(found, seconds={**stages.seconds, **found.seconds})
        sources = paths if len(paths) > 1 else paths * len(phases)
        manifest = write_sequence(
            found, out, sources=sources, names=names, images=shown, command=typed(), progress=progress
        )
    if json:
        typer.echo(manifest.model_dump_json(indent=2))
    elif not quiet:
        from femprep.cli._summary import print_sequence

        print_sequence(manifest, out)
    return 0 if found.passed else 1


def mesh_file(
    segmentation: Path | dict[str, list[Path]] | None,
    out: Path,
    options: Options,
    *,
    quiet: bool,
    json: bool,
    second: SecondImages = (None, {}, {}),
    image: ImageFile | None = None,
) -> int:
    """Run the main job on one file and print its summary; the exit status is 1 where the quality check fails.

    Without a file, on the contours that the options name.
    """
    require_output(out, options.formats, partial(mesh_names, solve=options.solve))

    from femprep.cli._progress import bars
    from femprep.image import read_masks, read_segmentation
    from femprep.image.underlay import read_under
    from femprep.model.stages import Stages

    with bars(quiet or json) as progress:
        stages = Stages(progress)
        with stages("read"):
            if isinstance(segmentation, dict):
                seg, source = read_masks(segmentation, options=options.image), None
            elif segmentation is None:
                source, seg = read_contours_alone(options)
            else:
                seg = read_segmentation(segmentation, options.structures, options.preset, options.image)
                source = segmentation
            further = _read_second(second, options)
            shown = None if image is None else read_under(seg, image, options)
        from femprep.pipeline import mesh_segmentation
        from femprep.report.output import write_run

        run = mesh_segmentation(seg, options, progress=progress, **further)
        run = replace(run, seconds={**stages.seconds, **run.seconds})
        manifest = write_run(run, out, source=source, image=shown, command=typed(), progress=progress)
    return _told(run, manifest, out, quiet=quiet, json=json)


def read_contours_alone(options: Options) -> tuple[Path, Segmentation]:
    """The file of contours that options name in place of a label map, and its labels.

    Raises
    ------
    FileError, InputError, OptionError
    """
    from femprep.image.reading.contours import contour_files

    found = list(contour_files(options.image.contours, options.image.frame))
    if len(found) > 1:
        raise OptionError(f"--contours names {len(found)} files; add --sequence where they are phases of one heart")
    path, contours = found[0]
    return path, contours.to_segmentation()


def _read_second(second: SecondImages, options: Options) -> dict[str, Any]:
    """The tissue and the images to sample, as the pipelines take them."""
    from femprep.image import read_image, read_segmentation

    regions, tissues, images = second
    return {
        "tissue": read_segmentation(regions, structures=tissues) if regions else None,
        "images": {name: read_image(path) for name, path in images.items()},
    }


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
