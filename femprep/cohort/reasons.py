"""An error, or failed checks, in; the reason code of the closed list out, with what it means and what to do.

Every way a subject is refused or fails has one row in ``REASONS``. An error is known by its class and by where it was
raised: a module holds one concept, so that its name says what was wrong. A test goes through every ``raise`` a subject
can come to, and wants a row of its own for each.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from femprep.cohort.records import Status
from femprep.errors import FemprepError

#: Code of a subject with nothing wrong.
DONE: Final = "done"


class Reason(NamedTuple):
    """One way a subject can end.

    Attributes
    ----------
    code : str
    status : str
        Status of its row.
    what : str
    remedy : str
    sites : tuple of str
        ``Class module`` or ``Class module:function`` without the package's name; of several that fit, the longest.
    words : str
        Pattern of a failed check's line, for those.
    """

    code: str
    status: Status
    what: str
    remedy: str
    sites: tuple[str, ...] = ()
    words: str = ""


REASONS: Final[tuple[Reason, ...]] = (
    Reason(DONE, "meshed", "The folder is whole and every check passed.", "Nothing."),
    # Failed checks; of several that failed, the first here.
    Reason(
        *("not-solved", "check failed", "CalculiX did not inflate the mesh, or its reaction does not balance."),
        "Look at the worst elements in the report; mesh finer, or by `--mesher sweep`.",
        words=r"^(?:[\w.-]+: )?(?:CalculiX|the reaction on the base)",
    ),
    Reason(
        *("fibres-missing", "check failed", "The mesh is whole, but coordinates, segments or fibres were not made."),
        "The message says why; `--basal-end` and `--mirrored` tell the axes where labels do not.",
        words=r"fibres: not made|: not written:",
    ),
    Reason(
        *("far-from-labels", "check failed", "A surface lies farther from the outlines of its labels than allowed."),
        "Look at the slices in the report: mend the labels, or `--correct-shifts` where slices are shifted.",
        words=r"against the labels of|more volume than its labels|less volume than its labels",
    ),
    Reason(
        *("poor-elements", "check failed", "An element, a facet or the boundary misses a limit of the check."),
        "Look at the worst elements in the report; `--quality best` of fTetWild, another `--edge-length`, or "
        "`--purpose`.",
        words=r".",
    ),
    # Refused: input or options are wrong.
    Reason(
        *("image-unreadable", "refused", "The file is missing, damaged, or no label map in a known format."),
        "Export it again; femprep reads NIfTI, NRRD and MetaImage.",
        ("FileError image", "InputError image.reading"),
    ),
    Reason(
        *("image-geometry", "refused", "Voxel sizes or axes cannot be those of a heart, or are not told."),
        "Correct the header, or give `--spacing`: the line names sizes where a unit explains it.",
        (
            "InputError preflight:check_second_images",
            "InputError image.size",
            "InputError image.grid",
            "InputError image.slices",
            "InputError image.underlay",
        ),
    ),
    Reason(
        *(
            "labels-missing",
            "refused",
            "A structure that is needed has no label, no voxel in this map, or another's label.",
        ),
        "Check the label numbers: `--preset`, `--structure`.",
        (
            *("InputError image.segmentation", "InputError image.object:bounding_box", "InputError wall.planes.stack"),
            *("InputError wall.planes.misnamed:require_order", "InputError image.unnamed"),
        ),
    ),
    Reason(
        *("labels-broken", "refused", "A structure is in pieces, hollow, too small or no ball, and may not be mended."),
        "Mend the labels; `--policy repair` where it was strict.",
        ("InputError image.object", "InputError image", "InputError surface.fit", "InputError surface.harmonic"),
    ),
    Reason(
        *("slice-missing", "refused", "A slice in the middle of a structure holds nothing of it."),
        "Label the slice, or take the labels beyond it away.",
        ("InputError image.pieces:_require_slices",),
    ),
    Reason(
        *(
            "rings-open",
            "refused",
            "Too few slices have a closed ring of myocardium to put the base beyond.",
        ),
        "Close the rings in the labels, from the base down: no option stands in for them.",
        ("InputError wall.planes.base_slice", "InputError wall.planes.landmarks:find_apex"),
    ),
    Reason(
        *("planes-miss", "refused", "The plane of base or apex does not cut the heart as it has to."),
        "Change `--base-offset`, `--basal-end` or `--apex`.",
        (
            *("InputError preflight:_check_planes", "InputError wall.clipping", "InputError wall.planes"),
            *("InputError wall.planes.phase_bases", "InputError model.plane"),
        ),
    ),
    Reason(
        *("axes-unknown", "refused", "The long axis, or where the right ventricle lies, is not told by the labels."),
        "Label the right ventricle, or give `--basal-end` and `--mirrored`, or leave `--fibres` out.",
        ("InputError preflight:check_labels", "InputError anatomy"),
    ),
    Reason(
        *("wall-too-thin", "refused", "The wall is thinner than can be meshed, or the surfaces cross."),
        "Mend the labels where the message says; `--minimum-thickness` pushes the surfaces apart.",
        (
            *("InputError wall.joining", "InputError wall.clipping.thickness", "InputError wall.chambers"),
            *("InputError sweeping", "StageError wall.chambers"),
        ),
    ),
    Reason(
        *("openings-wrong", "refused", "A valve or vein is not where it was given, or not among the labels."),
        "Correct `--valve`, or `--openings`.",
        ("InputError wall.chambers.openings", "InputError wall.chambers.holes"),
    ),
    Reason(
        *("edge-too-long", "refused", "The edge length is more than 1.2 times as long as the wall is thick."),
        "A smaller `--edge-length`.",
        ("OptionError volume.validate",),
    ),
    Reason(
        *("needs-memory", "refused", "What was asked needs more memory than the limit; nothing was begun."),
        "A larger edge length, fewer control points, or a higher `memory_limit`.",
        ("ResourceError ",),
    ),
    Reason(
        *("sizing-wrong", "refused", "The file of edge lengths cannot be read, or does not reach the heart."),
        "Correct the file of `--sizing`.",
        ("InputError volume.sizing", "FileError volume.sizing", "FileError mesh"),
    ),
    Reason(
        *("phases-differ", "refused", "The label maps are no phases of one heart, or too few."),
        "Check which files are one subject's.",
        ("InputError sequence", "InputError sweeping.phases", "InputError export.series"),
    ),
    Reason(
        *("options-wrong", "refused", "An option is unknown, out of range, or contradicts another."),
        "The message names it.",
        ("OptionError ",),
    ),
    Reason(
        *("not-installed", "refused", "A program or library that was asked for is missing on the worker."),
        "Install what the message names, on every worker.",
        ("MissingDependencyError ",),
    ),
    Reason(
        *("folder-in-the-way", "refused", "The subject's folder holds files that would be lost, or cannot be written."),
        "Move them elsewhere, or give another folder with `-o`.",
        ("FileError report", "FileError export", "FileError volume", "InputError export"),
    ),
    Reason(
        *("wall-invalid", "refused", "The wall that was built is open, crosses itself, or has wrong tags."),
        "Mend the labels where the message says; another `--edge-length`, or `--mesher sweep`.",
        ("InputError volume", "InputError model", "InputError mesh", "InputError report"),
    ),
    Reason(
        *("surfaces-broken", "refused", "A surface that was given is open, crosses itself, or lies where it cannot."),
        "Mend it where the message says.",
        ("InputError surface.given", "InputError wall.own", "InputError model.units"),
    ),
    Reason(
        *("activation-impossible", "refused", "Purkinje fibres or times of activation have nothing to begin from."),
        "The message names what is missing: fibres, a place on the endocardium.",
        ("InputError activation",),
    ),
    # Failed on valid input.
    Reason(
        *("surface-not-fitted", "failed", "No way of fitting a surface gave one that is sound."),
        "More `--vertices`, or mend the labels.",
        ("StageError surface", "StageError template", "InputError template", "StageError wall.anatomies"),
    ),
    Reason(
        *("wall-not-built", "failed", "The surfaces could not be cut and joined to a closed wall."),
        "Move the base by `--base-offset`; the message says where it went wrong.",
        ("StageError wall",),
    ),
    Reason(
        *("sweep-failed", "failed", "The layers between the surfaces fold, or could not be matched."),
        "Fewer layers, a larger `--edge-length`, or `--mesher tetwild`.",
        ("StageError sweeping", "StageError mesh"),
    ),
    Reason(
        *("mesher-failed", "failed", "fTetWild crashed, or gave a mesh that is not the wall."),
        "Another `--edge-length`, or `--mesher sweep`.",
        ("StageError volume", "StageError stages.fill:_tetrahedra"),
    ),
    Reason(
        *("mesher-limit", "failed", "fTetWild took more time or memory than its limits."),
        "A longer `--time-limit`, a larger `--edge-length`, or `--mesher sweep`.",
        ("StageError volume.tetwild.guard:_wait", "ResourceError volume.tetwild.guard:_wait"),
    ),
    Reason(
        *("fibres-failed", "failed", "Coordinates or fibres were not solved, or Purkinje fibres not grown."),
        "Another `--edge-length`, or leave `--fibres` or `--purkinje` out.",
        ("StageError anatomy", "StageError activation"),
    ),
    Reason(
        *("disk-full", "failed", "No room was left. The cohort stops, as all that follow would end so."),
        "Free some space and run the same command again: it goes on.",
        ("DiskFullError ",),
    ),
    Reason(
        *("memory-ran-out", "failed", "The system gave no more memory."),
        "Fewer `--workers`, or a larger edge length.",
        ("MemoryError ",),
    ),
    Reason(
        *("unforeseen", "failed", "An error that nobody foresaw."),
        "Send us `failures/SUBJECT.txt` in the cohort's folder, which says where.",
        ("Exception ",),
    ),
    # Set aside by the cohort itself.
    Reason(
        *("worker-lost", "set aside", "Its worker was ended twice while at work on it: by a crash, or from outside."),
        "Mesh it by itself to see what happens; run the same command again to try it once more.",
    ),
    Reason(
        *("time-limit", "set aside", "It took longer than `--subject-time-limit`."),
        "A longer limit, a larger `--edge-length`, or `--mesher sweep`.",
    ),
    Reason(
        *("memory-limit", "set aside", "Its worker took more memory than `--memory-limit`."),
        "Fewer `--workers` with more memory each, or a larger `--edge-length`.",
    ),
)

_BY_CODE: Final = {reason.code: reason for reason in REASONS}


def reason(code: str) -> Reason:
    """The row of a code."""
    return _BY_CODE[code]


def reason_of(error: BaseException) -> Reason:
    """The reason of an error, by its class and where it was raised.

    Parameters
    ----------
    error : exception
        As it was caught, with its traceback. One that was raised again with more words is known by its cause.
    """
    while isinstance(error.__cause__, FemprepError):
        error = error.__cause__
    return reason_at(type(error), *_place(error))


def reason_at(kind: type[BaseException], module: str, function: str) -> Reason:
    """The reason of a class of errors raised in a function of a module, ``wall.joining``; the longest that fits."""
    best, length = _BY_CODE["unforeseen"], (-1, -1)
    names = [cls.__name__ for cls in kind.__mro__]
    for found, name, where in _sites():
        place, _, inside = where.partition(":")
        if name not in names or (inside and inside != function):
            continue
        if place and module != place and not module.startswith(f"{place}."):
            continue
        # The most special class counts first: a full disk is one wherever it is met.
        rank = (-names.index(name), len(where))
        if length == (-1, -1) or rank > length:
            best, length = found, rank
    return best


def reason_of_failures(lines: Iterable[str]) -> str:
    """The code of failed checks: of the first in the list that any line tells."""
    told = list(lines)
    return next(found.code for found in REASONS if found.words and any(re.search(found.words, line) for line in told))


def _sites() -> Iterator[tuple[Reason, str, str]]:
    for found in REASONS:
        for site in found.sites:
            name, _, where = site.partition(" ")
            yield found, name, where


def _place(error: BaseException) -> tuple[str, str]:
    """Module and function of ours in which an error was raised."""
    module, function, trace = "", "", error.__traceback__
    while trace is not None:
        name = trace.tb_frame.f_globals.get("__name__", "")
        if name.startswith("femprep."):
            module, function = name.removeprefix("femprep."), trace.tb_frame.f_code.co_name
        trace = trace.tb_next
    return module, function
