"""A tagged mesh and what it was made from in, volumes of cavities and walls beside those of voxels or surfaces out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from femprep.image import LabelObject, Segmentation
from femprep.mesh.measures.volume_elements import all_volumes
from femprep.model import FloatArray, Plane, VolumeMesh, Wall, cutting, is_blood
from femprep.report.manifest import VolumeRecord
from femprep.report.volumes import cavity_volume, labelled_volume, volume_below, voxel_extent
from femprep.wall.own import OUTER, OwnSurfaces, facets_of


def volumes_beside_labels(
    mesh: VolumeMesh, seg: Segmentation, objects: Mapping[str, LabelObject], planes: Mapping[str, Plane]
) -> list[VolumeRecord]:
    """Volumes of the cavities and walls of a mesh, and of the voxels labelled as these, between the same planes.

    Voxels count as they were labelled, so that pieces and tips that were left out, and voids that were filled, show. A
    wall that the labels do not have is beside none. That of the left ventricle is told apart by the end of the labels
    at the apex: what lies beyond it was extrapolated, and no voxel can be beside it.

    Parameters
    ----------
    mesh : VolumeMesh
        With regions and facets.
    seg : Segmentation
        The label map it was made from.
    objects : mapping of str to LabelObject
        What its surfaces were fitted to: cavities by their names, and bodies, ``epi`` or ``lv_epi``...
    planes : mapping of str to Plane
        That cut it.

    Returns
    -------
    list of VolumeRecord
    """
    part = _part(planes)

    def beside(title: str, facets: str, mesh_mm3: float, structure: str, beyond_mm3: float = 0.0) -> VolumeRecord:
        labelled, whole = (labelled_volume(seg, structure, own) for own in (cutting(facets, planes).values(), ()))
        return beside_voxels(title, mesh_mm3, labelled, beyond_mm3, part=part, whole_mm3=whole)

    found = []
    for facets in mesh.facet_names:
        if facets.startswith("endo"):
            name = facets.removeprefix("endo").removeprefix("_")
            found.append(beside(f"{name} cavity".strip(), facets, cavity_volume(mesh, facets), name or "lv"))
    end = _end(objects, planes)
    walls, beyond = _regions(mesh, None), {} if end is None else _regions(mesh, end)
    tissue, extra = (sum(table.get(part, 0.0) for part in ("lv", "septum")) for table in (walls, beyond))
    left = "wall" if set(walls) == {"lv"} else "lv wall and septum"
    found.append(beside(left, "epi", tissue, "myo", extra))
    others = [name for name in walls if name not in ("lv", "septum")]
    return found + [beside(f"{name} wall", f"endo_{name}", walls[name], f"{name}_wall") for name in others]


def volumes_beside_given(mesh: VolumeMesh, wall: Wall, own: OwnSurfaces) -> list[VolumeRecord]:
    """Volumes of cavities and wall of the mesh beside those of the given surfaces below the base."""
    given = {name: volume_below(surface, own.base) for name, surface in own.surfaces.items()}
    part = _part(wall.planes)
    found = []
    for name in own.endo:
        facets = facets_of(name, own.anatomy)
        if facets in mesh.facet_names:
            title = "cavity" if facets == "endo" else f"{name} cavity"
            found.append(_beside(title, cavity_volume(mesh, facets), given[name], "given_ml", part=part))
    whole = given[OUTER] - sum(given[name] for name in own.endo)
    return [*found, _beside("wall", wall.volume, whole, "given_ml", part=part)]


def beside_voxels(
    name: str,
    mesh_mm3: float,
    voxels_mm3: float,
    beyond_mm3: float = 0.0,
    *,
    part: str = "in all",
    whole_mm3: float | None = None,
) -> VolumeRecord:
    """One volume of a mesh beside that of voxels (0: there are none), in a part of it and in all; mm3."""
    whole = (voxels_mm3 if whole_mm3 is None else whole_mm3) / 1000.0
    more = {"part": part, "whole_ml": whole, "extrapolated_ml": beyond_mm3 / 1000.0}
    return _beside(name, mesh_mm3, voxels_mm3, "segmentation_ml", **more)


def _part(planes: Mapping[str, Plane]) -> str:
    """Which part of a heart lies between planes."""
    return "in all" if not planes else "between base and apex plane" if "apex" in planes else "below the base"


def _beside(name: str, mesh_mm3: float, other_mm3: float, other: str, **more: Any) -> VolumeRecord:
    """One volume of a mesh beside another one, which stands in the field of that name."""
    percent = 100.0 * (mesh_mm3 - other_mm3) / other_mm3 if other_mm3 > 0.0 else None
    volumes: dict[str, Any] = {"mesh_ml": mesh_mm3 / 1000.0, other: other_mm3 / 1000.0, **more}
    return VolumeRecord(name=name, difference_percent=percent, **volumes)


def wall_difference(records: Iterable[VolumeRecord]) -> float | None:
    """Volume of the left ventricle's wall less that of its labels, without what was extrapolated, per cent of these."""
    for record in records:
        if record.name in ("wall", "lv wall and septum") and record.segmentation_ml:
            return 100.0 * ((record.mesh_ml - record.extrapolated_ml) / record.segmentation_ml - 1.0)
    return None


def _end(objects: Mapping[str, LabelObject], planes: Mapping[str, Plane]) -> Plane | None:
    """The face of the labels' last slice at the apex, as a plane whose normal leads beyond; None without a base."""
    base = planes.get("base")
    body = objects.get("lv_epi", objects.get("epi"))
    if base is None or body is None:
        return None
    centres = body.grid.to_world(np.argwhere(body.mask).astype(np.float64))
    # Half of a voxel's extent along the normal: exact where the plane lies along its faces.
    depth = float(base.signed_distance(centres).min()) - 0.5 * voxel_extent(body, base)
    return Plane(base.point + depth * base.normal, -base.normal, "labels")


def _regions(mesh: VolumeMesh, beyond: Plane | None) -> dict[str, float]:
    """Volume of each region of the wall, mm3; that beyond a plane alone where one is given."""
    volume = all_volumes(mesh.points, mesh.cells)
    if beyond is not None:
        height = beyond.signed_distance(mesh.points)
        volume = volume * np.concatenate([_share(height[block]) for block in mesh.cells.values()])
    return {
        name: float(volume[mesh.region == tag].sum()) for name, tag in mesh.region_names.items() if not is_blood(tag)
    }


def _share(height: FloatArray) -> FloatArray:
    """Share of each element above 0, ``(k,)``, from the heights of its nodes ``(k, p)``: as of a box as high as it."""
    low, high = height.min(axis=1), height.max(axis=1)
    return np.asarray(np.clip(high / np.maximum(high - low, 1e-300), 0.0, 1.0))
