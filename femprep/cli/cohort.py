"""``femprep cohort``: many subjects, with a table and a page over all."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from femprep.cli import _arguments as shared
from femprep.cli._arguments import INPUT, OUTPUT
from femprep.cli._fields import takes_options_of
from femprep.cli._mesh_runs import typed
from femprep.cli.mesh import mesh_options
from femprep.errors import OptionError

WORK = "Work"


@takes_options_of(mesh_options)
def cohort(
    subjects: Annotated[
        Path,
        typer.Argument(
            metavar="IN",
            help="Folder of label maps; or a table, .tsv: columns subject, image, phase, and any option by its name in "
            "a configuration file, as volume.edge_length.",
        ),
    ],
    out: shared.Out,
    pattern: Annotated[
        str, typer.Option(help="Which files of the folder are label maps.", rich_help_panel=INPUT)
    ] = "**/*.nii.gz",
    surfaces: Annotated[
        bool,
        typer.Option("--surfaces", help="Closed surfaces alone, as femprep surface.", rich_help_panel=INPUT),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(help="Processes of this machine. [dim]\\[default: one for each core][/dim]", rich_help_panel=WORK),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT",
            help="A Dask scheduler that is there, in place of processes of this machine; its workers see IN and OUT "
            "under the same names.",
            rich_help_panel=WORK,
        ),
    ] = None,
    memory_limit: Annotated[
        float | None,
        typer.Option(
            help="GB that a worker and the mesher it runs may take. [dim]\\[default: an even share of the "
            "machine][/dim]",
            rich_help_panel=WORK,
        ),
    ] = None,
    subject_time_limit: Annotated[
        float | None,
        typer.Option(help="Seconds that a subject may take. [dim]\\[default: none][/dim]", rich_help_panel=WORK),
    ] = None,
    fresh: Annotated[
        bool,
        typer.Option("--fresh", help="Make all anew, also what is done already.", rich_help_panel=WORK),
    ] = False,
    quiet: shared.Quiet = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print the record of the cohort as JSON.", rich_help_panel=OUTPUT)
    ] = False,
    **given: Any,
) -> int:
    """Mesh many subjects, on this machine or a cluster, with a table and a page over all.

    Makes the folder OUT: for each subject a folder as femprep mesh makes it, or mesh --sequence where the label maps
    in one folder, or under one name, are phases of one heart; cohort.tsv and cohort.json with a row for each, status,
    reason and figures, written as subjects end; timings.tsv; and cohort.html. Run again, it goes on: a folder counts
    when its input, options and version are those asked for. The exit status is 1 where a subject was refused, failed
    or did not pass its checks.
    """
    options = mesh_options(**given)
    if surfaces and given["sequence"]:
        raise OptionError("--surfaces and --sequence are two things; leave one out")
    for name, value in (("memory-limit", memory_limit), ("subject-time-limit", subject_time_limit)):
        if value is not None and not value > 0:
            raise OptionError(f"--{name} is {value:g}; a number above 0 is needed")

    from femprep.cli._progress import bars
    from femprep.cohort.cluster import require_distributed
    from femprep.cohort.subjects import Kind, read_subjects
    from femprep.export import require_formats
    from femprep.preflight import check_options

    require_distributed()
    kind: Kind = "surfaces" if surfaces else "sequence" if given["sequence"] else "mesh"
    found = read_subjects(subjects, options, pattern=pattern, kind=kind)
    for chosen in {subject.options.model_dump_json(): subject.options for subject in found}.values():
        require_formats(chosen.formats)
        if not surfaces:
            check_options(chosen)

    from femprep.cohort import run_cohort

    try:
        with bars(quiet or json) as progress:
            made = run_cohort(
                found,
                out,
                options,
                workers=workers,
                scheduler=scheduler,
                memory_limit=memory_limit,
                time_limit=subject_time_limit,
                fresh=fresh,
                command=typed(),
                progress=progress,
            )
    except KeyboardInterrupt as stopped:
        if stopped.args:
            typer.echo(f"femprep: {stopped}", err=True)
        raise
    if json:
        typer.echo(made.record.model_dump_json(indent=2))
    elif not quiet:
        from femprep.cli._summary import print_cohort

        print_cohort(made, out)
    return 0 if set(made.record.counts) <= {"meshed"} else 1
