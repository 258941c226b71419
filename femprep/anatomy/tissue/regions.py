"""A mesh and a label map of scar, border zone or fat in; the mesh with those as regions and shares of elements out.

Between slices labels are interpolated along the wall (see :mod:`femprep.anatomy.tissue.wall_slices`), by the distance
from their outlines. The outlines then give way a little, the same everywhere, so that the volume is that of the labels;
so does the share from which on an element belongs to the region, which is near one half.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.anatomy.tissue.conformed import conformed
from femprep.anatomy.tissue.field import TissueField
from femprep.anatomy.tissue.levels import classes_of, levels_for
from femprep.anatomy.tissue.sampled import Sampled, levels_of, sample, volumes_of
from femprep.anatomy.tissue.transmurality import transmurality
from femprep.errors import InputError
from femprep.image.segmentation import Segmentation
from femprep.mesh.measures.volume_elements import all_centroids
from femprep.model import REGION_TAGS, TISSUES, FloatArray, IntArray, Notice, VolumeMesh, is_blood, noted
from femprep.model.shared_records.tissue import TissueRecord, TissuesRecord

#: The structure of a second image that is no tissue to be marked: the rest of the wall.
HEALTHY: Final = "healthy"
#: Cell data that keep the wall's own regions (lv, rv, septum) where tissue has taken their place.
WALL_REGION: Final = "wall_region"
#: End of the name of the cell data that are shares. The name itself is that of the region, in files too.
SHARE: Final = "_share"


def add_regions(
    mesh: VolumeMesh,
    image: Segmentation,
    labels: Mapping[str, int | Sequence[int]] | None = None,
    *,
    conforming: bool = False,
) -> VolumeMesh:
    """Mark scar, border zone, fat or other tissue that a second image shows, as regions of a mesh.

    Parameters
    ----------
    mesh : VolumeMesh
        With ventricular coordinates; of AHA segments, where it has them, the transmurality is told.
    image : Segmentation
        Of any grid and pose, in the same world coordinates.
    labels : mapping of str to int or several ints, optional
        Labels by tissue: ``scar``, ``border``, ``fat``, ``edema``, ``hypoperfused``; the image's own structures where
        not given. ``healthy`` names the rest of the wall: where it is given, voxels of neither tell nothing, and the
        nearest ones that do count; else every voxel in the wall tells.
    conforming : bool
        Cut the elements, tetrahedra of order 1, along the outlines of the tissue first, so that regions end there and
        not at the nearest faces. The mesh then has other points and elements; Purkinje fibres are left out.

    Returns
    -------
    VolumeMesh
        With the tissues as regions (``REGION_TAGS``), each one's share of each element, 0 to 1, in ``cell_data`` as
        ``scar_share`` and so on, the regions of the wall in ``cell_data["wall_region"]``, and ``info["tissues"]``: see
        :class:`femprep.model.shared_records.tissue.TissuesRecord`. Tissue of an earlier call is replaced.

    Raises
    ------
    InputError
        Coordinates are missing, a name is none of these, a label does not occur, the image does not meet the wall, or
        elements to be cut are no linear tetrahedra.

    Examples
    --------
    >>> coordinates = fp.add_coordinates(mesh, axes=fp.ventricular_axes(seg))
    >>> scarred = fp.add_regions(coordinates, seg, {"scar": 2})
    >>> "scar" in scarred.region_names
    True
    """
    if labels is not None:
        own = {name: (n,) if isinstance(n, int | np.integer) else tuple(n) for name, n in labels.items()}
        image = replace(image, structures=own)
    require_tissues(image)
    names = [name for name in image.structures if name != HEALTHY]
    mesh = without_tissue(mesh)
    cut = None
    if conforming:
        mesh, cut = conformed(mesh, image, names)
    field = TissueField(mesh, image, names)
    sampled = sample(field)
    wanted = volumes_of(field, sampled)
    levels = levels_of(field, sampled, wanted)
    chosen = classes_of(sampled.scores, levels)
    size = sampled.sums(np.ones(len(chosen)), mesh.n_cells)
    within = [sampled.sums(chosen == k, mesh.n_cells) for k in range(len(names))]
    shares: FloatArray = np.stack(within, axis=1) / np.maximum(size, 1e-300)[:, None]
    thresholds = None
    if cut is None:
        ranked = _ranked(shares, sampled, size)
        thresholds = levels_for(ranked, size, (shares * size[:, None]).sum(axis=0), 0.5, 0.4999)
        cut = classes_of(ranked, thresholds)
    tags = np.array([REGION_TAGS[name] for name in names], dtype=np.int32)
    region = np.where(cut >= 0, tags[cut], mesh.region).astype(np.int32)
    record = _record(field, names, sampled, wanted, levels, thresholds, shares, size, cut)
    info = {**mesh.info, "tissues": record.model_dump(mode="json")}
    data = {f"{name}{SHARE}": shares[:, k] for k, name in enumerate(names)}
    found = mesh.with_data(cell={**data, WALL_REGION: np.array(mesh.region)})
    return replace(found, region=region, info=noted(info, *_notices(record, image.info.get("notices", ()))))


def _ranked(shares: FloatArray, sampled: Sampled, size: FloatArray) -> FloatArray:
    """The shares; equal ones told apart by how far inside the tissue the element lies, in the mean."""
    out = shares.copy()
    for k in range(shares.shape[1]):
        deep = sampled.sums(np.clip(sampled.scores[:, k], -10.0, 10.0), len(size))
        out[:, k] += 1e-6 * (deep / np.maximum(size, 1e-300))
    return out


def without_tissue(mesh: VolumeMesh) -> VolumeMesh:
    """A mesh with the regions of the wall itself, as before :func:`add_regions`."""
    if WALL_REGION not in mesh.cell_data:
        return mesh
    gone = {WALL_REGION, *(f"{name}{SHARE}" for name in TISSUES)}
    data = {name: values for name, values in mesh.cell_data.items() if name not in gone}
    return replace(mesh, region=mesh.cell_data[WALL_REGION], cell_data=data)


def require_tissues(image: Segmentation) -> None:
    """Make sure that the structures of an image are tissues, and occur in it.

    Raises
    ------
    InputError
    """
    names = [name for name in image.structures if name != HEALTHY]
    if wrong := [name for name in names if name not in TISSUES]:
        raise InputError(
            f"{wrong[0]!r} is no tissue of a second image; choose from {', '.join(TISSUES)}, and {HEALTHY} for the "
            "rest of the wall"
        )
    if not names:
        raise InputError("no tissue named; give at least one, as in scar=1")
    for name in image.structures:
        image.numbers(name)


def own_tissue(seg: Segmentation) -> Segmentation | None:
    """The tissues that a heart's own label map names, as an image of them; None where it holds none."""
    held = {name: tuple(n for n in seg.structures.get(name, ()) if n in seg.present) for name in TISSUES}
    found = {name: own for name, own in held.items() if own}
    return replace(seg, structures=found, info={"file": seg.info.get("file")}) if found else None


def _record(
    field: TissueField,
    names: list[str],
    sampled: Sampled,
    wanted: FloatArray,
    levels: FloatArray,
    thresholds: FloatArray | None,
    shares: FloatArray,
    size: FloatArray,
    tagged: IntArray,
) -> TissuesRecord:
    mesh, grid, image = field.mesh, field.grid, field.image
    last = grid.shape[grid.stack_axis] - 1
    beyond = (sampled.position < -0.5) | (sampled.position > last + 0.5)
    unknown = (sampled.position < -1.0) | (sampled.position > last + 1.0)
    centre = all_centroids(mesh.points, mesh.cells)
    plain = field.nearest_voxels(centre) * ~is_blood(mesh.region)
    chosen = classes_of(sampled.scores, levels)
    through = transmurality(field, levels)
    aha = np.asarray(mesh.cell_data["aha"]) if "aha" in mesh.cell_data else None
    tissues = []
    for k, name in enumerate(names):
        voxels = np.argwhere(field.labels == k + 1).astype(float)
        off = field.locator(grid.to_world(voxels)).distance >= max(grid.spacing[field.maps.plane])
        mine = chosen == k
        weight = sampled.volume[mine]
        tissues.append(
            TissueRecord(
                name=name,
                tag=REGION_TAGS[name],
                labels=list(image.structures[name]),
                voxels_ml=len(voxels) * grid.voxel_volume / 1e3,
                off_wall_ml=int(off.sum()) * grid.voxel_volume / 1e3,
                wall_ml=wanted[k] / 1e3,
                shares_ml=float((shares[:, k] * size).sum()) / 1e3,
                region_ml=float(size[tagged == k].sum()) / 1e3,
                nearest_voxel_ml=float(size[plain == k + 1].sum()) / 1e3,
                edge_mm=float(levels[k]),
                threshold=None if thresholds is None else float(thresholds[k]),
                centroid_mm=_centroid(sampled.place[mine], weight),
                transmurality_percent=through[k].whole,
                transmurality_of_segments=None if aha is None else through[k].segments,
                share_of_segments=None if aha is None else _segment_shares(aha, shares[:, k], size),
            )
        )
    return TissuesRecord(
        source=_file(image),
        spacing_mm=tuple(float(s) for s in grid.spacing),
        beyond_ml=float(sampled.volume[beyond & ~unknown].sum()) / 1e3,
        unknown_ml=float(sampled.volume[unknown].sum()) / 1e3,
        tissues=tissues,
    )


def _centroid(place: FloatArray, weight: FloatArray) -> Any:
    if not len(place):
        return None
    return tuple(round(float(x), 4) for x in np.average(place, axis=0, weights=weight))


def _segment_shares(aha: IntArray, share: FloatArray, size: FloatArray) -> list[float | None]:
    whole = np.bincount(np.minimum(aha, 18), weights=size, minlength=19)[1:18]
    own = np.bincount(np.minimum(aha, 18), weights=size * share, minlength=19)[1:18]
    return [round(100.0 * float(a / b), 3) if b > 0 else None for a, b in zip(own, whole)]


def _file(image: Segmentation) -> str | None:
    name = image.info.get("file")
    return None if name is None else str(name).replace("\\", "/").rpartition("/")[2]


def _notices(record: TissuesRecord, said: Sequence[Mapping[str, Any]]) -> list[Notice]:
    found = [Notice(**{**one, "what": f"second image: {one['what']}"}) for one in said]
    if record.unknown_ml > 0.01:
        words = "{amount} of the wall lie beyond the second image, which tells of no tissue there"
        found.append(Notice.of("left out", words, amount=record.unknown_ml, unit="mL"))
    if record.beyond_ml > 0.01:
        words = "{amount} of the wall lie beyond the second image's last slices, whose labels go on there"
        found.append(Notice.of("extrapolated", words, amount=record.beyond_ml, unit="mL"))
    for one in record.tissues:
        if one.off_wall_ml > 0.02 * one.voxels_ml:
            words = f"{{amount}} of the {one.voxels_ml:.1f} mL of {one.name} lie a pixel or more off the wall: left out"
            found.append(Notice.of("left out", words, amount=one.off_wall_ml, unit="mL"))
        miss, room = one.region_ml - one.wall_ml, one.shares_ml - one.wall_ml
        if one.wall_ml > 0 and abs(room) > 0.05 * one.wall_ml:
            words = (
                f"{one.name} has {one.shares_ml:.2f} mL in the wall where its labels have {one.wall_ml:.2f} mL: "
                "{amount} off, as its outlines move by a pixel at most; do the labels' wall and the mesh's agree?"
            )
            found.append(Notice.of("not reached", words, amount=abs(room), unit="mL"))
        elif one.wall_ml > 0 and abs(miss) > 0.05 * one.wall_ml:
            words = (
                f"region {one.name} has {one.region_ml:.2f} mL where its labels have {one.wall_ml:.2f} mL: {{amount}} "
                "off, as the elements are too large for it; use the shares, or smaller elements"
            )
            found.append(Notice.of("not reached", words, amount=abs(miss), unit="mL"))
    return found
