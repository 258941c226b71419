"""A mesh and an image of intensities in, the mesh with the image's value at every element and point out."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from femprep.anatomy.tissue.slice_maps import SliceMaps, voxels_in, wall_locator
from femprep.anatomy.tissue.wall_samples import sample_part
from femprep.anatomy.tissue.wall_slices import WallSlices
from femprep.anatomy.wall_parts import wall_parts
from femprep.errors import InputError
from femprep.image.reading.intensity import IntensityImage
from femprep.model import Notice, VolumeMesh, is_blood, noted


def sample_image(mesh: VolumeMesh, image: IntensityImage, name: str) -> VolumeMesh:
    """Put the values of an image (T1, perfusion, late enhancement) on the elements and points of a mesh.

    Between slices values are interpolated along the wall, at the same depth and angle of its coordinates, and within a
    slice between pixels whose centres lie in the wall: neither blood nor lung gets into it.

    Parameters
    ----------
    mesh : VolumeMesh
        With ventricular coordinates.
    image : IntensityImage
        Of any grid and pose, in the same world coordinates.
    name : str
        Of the field: letters, digits and ``_``.

    Returns
    -------
    VolumeMesh
        With the mean over each element in ``cell_data`` and the value at each point in ``point_data``, 0 in blood;
        ``info["sampled"]`` tells range and what lay beyond the image.

    Raises
    ------
    InputError
        Coordinates are missing, the image does not meet the wall, or the name is taken.

    Examples
    --------
    >>> coordinates = fp.add_coordinates(mesh, axes=fp.ventricular_axes(seg))
    >>> image = fp.IntensityImage(1000.0 + seg.labels, seg.grid)
    >>> fp.sample_image(coordinates, image, "t1").cell_data["t1"].shape == (mesh.n_cells,)
    True
    """
    _require_name(mesh, name)
    parts = wall_parts(mesh)
    tissue = ~is_blood(mesh.region)
    known = voxels_in(wall_locator(mesh), image.grid) & np.isfinite(image.values)
    if not known.any():
        raise InputError(
            f"no voxel of the image for {name!r} lies in the wall of the mesh; both have to be in the same world "
            "coordinates (scanner, mm): compare their positions, or resample one onto the other"
        )
    maps = SliceMaps(np.nan_to_num(image.values), known, image.grid)
    cells, points = np.zeros(mesh.n_cells), np.zeros(len(mesh.points))
    last, beyond = image.grid.shape[image.grid.stack_axis] - 1, 0.0
    for part in reversed(parts):
        slices = WallSlices(part, image.grid)
        samples = sample_part(part, float(min(maps.spacing)))
        feet = slices.feet(samples.nodes, samples.weights)
        values = maps.between(feet)
        count = part.mesh.n_cells
        total = np.bincount(samples.element, weights=samples.volume, minlength=count)
        cells[part.cells] = np.bincount(samples.element, weights=samples.volume * values, minlength=count) / total
        outside = (feet.position < -0.5) | (feet.position > last + 0.5)
        beyond += float(samples.volume[outside].sum())
        nodes = part.space.nodes
        alone = np.column_stack([nodes, np.repeat(nodes[:, None], 3, axis=1)])
        weights = np.tile([1.0, 0.0, 0.0, 0.0], (len(nodes), 1))
        own = part.space.to_points(maps.between(slices.feet(alone, weights)))
        points[part.points] = own
    record: dict[str, Any] = {
        **{key: image.info[key] for key in ("file",) if key in image.info},
        "least": float(cells[tissue].min()),
        "largest": float(cells[tissue].max()),
        "beyond_ml": beyond / 1e3,
    }
    told = [Notice(**{**one, "what": f"image {name}: {one['what']}"}) for one in image.info.get("notices", ())]
    if beyond > 10.0:
        words = f"{{amount}} of the wall lie beyond the image for {name}; the values of its last slices go on there"
        told.append(Notice.of("extrapolated", words, amount=beyond / 1e3, unit="mL"))
    info = {**mesh.info, "sampled": {**mesh.info.get("sampled", {}), name: record}}
    return replace(mesh.with_data(cell={name: cells}, point={name: points}), info=noted(info, *told))


def _require_name(mesh: VolumeMesh, name: str) -> None:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,59}", name):
        raise InputError(f"{name!r} is no name for a field; take letters, digits and _, a letter first")
    sampled = mesh.info.get("sampled", {})
    if name == "region" or (name in {**mesh.cell_data, **mesh.point_data} and name not in sampled):
        raise InputError(f"the mesh has a field {name!r} already; give the image another name (NAME=FILE)")
