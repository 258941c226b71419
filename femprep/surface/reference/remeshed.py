"""A label object to its slice-interpolated surface, remeshed to even triangles by pyacvd (optional)."""

from __future__ import annotations

import warnings

from femprep.errors import MissingDependencyError
from femprep.image import LabelObject
from femprep.model import Surface
from femprep.surface.reference.contours import isosurface, smooth, surface_of
from femprep.surface.reference.slice_interpolation import interpolated_distance

METHOD = "slice-wise distance, Taubin, remeshed"


def remeshed(obj: LabelObject, vertices: int = 1500) -> Surface:
    """Slice interpolation, then clustering to a given number of vertices [1]_.

    Parameters
    ----------
    obj : LabelObject
    vertices : int
        Number of clusters, hence about the number of vertices.

    Returns
    -------
    Surface

    Raises
    ------
    MissingDependencyError
        pyacvd is not installed.

    References
    ----------
    .. [1] Valette, Chassery & Prost, Generic remeshing of 3D triangular meshes with metric-dependent discrete Voronoi
       diagrams, IEEE TVCG 14(2), 2008. doi:10.1109/TVCG.2007.70430
    """
    try:
        from pyacvd import Clustering
    except ImportError as error:
        raise MissingDependencyError(
            "remeshing for comparison needs pyacvd; install it with: pip install 'femprep[compare]'"
        ) from error

    phi, grid = interpolated_distance(obj)
    fine = smooth(isosurface(phi, grid, 0.0))
    with warnings.catch_warnings():
        # pyacvd reads an attribute that newer versions of pyvista have renamed.
        warnings.simplefilter("ignore")
        clustering = Clustering(fine.triangulate())
        clustering.cluster(vertices)
        mesh = clustering.create_mesh()
    return surface_of(mesh, grid, obj.name, METHOD, vertices=vertices)
