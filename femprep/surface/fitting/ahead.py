"""Objects in, the same one by one out, each with its surface begun while the one before it is fitted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor

from femprep.image.object import LabelObject
from femprep.options import SurfaceOptions
from femprep.surface.fitting.smooth import Rough, rough_mesh


def in_turn(
    objects: Mapping[str, LabelObject], options: SurfaceOptions
) -> Iterator[tuple[str, LabelObject, Future[Rough | None] | None]]:
    """Go through objects whose surfaces are fitted one after the other, a thread one step ahead.

    The mesh that a smooth surface begins with depends on the object's voxels alone. Most of the work on it is done by
    compiled code, which lets the fit go on: where there are two processors, it costs no time.

    Parameters
    ----------
    objects : mapping of str to LabelObject
    options : SurfaceOptions
        Those of all fits.

    Yields
    ------
    name : str
    obj : LabelObject
    begun : Future or None
        For :func:`~femprep.surface.fit.fit_surface`; None for the first object and by methods that begin otherwise.
    """
    begun = None
    following = iter([*objects.values()][1:])
    for name, obj in objects.items():
        current, upcoming = begun, next(following, None)
        begun = None if upcoming is None or options.method != "smooth" else _begin(upcoming)
        yield name, obj, current


def _begin(obj: LabelObject) -> Future[Rough | None]:
    """Begin the mesh in a thread; Python waits for its end before it ends itself."""
    thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="femprep-ahead")
    begun = thread.submit(rough_mesh, obj)
    thread.shutdown(wait=False)
    return begun
