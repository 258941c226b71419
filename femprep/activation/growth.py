"""A surface, a root and a direction in, a fractal tree on the surface out: the one file that knows fractal-tree.

The tree is that of Sahli Costabal et al. 2016 (doi 10.1016/j.jbiomech.2015.12.025), grown by H. Finsberg's library
``fractal-tree``. It looks for each step among the triangles of the vertex nearest to it, which is right where triangles
are about as large as steps: larger ones are cut, in their own planes.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Final

import numpy as np

from femprep.errors import MissingDependencyError, StageError
from femprep.mesh.topology import edge_table, quarters
from femprep.model import FloatArray, IntArray
from femprep.options import PurkinjeOptions

#: Triangles are cut until the mean of their sides is at most so many segments, or as often as this.
_SEGMENTS: Final = 3.0
_MOST_CUTS: Final = 3


def require_growth() -> None:
    """Make sure that the library is there.

    Raises
    ------
    MissingDependencyError
    """
    if find_spec("fractal_tree") is None:
        raise MissingDependencyError("Purkinje fibres need fractal-tree; install it with pip install femprep[purkinje]")


def grow(
    points: FloatArray,
    triangles: IntArray,
    root: FloatArray,
    direction: FloatArray,
    trunk: float,
    fascicles: tuple[tuple[float, float], ...],
    options: PurkinjeOptions,
) -> tuple[FloatArray, IntArray]:
    """Grow a tree.

    Parameters
    ----------
    points : (n, 3) array
        Vertices of the surface, mm, all of them of some triangle.
    triangles : (m, 3) array
    root : (3,) array
        A point of the surface.
    direction : (3,) array
        Unit vector along the surface there.
    trunk : float
        Length of the first branch, mm.
    fascicles : tuple of (float, float)
        Angle, radians, and length, mm, of each branch that leaves the trunk's end before the parting begins.
    options : PurkinjeOptions

    Returns
    -------
    points : (k, 3) array
        Near the surface, the root first.
    edges : (k - 1, 2) array
        From the root outward.

    Raises
    ------
    MissingDependencyError
        fractal-tree is not installed.
    StageError
        It found no place to grow.
    """
    require_growth()
    from fractal_tree import FractalTreeParameters, Mesh, generate_fractal_tree

    points, triangles = _cut(points, triangles, _SEGMENTS * options.segment_length)
    parameters = FractalTreeParameters(
        initial_direction=direction,
        init_length=trunk,
        N_it=options.generations,
        length=options.branch_length,
        branch_angle=float(np.radians(options.branch_angle)),
        repulsitivity=options.repulsion,
        l_segment=options.segment_length,
        generate_fascicles=bool(fascicles),
        fascicles_angles=tuple(angle for angle, _ in fascicles),
        fascicles_length=tuple(length for _, length in fascicles),
        save=False,
        save_paraview=False,
    )
    with _seeded(options.seed), contextlib.redirect_stderr(io.StringIO()):
        try:
            found = generate_fractal_tree(Mesh(verts=points, connectivity=triangles, init_node=root), parameters)
        except (Exception, SystemExit) as error:
            reason = " ".join(f"{type(error).__name__} {error}".split())
            raise StageError(
                f"no Purkinje tree grew from {np.round(root, 2).tolist()} mm ({reason}); give another root"
            ) from error
    edges = np.array(found.lines, dtype=np.int64).reshape(-1, 2)
    if len(edges) < options.branch_length / options.segment_length:
        raise StageError(
            f"the Purkinje tree from {np.round(root, 2).tolist()} mm ended after {len(edges)} segments; give another "
            "root, or shorter segments"
        )
    return np.asarray(found.nodes, dtype=np.float64), edges


def _cut(points: FloatArray, triangles: IntArray, longest: float) -> tuple[FloatArray, IntArray]:
    for _ in range(_MOST_CUTS):
        table = edge_table(triangles)
        ends = points[table.nodes]
        if np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean() <= longest:
            break
        triangles = quarters(table, triangles, len(points))
        points = np.concatenate([points, ends.mean(axis=1)])
    return points, triangles


@contextlib.contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """numpy's global generator, which the library draws from, at a seed, and as it was afterwards."""
    before = np.random.get_state()  # noqa: NPY002
    np.random.seed(seed)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(before)  # noqa: NPY002
