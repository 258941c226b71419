"""The table of commands."""

from __future__ import annotations

from typing import Annotated

import typer

from femprep import __version__
from femprep.cli.check import check
from femprep.cli.compare import compare
from femprep.cli.convert import convert
from femprep.cli.demo import demo
from femprep.cli.mesh import mesh
from femprep.cli.schema import schema
from femprep.cli.surface import surface

app = typer.Typer(
    name="femprep",
    help="From a segmented cardiac image to a finite element mesh a solver accepts.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)


def _version(value: bool) -> None:
    if value:
        typer.echo(f"femprep {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """From a segmented cardiac image to a finite element mesh a solver accepts."""


app.command()(mesh)
app.command()(surface)
app.command()(check)
app.command()(convert)
app.command()(compare)
app.command()(demo)
app.command(hidden=True)(schema)
