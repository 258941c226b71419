"""A finished run in, what its page's 3-D view shows out: corners, fields and facets, packed into text."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.mesh.elements import ELEMENTS, FACET_CORNERS
from femprep.model import FACET_TAGS, FloatArray, VolumeMesh
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.report.pictures.colours import SEGMENTS, colour, region_colour
from femprep.report.pictures.drawn import Drawn, drawn
from femprep.report.pictures.shown import Shown
from femprep.volume import QualityReport

#: Steps of a coordinate across the mesh: 2 micrometres of a heart of 13 cm.
_STEPS: Final = 65535
#: What the phases of a moving scene may take, bytes before they are packed.
MOST_BYTES: Final = 2_000_000
#: Thickness and measures of quality that the view can show, with their titles.
_MEASURES: Final = {
    "thickness": "wall thickness, mm",
    "mean_ratio": "mean ratio",
    "minimum_dihedral": "smallest dihedral angle, degrees",
}


def scene(content: Shown, quality: QualityReport) -> dict[str, Any]:
    """All that the view needs, JSON-ready.

    Parameters
    ----------
    content : Shown
        Elements of order 2 are shown by their corners.
    quality : QualityReport
        Whose worst elements are shown.
    """
    return _scene(content, [quality])[0]


def _scene(content: Shown, qualities: Sequence[QualityReport]) -> tuple[dict[str, Any], Drawn]:
    """The scene of a mesh with the worst elements of the first quality; and what is drawn, with those of all."""
    axes = _axes(content.mesh)
    worst = {item.element for quality in qualities for item in quality.worst}
    chosen = drawn(content.mesh, axes, worst)
    mesh = chosen.mesh
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    size = float((high - low).max())
    points = np.rint((mesh.points - low) * (_STEPS / size)).astype(np.uint16)
    number = np.uint16 if len(points) <= _STEPS else np.uint32
    blocks = []
    for name, block in mesh.cells.items():
        kind = ELEMENTS[name]
        corners = block[:, : kind.corners]
        faces = [[node for node in face if node < kind.corners] for face in kind.faces]
        blocks.append({"corners": kind.corners, "faces": faces, "nodes": _packed(corners.astype(number))})
    facets = [
        {"corners": FACET_CORNERS[name], "nodes": _packed(block[:, : FACET_CORNERS[name]].astype(number))}
        for name, block in mesh.facets.items()
    ]
    note = ""
    if chosen.cuts:
        shares = ", ".join(f"{100.0 * share:.0f}" for share in chosen.cuts)
        note = (
            f"The view draws {mesh.n_cells} of {content.mesh.n_cells} elements: those at the surface, at the borders "
            f"of regions and segments, and along cuts at {shares} % of each direction, where the slider stops."
        )
    found = {
        "points": _packed(points),
        "note": note,
        "low": low.tolist(),
        "step": size / _STEPS,
        "blocks": blocks,
        "facets": facets,
        "facetTags": _packed(_ranks(mesh.facet_tag)),
        "facetNames": [{"name": name, "colour": colour(name)} for name in mesh.facet_names],
        "fields": _fields(mesh, {name: values[chosen.elements] for name, values in content.fields.items()}),
        "fibres": _fibres(mesh),
        "axes": axes,
        "cuts": chosen.cuts,
        "worst": _worst(qualities[0], chosen),
        "phases": [],
    }
    return found, chosen


def moving_scene(
    contents: Sequence[Shown], qualities: Sequence[QualityReport], names: Sequence[str], first: int
) -> dict[str, Any]:
    """The same for the phases of one heart, of one connectivity: a view with a slider.

    Of a phase are its points, to about a tenth of a millimetre, its thickness and its worst elements; regions, segments
    and quality are those of one phase. More phases than ``MOST_BYTES`` hold are left out evenly.

    Parameters
    ----------
    contents : sequence of Shown
    qualities : sequence of QualityReport
    names : sequence of str
        Of the phases.
    first : int
        The phase that the others are moved from, and that is shown first.
    """
    found, chosen = _scene(contents[first], [qualities[first], *qualities])
    found["fibres"] = None
    base = chosen.mesh.points
    limits = _limits(np.concatenate([one.fields["thickness"] for one in contents]))
    each = base.size + chosen.mesh.n_cells
    kept = _spread(len(contents), max(2, MOST_BYTES // each), first)
    phases = []
    for number in kept:
        moved = contents[number].mesh.points[chosen.nodes] - base
        step = max(float(np.abs(moved).max()) / 127.0, 1e-9)
        phases.append(
            {
                "name": names[number],
                "step": step,
                "moved": _packed(np.rint(moved / step).astype(np.int8)),
                "thickness": _packed(_steps(contents[number].fields["thickness"][chosen.elements], limits)),
                "worst": _worst(qualities[number], chosen),
            }
        )
    for field in found["fields"]:
        if field["title"] == _MEASURES["thickness"]:
            field |= {"low": limits[0], "high": limits[1], "moves": True}
    left_out = f" {len(kept)} of {len(contents)} phases." if len(kept) < len(contents) else ""
    note = f"Points and thickness are those of the phase, quality is that of {names[first]}.{left_out}"
    return found | {"phases": phases, "first": kept.index(first), "note": f"{found['note']} {note}".strip()}


def _spread(count: int, most: int, first: int) -> list[int]:
    """At most so many numbers of phases, evenly spread, the first one among them."""
    if count <= most:
        return list(range(count))
    chosen = np.unique(np.rint(np.linspace(0, count - 1, most - 1)).astype(int)).tolist()
    return sorted({*chosen, first})


def _worst(quality: QualityReport, chosen: Drawn) -> list[dict[str, Any]]:
    return [
        {
            "element": int(np.searchsorted(chosen.elements, item.element)),
            "measure": item.measure,
            "value": item.value,
            "place": list(item.centroid),
        }
        for item in quality.worst
    ]


def _fields(mesh: VolumeMesh, values: Mapping[str, FloatArray]) -> list[dict[str, Any]]:
    """What elements can be coloured by: region, segment, thickness, quality."""
    found = [_classes("region", mesh.region, [(name, region_colour(name)) for name in mesh.region_names])]
    if "aha" in mesh.cell_data:
        segment = np.asarray(mesh.cell_data["aha"])
        shown = np.unique(segment).tolist()
        names = [("none", "#ffffff") if k < 1 else (str(int(k)), SEGMENTS[(int(k) - 1) % 17]) for k in shown]
        found.append(_classes("AHA segment", segment, names))
    return found + [_values(title, values[name]) for name, title in _MEASURES.items() if name in values]


def _classes(title: str, values: npt.ArrayLike, names: list[tuple[str, str]]) -> dict[str, Any]:
    classes = [{"name": name, "colour": shade} for name, shade in names]
    return {"title": title, "classes": classes, "values": _packed(_ranks(values))}


def _values(title: str, values: FloatArray) -> dict[str, Any]:
    """Figures in 256 steps between their 1st and 99th percentile, beyond which colours do not change."""
    limits = _limits(values)
    return {"title": title, "low": limits[0], "high": limits[1], "values": _packed(_steps(values, limits))}


def _limits(values: FloatArray) -> tuple[float, float]:
    low, high = (float(x) for x in np.nanpercentile(values, (1.0, 99.0)))
    return low, high


def _steps(values: FloatArray, limits: tuple[float, float]) -> npt.NDArray[np.uint8]:
    known = np.nan_to_num(values, nan=float(np.nanmedian(values)))
    low, high = limits
    return np.rint(np.clip((known - low) * (255.0 / max(high - low, 1e-12)), 0.0, 255.0)).astype(np.uint8)


def _fibres(mesh: VolumeMesh) -> dict[str, Any] | None:
    if "fiber" not in mesh.cell_data:
        return None
    return _packed(np.rint(127.0 * np.asarray(mesh.cell_data["fiber"])).astype(np.int8))


def _axes(mesh: VolumeMesh) -> list[list[float]]:
    """Three directions at right angles, of which the last is the long axis, towards the base."""
    centres = [mesh.points[block[:, : ELEMENTS[name].corners]].mean(axis=1) for name, block in mesh.cells.items()]
    _, axes = np.linalg.eigh(np.cov(np.concatenate(centres).T))
    base = mesh.planes.get("base")
    up = axes[:, 2] if base is None else np.asarray(base.normal)
    nodes = nodes_of(chosen_rows(mesh.facets, mesh.facet_tag == FACET_TAGS["base"]))
    if base is None and len(nodes):
        up = mesh.points[nodes].mean(axis=0) - np.concatenate(centres).mean(axis=0)
        up /= np.linalg.norm(up)
    across = axes[:, 0] - up * float(axes[:, 0] @ up)
    if np.linalg.norm(across) < 0.1:
        across = axes[:, 1] - up * float(axes[:, 1] @ up)
    across = across / np.linalg.norm(across)
    return [across.tolist(), np.cross(up, across).tolist(), up.tolist()]


def _ranks(values: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Number of each value among those that occur."""
    return np.unique(np.asarray(values), return_inverse=True)[1].ravel().astype(np.uint8)


def _packed(array: npt.NDArray[Any]) -> dict[str, Any]:
    """An array as text: deflated, the type beside it."""
    flat = np.ascontiguousarray(array).ravel()
    return {"type": str(array.dtype), "data": base64.b64encode(zlib.compress(flat.tobytes())).decode("ascii")}
