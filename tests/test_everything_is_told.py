"""Everything that is repaired, assumed, extrapolated, moved or left out is said, with how much and where."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from anatomy_meshes import ellipsoid as thick_ellipsoid
from biventricular import biventricular as gmsh_ventricles
from meshes import quadratic as with_middles
from slow_params import slow_but
from wall_shapes import Ellipsoid, ellipsoids, plane_z, stack, template_surface

import femprep as fp
from femprep.anatomy import add_aha, add_coordinates, add_fibres
from femprep.export.losses import losses
from femprep.image import Grid, make_object
from femprep.model import Notice, Plane
from femprep.options import ImageOptions, WallOptions
from femprep.phantoms import biventricular, lv_ellipsoid
from femprep.report.notices import gather
from femprep.surface.fitting.outlined import outline_surface
from femprep.sweeping.matching.match import match_surfaces
from femprep.volume.runs import attempt_notices as attempts_told
from femprep.volume.tetwild.ways import RunRecord
from femprep.wall import Envelope, Part, build_wall, extend_apex, find_base, find_common_base, keep_apart, thin_wall
from femprep.wall.assumed import assumed_wall, closed_openings, filled_groove, unused_structures
from femprep.wall.chambers.holes import open_wall
from femprep.wall.chambers.openings import Opening
from femprep.wall.clipping.clip import clip
from femprep.wall.clipping.mend import mend
from femprep.wall.planes.phase_bases import base_moved_with_phases

GRID = Grid((40, 40, 40), np.ones(3), np.zeros(3), np.eye(3))


def solid(*boxes: tuple[slice, slice, slice], hollow: tuple[slice, slice, slice] | None = None) -> dict[str, Any]:
    mask = np.zeros(GRID.shape, dtype=bool)
    for box in boxes:
        mask[box] = True
    if hollow:
        mask[hollow] = False
    return dict(make_object(mask, GRID, "lv", options=ImageOptions()).report)


def box(start: int, stop: int) -> tuple[slice, slice, slice]:
    return (slice(start, stop),) * 3


def without_rv(seg: fp.Segmentation) -> fp.Segmentation:
    labels = np.array(seg.labels)
    last = int(np.flatnonzero((labels == 1).any(axis=(0, 1)))[-1])
    labels[:, :, last][labels[:, :, last] == 1] = 0
    return replace(seg, labels=labels)


def apex(kinds: str) -> dict[str, Any]:
    seg = stack(list(kinds), radii=np.full(len(kinds), 16.0))
    return dict(extend_apex(seg, seg.object("lv", "myo")).info)


def four_balls() -> fp.Wall:
    at = {"lv": (0.0, 0.0, 0.0), "rv": (45.0, 0.0, 0.0), "la": (0.0, 0.0, 42.0), "ra": (45.0, 0.0, 42.0)}
    endo = {name: template_surface(Ellipsoid((20.0,) * 3, np.array(c)), 500, name) for name, c in at.items()}
    epi = template_surface(Ellipsoid((62.0, 36.0, 62.0), np.array([22.5, 0.0, 21.0])), 1500, "epi")
    return build_wall(epi=epi, endo=endo, base=None)


def opened(radius: float) -> dict[str, Any]:
    plane = Plane(np.array([0.0, 0.0, 21.0]), np.array([0.0, 0.0, 1.0]), "labels")
    return dict(open_wall(four_balls(), [Opening("mitral", "lv", "la", plane, radius)]).info)


def thin_apex() -> dict[str, Any]:
    epi, endo = ellipsoids((25.0, 25.0, 45.0), (33.0, 33.0, 45.2), vertices=1500)
    return dict(build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0), minimum_thickness=1.5).info)


def folded() -> dict[str, Any] | None:
    surface = template_surface(Ellipsoid((25.0, 25.0, 40.0)), 1500)
    points = surface.points.copy()
    for vertex in np.argsort(np.linalg.norm(points - [20.0, 0.0, -25.0], axis=1))[:4]:
        points[vertex] += [0.0, 6.0, 1.0]
    return mend(clip(replace(surface, points=points, shape=None), {"base": plane_z(10.0)}))


def too_near() -> list[dict[str, Any]]:
    left, right = (template_surface(Ellipsoid((20.0, 20.0, 30.0), np.array([x, 0.0, 0.0]))) for x in (0.0, 39.0))
    return keep_apart({"lv": left, "rv": right}, least=1.5, most=8.0)[1]


def groove() -> list[Notice]:
    def ball(radius: float, x: float) -> fp.Surface:
        return template_surface(Ellipsoid((radius,) * 3, np.array([x, 0.0, 0.0])), 600)

    body = Envelope([Part(ball(20.0, 0.0), 0.0, 0.0), Part(ball(15.0, 35.0), 1.0, 0.2)])
    rough = outline_surface(body.object(GRID, "epi"), 500)
    return [filled_groove(body, body.filled(rough, 0.0).settle(rough), 0)]


def thin_chamber() -> dict[str, Any] | None:
    cavity = template_surface(Ellipsoid((16.0, 16.0, 19.5)), 600, "la")
    body = [Part(template_surface(Ellipsoid((20.0,) * 3)), 0.0, 0.0)]
    return thin_wall(body, "la", cavity, WallOptions(minimum_thickness=2.0))


def thin_for_layers() -> dict[str, Any]:
    epi, endo = ellipsoids((25.0, 25.0, 45.0), (33.0, 33.0, 45.3), vertices=1000)
    return dict(match_surfaces(endo=endo, epi=epi, base=plane_z(12.0), edge_length=6.0, layers=2).info)


def on_left_ventricle(add: Any) -> dict[str, Any]:
    return dict(add(thick_ellipsoid(size=2, layers=2).mesh).info)


def mirrored_fibres() -> dict[str, Any]:
    return dict(add_fibres(fp.flip(gmsh_ventricles(8.0))).info)


def atria(**changes: Any) -> list[Notice]:
    seg = stack(list("cooo"))
    seg = replace(seg, structures={**seg.structures, "aorta_wall": (2,)})
    return [*closed_openings(WallOptions(**changes)), *unused_structures(seg, ["lv", "myo", "rv"])]


RING = stack(list("ooooo"), radii=[10.0, 26.0, 24.0, 22.0, 20.0])
RUN = RunRecord(
    way="direct",
    status="reached",
    outcome="reached",
    refined_levels=0,
    edge_length_mm=(2.0, 2.0),
    envelope_mm=0.1,
    stop_energy=10.0,
    time_limit_s=40.0,
)
RUNS = [
    RUN.model_copy(update={"status": "crashed", "outcome": "the mesher was ended by SIGSEGV"}),
    RUN.model_copy(update={"status": "missed", "outcome": "8.0 degrees: below what was asked"}),
]

#: What is done, how; kind, words, unit, and whether there is a place to name.
#: Walls and sweeps that take seconds.
SLOW = ("thin layers", "cavities", "thin wall", "mirrored", "fold")
CASES: dict[str, tuple[Any, str, str, str | None, bool]] = {
    "pieces": (
        lambda: solid(box(5, 20), box(25, 28)),
        "left out",
        "smaller piece was left out, 27 voxels",
        "voxels",
        True,
    ),
    "voids": (lambda: solid(box(5, 20), hollow=box(9, 11)), "repaired", "void was filled, 8 voxels", "voxels", True),
    "tunnel": (
        lambda: solid(box(5, 20), hollow=(slice(9, 12), slice(9, 12), slice(None))),
        *("repaired", "a tunnel", None, False),
    ),
    "border": (
        lambda: solid((slice(0, 20), *box(5, 20)[1:])),
        "assumed",
        "reaches the border of the image near",
        "voxels",
        True,
    ),
    "apex": (lambda: apex("coooo"), "extrapolated", "cavity still open at the apex: the epicardium was", "mm", True),
    "base": (lambda: find_base(RING, basal_end="first").record(), "moved", "of the left cavity's", "mm", True),
    "common base": (
        lambda: find_common_base(without_rv(biventricular().segmentation(spacing=(1.4, 1.4, 8.0)))).record(),
        *("moved", r"8.0 mm (1 slice) towards the apex", "mm", True),
    ),
    "phases": (lambda: [*base_moved_with_phases(4.2)], "moved", "4.2 mm towards the apex, so that", "mm", False),
    "wall of the RV": (lambda: [assumed_wall("rv", 3.0)], "assumed", "wall of 3.0 mm was assumed", "mm", False),
    "walls of atria": (lambda: [assumed_wall("la", 2.0)], "assumed", "left atrium: outside its cavity", "mm", False),
    "valves": (atria, "assumed", "all valves and openings of vessels were closed", None, False),
    "vessels": (lambda: atria(openings="labels"), "left out", "no part of the mesh: aorta wall", "voxels", False),
    "thin wall": (thin_apex, "repaired", "the epicardium was pushed outwards by up to", "mm", True),
    "thin chamber": (thin_chamber, "repaired", "wall of cavity la is thinner than 2 mm", "mm", True),
    "cavities": (too_near, "repaired", "cavities lv and rv overlapped by", "mm", True),
    "fold": (folded, "repaired", "surface lv was folded, or had needles", "mm", True),
    "groove": (groove, "repaired", "the groove was filled up by as much as", "mm", True),
    "valve cut": (lambda: opened(8.0), "assumed", "radius of 6.8 mm, in the labels 8.0 mm", "mm", True),
    "valve left": (lambda: opened(60.0), "left out", "mitral opening between lv and la near", None, True),
    "thin layers": (thin_for_layers, "repaired", "too thin for its layers of elements", "mm", True),
    "attempts": (lambda: attempts_told(RUNS, False), "not reached", "fTetWild run 1 of 2: the mesher was", None, False),
    "quality": (lambda: attempts_told(RUNS, False), "not reached", "did not reach the quality", None, False),
    "undone": (lambda: attempts_told([RUN], True, ["refined: why"]), "left out", "undone: refined: why", None, False),
    "septum of segments": (lambda: on_left_ventricle(add_aha), "assumed", "the septum was assumed", None, False),
    "septum": (lambda: on_left_ventricle(add_coordinates), "assumed", "the septum was assumed", None, False),
    "hand": (lambda: on_left_ventricle(add_fibres), "assumed", "--flip, or --mirrored yes", None, False),
    "mirrored": (mirrored_fibres, "assumed", "stored mirrored: its fibres were mirrored", None, False),
    "no RV": (
        lambda: fp.orient(lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 8.0))).info,
        *("assumed", "the labels have no right ventricle", None, False),
    ),
    "axes": (
        lambda: fp.orient(replace(RING, structures={"rv": (2,)})).info,
        *("assumed", "numbered along the image's axes", None, False),
    ),
    "slices": (
        lambda: fp.align_slices(biventricular().segmentation(spacing=(2.0, 2.0, 8.0))).info,
        *("moved", "no slice was moved", "mm", False),
    ),
    "deck": (
        lambda: losses(with_middles(thick_ellipsoid(size=2, layers=1).mesh), "medit"),
        *("left out", "the medit files hold elements without their mid-side nodes", None, False),
    ),
}


@pytest.mark.parametrize("case", slow_but([case for case in CASES if case not in SLOW], CASES))
def test_it_is_said(case: str) -> None:
    make, kind, words, unit, placed = CASES[case]
    found = make()
    notices = found if isinstance(found, list) and found and isinstance(found[0], Notice) else gather(found)
    (notice,) = [one for one in notices if words in one.what]
    assert notice.kind == kind
    assert notice.unit == unit
    assert (notice.amount is None) == (unit is None)
    assert (notice.place is not None) == bool(placed)
    assert "{" not in notice.what
    if placed:
        assert "({:.1f}, {:.1f}, {:.1f})".format(*notice.place) in notice.what


def test_nothing_is_said_where_nothing_was_done() -> None:
    epi, endo = ellipsoids()
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0))
    assert gather(wall.info, solid(box(5, 20)), apex("cooom"), find_base(stack(list("coooooooo"))).record()) == []
    assert attempts_told([RUN], True) == base_moved_with_phases(0.0) == []
    assert losses(thick_ellipsoid(size=2, layers=1).mesh, "medit") == []


@pytest.mark.slow
@pytest.mark.parametrize("module", ["volume.smooth", "sweeping.elements.quadratic"])
def test_edges_made_straight_are_said(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib

    place = importlib.import_module(f"femprep.{module}")
    real = place.add_middles
    monkeypatch.setattr(place, "add_middles", lambda *a, **k: (real(*a, **k)[0], np.array([0])))
    epi, endo = ellipsoids(vertices=600)
    if module == "volume.smooth":
        wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0))
        info = fp.tetrahedralize(wall, edge_length=6.0, order=2, quality="fast", mean_ratio=0.5).info
    else:
        matched = match_surfaces(endo=endo, epi=epi, base=plane_z(12.0), edge_length=8.0)
        info = fp.sweep(matched, order=2).info
    (notice,) = [one for one in gather(info) if "made straight" in one.what]
    assert (notice.amount, notice.unit) == (1, "edges")


@pytest.mark.slow
def test_a_missing_picture_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import femprep.report.output

    seg = lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped")
    changes = {"surface": {"vertices": 500}, "volume": {"mesher": "sweep", "edge_length": 6.0}}
    run = fp.mesh_segmentation(seg, **changes)
    monkeypatch.setattr(femprep.report.output, "drawn_picture", lambda *_: nullcontext(lambda: False))
    manifest = fp.write_run(run, tmp_path / "out")
    assert any("no picture of the mesh" in line for line in manifest.notices)
    # The sweep tells of the apex as fTetWild does, and so does its wall.
    (line,) = [line for line in manifest.notices if "extrapolated" in line]
    assert f"{run.wall.info['apex']['extrapolated_mm']:.1f} mm" in line
    assert run.wall.info["apex"]["mode"] == "closed"
    assert manifest.volumes[1].extrapolated_ml > 1.0
    (verdict,) = [limit for limit in run.quality.limits if limit.name == "wall_volume_difference"]
    assert verdict.passed
    page = (tmp_path / "out" / "report.html").read_text()
    assert line in page
