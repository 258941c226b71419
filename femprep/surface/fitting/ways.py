"""The ways of a surface fit, in the order in which they are tried, what is accepted, and the record of each attempt."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, Literal

from pydantic import Field

from femprep.model.record import Record


@dataclass(frozen=True)
class Beginning:
    """How the mesh is made that is bent to the surface.

    Attributes
    ----------
    name : str
    drawn : bool
        Drawn on the outline of the voxels, instead of carried there from a sphere: for horns that no sphere covers.
    outline, vertices : int
        Vertices of the outline's coarser mesh, and of the mesh on it, a quarter of those in the end.
    rounds : int
        Rounds of bending it in the end.
    tips : bool
        Begun only where what there is until then is good but for some place that lies too far from the outlines, and
        for bodies that have tips.
    """

    name: str
    drawn: bool
    outline: int
    vertices: int
    rounds: int
    tips: bool = False


@dataclass(frozen=True)
class LayingWay:
    """How a template's triangles are laid on the surface.

    Attributes
    ----------
    name : str
    known : bool
        By the map from the sphere that the mesh the surface began with has, instead of one made for the surface.
    finer : float
        Triangles at least so much finer where the surface is curved, a power of the curvature.
    redrawn : bool
        Drawn on the surface anew, without a map.
    wanted : {"uneven", "far", "bad"}
        Tried where what there is until then has triangles below the fair quality, lies too far from the outlines in
        some place though the surface itself does not, or is not accepted for any reason.
    """

    name: str
    known: bool = False
    finer: float = 0.0
    redrawn: bool = False
    wanted: Literal["uneven", "far", "bad"] = "uneven"


BEGINNINGS: Final = (
    Beginning("sphere carried to the outline", False, 1000, 752, 2),
    Beginning("drawn on the outline", True, 2000, 1000, 4),
    # Tips of right ventricles that the ones before cut off: 15 of 200. A tunnel it would only follow deeper. Of 400
    # surfaces of left ventricles none took it.
    Beginning("drawn finer on the outline", True, 4000, 2000, 4, tips=True),
)
LAYING_WAYS: Final = (
    LayingWay("map known", known=True),
    LayingWay("map made anew"),
    LayingWay("map made anew, finer where curved", finer=0.5),
    LayingWay("map made anew, much finer where curved", finer=1.0, wanted="far"),
    LayingWay("triangles drawn anew", redrawn=True, wanted="bad"),
)
#: A body that fills more of its convex hull has no tips: of those 15 it is .68 at most, of left ventricles .79 at the
#: median.
TIPLESS: Final = 0.7
#: Beginning and way of the surface that is taken where none of these gives one.
FALLBACK: Final = ("harmonic field", "vertices moved along it")


@dataclass(frozen=True)
class Acceptance:
    """When nothing further is tried.

    Attributes
    ----------
    mean, least : float
        Q of the triangles, in the mean and at least.
    distance : float
        Mean distance to the labels' outlines in the slices, pixels.
    greatest : float
        Greatest distance in any place of any slice, pixels: below the limit of a finished mesh, which adds its own.
    fair : float
        Least Q with which no other map is tried.
    rough, outline : float
        Least Q with which the mesh to begin with keeps the edges of its template, and one on an outline of voxels that
        serves by itself.
    kept_mean, kept_least : float
        Q with which a template keeps its edges where they may be flipped, in the mean and at least.
    cut : float
        Share of the volume that its triangles may cut off then; also before a round of the harmonic surface counts as
        worse than another.
    flipped : float
        Least Q with which nothing more is done for the worst triangles after edges were flipped.
    given_mean, given_greatest : float
        Distance from a given surface with which no finer template is tried, mm.
    """

    mean: float = 0.95
    least: float = 0.5
    distance: float = 0.25
    greatest: float = 1.5
    fair: float = 0.6
    rough: float = 0.3
    outline: float = 0.2
    kept_mean: float = 0.955
    kept_least: float = 0.55
    cut: float = 0.02
    flipped: float = 0.65
    given_mean: float = 0.2
    given_greatest: float = 1.5


ACCEPTANCE: Final = Acceptance()


class FitAttempt(Record):
    """One attempt to fit a surface, as ``run.json`` has it."""

    beginning: str = Field(description="How the mesh was made that was bent to the surface.")
    way: str | None = Field(None, description="How triangles were laid on it; none where it came to no surface.")
    status: Literal["taken", "sound", "folded", "no mesh"] = Field(
        description="taken: the surface of the run. sound: another was better. folded: triangles cross or are folded. "
        "no mesh: none could be made."
    )
    least_quality: float | None = Field(None, description="Least Q of the triangles.")
    mean_quality: float | None = Field(None, description="Mean Q of the triangles; not of quadrilaterals.")
    distance_pixels: float | None = Field(None, description="Mean distance to the labels' outlines, pixels.")
    greatest_pixels: float | None = Field(None, description="Greatest distance to them in any slice, pixels.")


def told(attempts: Iterable[FitAttempt]) -> list[dict[str, Any]]:
    """Attempts as the ``info`` of a surface has them."""
    return [each.model_dump(exclude_none=True) for each in attempts]
