"""A surface too near to another in, its vertices pushed away until they are far enough out, in place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femprep.mesh.topology import edge_table
from femprep.model import FloatArray, IntArray


@dataclass(frozen=True)
class Pushing:
    """How a surface is pushed: neighbours of a vertex that is pushed follow it, which may bring others nearer.

    Attributes
    ----------
    rounds : int
        Pushes at most.
    reach : int
        Rings of neighbours that follow.
    fade : float
        Share of their neighbours' mean push that vertices follow by, below 1.
    """

    rounds: int
    reach: int
    fade: float


def push(
    points: FloatArray,
    triangles: IntArray,
    pushing: Pushing,
    lacking: Callable[[], tuple[FloatArray, FloatArray]],
    enough: float,
    held: Callable[[FloatArray], FloatArray] = lambda moves: moves,
) -> None:
    """Push vertices in place until none lacks more than enough.

    Parameters
    ----------
    points : (n, 3) array
        Vertices, mm.
    triangles : (m, 3) array
    pushing : Pushing
    lacking : callable
        Tells what each vertex lacks ``(n,)``, mm, at least 0, and which way leads away ``(n, 3)``.
    enough : float
        What a vertex may lack in the end, mm.
    held : callable, optional
        Takes the moves ``(n, 3)`` and gives those that are allowed.
    """
    edges = edge_table(triangles).nodes
    for _ in range(pushing.rounds):
        short, along = lacking()
        if short.max(initial=0.0) <= enough:
            break
        points += held(_spread(short, edges, pushing)[:, None] * along)


def _spread(push: FloatArray, edges: IntArray, pushing: Pushing) -> FloatArray:
    """Let a push fade over the neighbours instead of ending at once; never less than it was."""
    count = np.bincount(edges.ravel(), minlength=len(push))
    result = push.copy()
    for _ in range(pushing.reach):
        total = np.bincount(edges[:, 0], weights=result[edges[:, 1]], minlength=len(push))
        total += np.bincount(edges[:, 1], weights=result[edges[:, 0]], minlength=len(push))
        result = np.maximum(push, pushing.fade * total / np.maximum(count, 1))
    return result
