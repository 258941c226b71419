"""What writing will need, loaded while the mesher runs in its own process: libraries, kernels, the picture's child."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterable, Iterator
from typing import Self

from femprep.report.picture import end_painter, start_painter

Progress = Callable[[str, float], None]

#: The stage that leaves this process idle.
_IDLE_STAGE = "volume"


class Rehearsal:
    """A progress callable that passes everything on and loads what comes later once the mesher begins.

    Used as a context manager: where the block fails, nothing it has started is left.

    Parameters
    ----------
    formats : iterable of str
        Further formats that will be written.
    progress : callable, optional
        Called with ``(stage, fraction)``.

    Attributes
    ----------
    painter : process or None
        The process that will draw the picture, for :func:`femprep.write_run`.
    """

    def __init__(self, formats: Iterable[str], progress: Progress | None) -> None:
        self.painter: subprocess.Popen[bytes] | None = None
        self._formats, self._progress = tuple(formats), progress

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.painter is not None:
            end_painter(self.painter)

    def __call__(self, stage: str, fraction: float) -> None:
        """Pass progress on; the first time for the mesher, begin to load."""
        if stage == _IDLE_STAGE and self.painter is None:
            self.painter = start_painter()
            from femprep.volume.rehearsal import begin  # loaded by now

            begin(_load(self._formats))
        if self._progress is not None:
            self._progress(stage, fraction)


def _load(formats: tuple[str, ...]) -> Iterator[None]:
    """Load the libraries step by step and make what becomes a file of one tetrahedron, without writing it."""
    import h5py  # noqa: F401

    yield
    from vtkmodules import vtkIOXML  # noqa: F401

    yield
    import femprep.report.output  # noqa: F401

    yield
    from femprep.export.polydata import facets_polydata
    from femprep.export.table import FORMATS
    from femprep.export.text import wrapped
    from femprep.export.vtu.write import unstructured_grid
    from femprep.report.manifest import library_versions
    from femprep.volume.rehearsal import tiny_mesh

    library_versions()
    yield
    mesh = tiny_mesh()
    unstructured_grid(mesh)
    facets_polydata(mesh)
    yield
    wrapped([1], 1)
    for name in formats:
        _ = FORMATS[name].writer
        yield
