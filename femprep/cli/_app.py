"""The table of commands. Each command's own file is loaded when it is called, so that the help answers at once."""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, Any, Final

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from femprep import __version__

#: First line of each command's help; the command is the function of that name in the file of that name.
COMMANDS: Final = {
    "mesh": "Mesh the myocardial wall of a segmented image.",
    "surface": "Fit closed, smooth surfaces of a chosen number of vertices.",
    "check": "Judge a mesh: element quality, orientation, boundary, tags.",
    "convert": "Write a mesh in another format.",
    "bullseye": "Draw a field of a mesh as a bull's eye of the 17 AHA segments.",
    "compare": "Distances between two surfaces, in space and in the slices of an image; or every method on one label "
    "map.",
    "demo": "Mesh a phantom left ventricle, the whole way, in about a minute.",
    "schema": "Write the JSON Schemas of the options, of run.json (of a run and of a sequence) and of quality.json.",
}

#: Commands for developers, which the list leaves out.
HIDDEN: Final = frozenset({"schema"})

_STYLE: dict[str, Any] = {"add_completion": False, "rich_markup_mode": "rich", "pretty_exceptions_enable": False}


class LazyGroup(TyperGroup):
    """A group whose list is made from the table and whose commands are loaded when called."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names, in the table's order."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A stand-in that knows its line of help."""
        if cmd_name not in COMMANDS:
            return None
        return TyperCommand(cmd_name, help=COMMANDS[cmd_name], hidden=cmd_name in HIDDEN)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command itself."""
        name, command, rest = super().resolve_command(ctx, args)
        if name is not None and command is not None:
            command = load(name)
        return name, command, rest


def load(name: str) -> Any:
    """Load one command."""
    single = typer.Typer(**_STYLE)
    single.command(name)(getattr(import_module(f"femprep.cli.{name}"), name))
    return get_command(single)


app = typer.Typer(name="femprep", cls=LazyGroup, no_args_is_help=True, **_STYLE)


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
