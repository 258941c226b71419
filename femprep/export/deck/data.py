"""A mesh in, its cell and facet data out as formats have them that know of elements alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.model import VolumeMesh


def over_all(mesh: VolumeMesh) -> dict[str, npt.NDArray[Any]]:
    """Cell and facet data as one array over all elements, then all facets; zero where there are none."""
    counts, found = (mesh.n_cells, mesh.n_facets), {}
    for name in dict.fromkeys([*mesh.cell_data, *mesh.facet_data]):
        parts = [data.get(name) for data in (mesh.cell_data, mesh.facet_data)]
        like = np.asarray(next(part for part in parts if part is not None))
        none = [np.zeros((n, *like.shape[1:]), like.dtype) for n in counts]
        found[name] = np.concatenate([own if part is None else part for part, own in zip(parts, none)])
    return found
