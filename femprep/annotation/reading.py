"""What a way of reading a boundary found: a name for every facet, how sure each is, and where two readings are left."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from femprep.model import FloatArray, TagArray

#: A name that is at least so sure is taken without asking.
SURE = 0.75


@dataclass(frozen=True)
class Name:
    """A name that was given.

    Attributes
    ----------
    sure : float
        From 0 to 1: 1 where nothing else is possible.
    because : str
        What it was told by.
    """

    sure: float
    because: str


@dataclass(frozen=True)
class Question:
    """Where two readings are possible: what is asked, and the line that answers it."""

    words: str
    line: str


@dataclass(frozen=True, eq=False)
class CavityOpening:
    """An opening of a cavity: its ring's name, centre (mm), normal out of the cavity, area (mm2) and cavity."""

    name: str
    cavity: str
    centre: FloatArray
    normal: FloatArray
    area: float


@dataclass(frozen=True, eq=False)
class Reading:
    """Names of all facets of a boundary, by one way.

    Attributes
    ----------
    way : str
        Name of the way.
    tag : (n_facets,) array
        Numbers of ``FACET_TAGS``; 0 where the way has no name.
    names : mapping of str to Name
        How sure each name is.
    questions : tuple of Question
    openings : tuple of CavityOpening
    """

    way: str
    tag: TagArray
    names: Mapping[str, Name] = field(default_factory=dict)
    questions: tuple[Question, ...] = ()
    openings: tuple[CavityOpening, ...] = ()


@dataclass(frozen=True)
class ReadingAttempt:
    """One way that was tried, as ``run.json`` has it."""

    way: str
    taken: bool
    why: str
    figures: Mapping[str, float | int | str] = field(default_factory=dict)


class NoReading(Exception):
    """A way does not fit this boundary; the message says why."""
