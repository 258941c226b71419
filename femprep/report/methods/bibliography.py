"""What femprep's methods rest on: each reference once, with its DOI, as BibTeX; they stand in ``references.bib``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Final


@dataclass(frozen=True)
class Reference:
    """One entry of the bibliography.

    Attributes
    ----------
    text : str
        The entry as BibTeX.
    fields : dict of str to str
        Its fields by name.
    """

    text: str
    fields: dict[str, str]

    @property
    def short(self) -> str:
        """Authors and year, as in running text."""
        names = [author.partition(",")[0] for author in self.fields["author"].split(" and ")]
        who = " and ".join(names) if len(names) < 3 else f"{names[0]} et al."
        return f"{who} {self.fields.get('year', '')}".strip()


def _read() -> dict[str, Reference]:
    text = files(__package__).joinpath("references.bib").read_text("utf-8")
    entries = re.finditer(r"^@\w+\{(\w+),\n.*?^\}\n", text, re.M | re.S)
    return {one[1]: Reference(one[0], dict(re.findall(r"^  (\w+) = \{(.*)\},$", one[0], re.M))) for one in entries}


#: All references by key.
REFERENCES: Final = MappingProxyType(_read())


def bibtex(keys: Iterable[str]) -> str:
    """The entries of some keys, in their order."""
    return "\n".join(REFERENCES[key].text for key in keys)
