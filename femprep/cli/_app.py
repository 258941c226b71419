"""The table of commands. Each command's own file is loaded when it is called, so that the help answers at once."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from femprep import __version__
from femprep.cli._apart import WORDS
from femprep.cli._logging import logging_options
from femprep.cli._values import PlainCommand
from femprep.errors import FileError, OptionError, did_you_mean

#: First line of each command's help; the command is the function of that name in the file of that name.
COMMANDS: Final = {
    "mesh": "Mesh the myocardial wall of a segmented image, or between your own surfaces (--surface).",
    "cohort": "Mesh many subjects, on this machine or a cluster, with a table and a page over all.",
    "surface": "Fit closed, smooth surfaces of a chosen number of vertices.",
    "refine": "Cut every element of a mesh into eight, nested, with new nodes on smooth surfaces.",
    "annotate": "Name the facets and regions of anyone's mesh of a heart; add coordinates, AHA segments and fibres; "
    "write decks.",
    "transfer": "Bring fields from one heart, phase, mesh or level to another by their ventricular coordinates.",
    "activate": "Grow Purkinje fibres on the endocardia of a mesh with fibres, and map the times at which a beat "
    "activates it.",
    "check": "Judge a mesh: element quality, orientation, boundary, tags.",
    "convert": "Write a mesh in another format.",
    "bullseye": "Draw a field of a mesh as a bull's eye of the 17 AHA segments.",
    "compare": "Distances between two surfaces, in space and in the slices of an image; or every method on one label "
    "map.",
    "demo": "Mesh a phantom left ventricle, the whole way, in about a minute.",
    "schema": "Where the JSON Schemas of options and records lie, for editors; or write them.",
}

_STYLE: dict[str, Any] = {"rich_markup_mode": "rich", "pretty_exceptions_enable": False}


class LazyGroup(TyperGroup):
    """A group whose list is made from the table and whose commands are loaded when called."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names, in the table's order."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A stand-in that knows its line of help."""
        if cmd_name not in COMMANDS:
            return None
        return TyperCommand(cmd_name, help=COMMANDS[cmd_name])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command itself."""
        if args and args[0] not in COMMANDS and not ctx.resilient_parsing:
            near = did_you_mean(get_close_matches(args[0], COMMANDS, n=1))
            raise OptionError(f"no such command {args[0]!r}{near or '; femprep --help lists them'}")
        if not ctx.resilient_parsing:
            _require_folder()
        name, command, rest = super().resolve_command(ctx, args)
        ctx.meta[WORDS] = tuple(rest)
        if name is not None and command is not None:
            command = load(name)
        return name, command, rest


def _require_folder() -> None:
    """Make sure that there is a working folder: the names of files and folders are read from it."""
    try:
        Path.cwd()
    except OSError as error:
        raise FileError(f"the working folder cannot be used: {error.strerror}; change to one that is there") from None


def load(name: str) -> Any:
    """Load one command."""
    function = getattr(import_module(f"femprep.cli.{name}"), name)
    single = typer.Typer(add_completion=False, **_STYLE)
    # Lines of a docstring are those of its file; a terminal has its own.
    paragraphs = (" ".join(part.split()) for part in (function.__doc__ or "").split("\n\n"))
    single.command(name, cls=PlainCommand, help="\n\n".join(paragraphs).strip())(function)
    command = get_command(single)
    command.params.extend(logging_options())
    return command


app = typer.Typer(name="femprep", cls=LazyGroup, no_args_is_help=True, **_STYLE)


def _version(value: bool) -> None:
    if value:
        typer.echo(f"femprep {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", metavar="", help="Print the version and stop.", callback=_version, is_eager=True),
    ] = False,
) -> None:
    """From a segmented cardiac image to a finite element mesh a solver accepts."""
