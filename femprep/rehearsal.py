"""What writing will need, loaded while the mesher runs in its own process: libraries, kernels, the picture's child."""

from __future__ import annotations

import logging
import subprocess
import threading
from collections.abc import Callable, Iterable
from typing import Self

from femprep.report.picture import end_painter, start_painter

Progress = Callable[[str, float], None]

_log = logging.getLogger(__name__)

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
            threading.Thread(target=_load, args=(self._formats,), name="femprep-rehearsal", daemon=True).start()
        if self._progress is not None:
            self._progress(stage, fraction)


def _load(formats: tuple[str, ...]) -> None:
    """Make what becomes a file of one tetrahedron, without writing it; what fails here will be told when it matters."""
    try:
        import h5py  # noqa: F401
        from vtkmodules import vtkIOXML  # noqa: F401

        import femprep.output  # noqa: F401
        from femprep.export.polydata import facets_polydata
        from femprep.export.table import FORMATS
        from femprep.export.text import wrapped
        from femprep.export.vtu import unstructured_grid
        from femprep.volume.rehearsal import tiny_mesh

        mesh = tiny_mesh()
        unstructured_grid(mesh)
        facets_polydata(mesh)
        wrapped([1], 1)
        for name in formats:
            _ = FORMATS[name].writer
    except Exception:
        _log.debug("nothing could be loaded ahead", exc_info=True)
