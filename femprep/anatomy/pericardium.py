"""A mesh with the apicobasal coordinate in, the same mesh with the springs of its pericardium at its points out.

===================  ==========================================================================================
pericardium          stiffness, kPa/mm: the pressure against each millimetre the epicardium moves along its normal
pericardium_area     the share of the epicardium's area that belongs to a point, mm2
pericardium_normal   unit normal out of the wall
basal_ring           1 where the epicardium meets the base, else 0
===================  ==========================================================================================

All are 0 off the epicardium. A spring of stiffness ``pericardium * pericardium_area`` along the normal stands for the
pericardium around a point; a solver with facet integrals takes ``pericardium`` alone.

References
----------
Strocchi et al. 2020, doi 10.1016/j.jbiomech.2020.109645: the stiffness falls from the apex to the base as found from
the heart's motion. The polynomial is the one of the authors' public scripts.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.model import FACET_TAGS, FloatArray, VolumeMesh
from femprep.model.arrays import floats
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.options import PericardiumOptions, choose, takes
from femprep.volume.pericardium import with_springs

#: The pericardium ends at this apicobasal coordinate, and its stiffness is a cubic of the distance from there.
_END: Final = 0.82
#: Coordinates this far beyond apex and base have been rounded.
_SLACK: Final = 1e-6
_CUBIC: Final = (1.5266, -0.37, 0.4964, 0.0)


def pericardium_scale(apicobasal: npt.ArrayLike) -> FloatArray:
    """Stiffness at an apicobasal coordinate (0 at the apex, 1 at the base) as a share of that at the apex.

    Raises
    ------
    InputError
        A coordinate is no number from 0 to 1.

    References
    ----------
    Strocchi et al. 2020, doi 10.1016/j.jbiomech.2020.109645

    Examples
    --------
    >>> fp.pericardium_scale([0.0, 0.41, 0.82, 1.0]).round(2).tolist()
    [1.0, 0.25, 0.0, 0.0]
    """
    at = floats(apicobasal, "apicobasal coordinates")
    if np.any(wrong := ~((at >= -_SLACK) & (at <= 1.0 + _SLACK))):
        raise InputError(
            f"an apicobasal coordinate is {at[wrong][0]:g}, but it is 0 at the apex and 1 at the base, as "
            "add_coordinates makes it"
        )
    below = np.maximum(_END - np.maximum(at, 0.0), 0.0)
    return np.asarray(np.polyval(_CUBIC, below))


@takes(PericardiumOptions)
def add_pericardium(mesh: VolumeMesh, options: PericardiumOptions | None = None, **changes: Any) -> VolumeMesh:
    """Add the springs of the pericardium to a mesh.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets tagged ``epi`` and the point data ``apicobasal`` that ``add_coordinates`` makes.
    options : PericardiumOptions, optional
    **changes
        Options by name in place of those given.

    Returns
    -------
    VolumeMesh
        With ``pericardium``, ``pericardium_area``, ``pericardium_normal`` and ``basal_ring`` in ``point_data``. A deck
        with a step has the springs in it.

    Raises
    ------
    InputError
        The mesh has no epicardium, or no coordinates from 0 to 1 there.

    References
    ----------
    Strocchi et al. 2020, doi 10.1016/j.jbiomech.2020.109645

    Examples
    --------
    >>> axes = fp.ventricular_axes(seg)
    >>> held = fp.add_pericardium(fp.add_coordinates(mesh, axes=axes), stiffness=1.0)
    >>> float(held.point_data["pericardium"].max()) <= 1.0
    True
    """
    options = choose(PericardiumOptions, options, changes)
    facets = chosen_rows(mesh.facets, mesh.facet_tag == FACET_TAGS["epi"])
    if not sum(map(len, facets.values())):
        have = ", ".join(mesh.facet_names) or "none"
        raise InputError(f"the pericardium lies on facets tagged epi; this mesh has {have}")
    if "apicobasal" not in mesh.point_data:
        raise InputError(
            "the pericardium's stiffness depends on the point data apicobasal, which the mesh does not have; add them "
            "(add_coordinates, or --fibres)"
        )
    stiffness, on = np.zeros(len(mesh.points)), nodes_of(facets)
    stiffness[on] = options.stiffness * pericardium_scale(np.asarray(mesh.point_data["apicobasal"])[on])
    return with_springs(mesh, stiffness)
