"""What travels with a mesh of its verdict, as lines of comment in decks and other text files, and back.

A line for each item, ``femprep verdict: limits minimum_dihedral 8.0``, its value in JSON.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, Final

from femprep.model import VolumeMesh, verdict_of

#: How much of a file is looked through: the lines stand near its top.
_HEAD: Final = 32_000
_LINE: Final = re.compile(r"femprep verdict: (\w+) (?:(\w+) )?(.+?)\s*(?:-->)?\s*$", re.MULTILINE)


def verdict_lines(mesh: VolumeMesh) -> list[str]:
    """Lines of plain ASCII, without ``--``, which a comment of XML must not hold; none where a mesh carries nothing."""
    lines = []
    for key, value in verdict_of(mesh).items():
        for name, item in value.items() if isinstance(value, dict) else [("", value)]:
            text = json.dumps(item).replace("--", "-\\u002d")
            lines.append(f"femprep verdict: {key} {name + ' ' if name else ''}{text}")
    return lines


def verdict_comments(mesh: VolumeMesh, mark: str) -> str:
    """The lines as comments that begin with a mark."""
    return "".join(f"{mark} {line}\n" for line in verdict_lines(mesh))


def verdict_in(path: Path) -> dict[str, Any]:
    """What the lines at the top of a file say; empty for a file without them."""
    with path.open("rb") as file:
        text = file.read(_HEAD).decode("ascii", errors="replace")
    found: dict[str, Any] = {}
    for key, name, value in _LINE.findall(text):
        if name:
            found.setdefault(key, {})[name] = json.loads(value)
        else:
            found[key] = json.loads(value)
    return found
