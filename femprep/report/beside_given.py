"""A tagged mesh and the surfaces it was made from in, volumes of cavities and wall beside those of the surfaces out."""

from __future__ import annotations

from femprep.model import VolumeMesh, Wall
from femprep.report.manifest import VolumeRecord
from femprep.report.volumes import cavity_volume, volume_below
from femprep.wall.own import OUTER, OwnSurfaces, facets_of


def volumes_beside_given(mesh: VolumeMesh, wall: Wall, own: OwnSurfaces) -> list[VolumeRecord]:
    """Volumes of cavities and wall of the mesh beside those of the given surfaces below the base."""
    given = {name: volume_below(surface, own.base) for name, surface in own.surfaces.items()}
    found = []
    for name in own.endo:
        facets = facets_of(name, own.anatomy)
        if facets in mesh.facet_names:
            title = "cavity" if facets == "endo" else f"{name} cavity"
            found.append(_beside(title, cavity_volume(mesh, facets), given[name]))
    whole = given[OUTER] - sum(given[name] for name in own.endo)
    return [*found, _beside("wall", wall.volume, whole)]


def _beside(name: str, mesh_mm3: float, given_mm3: float) -> VolumeRecord:
    return VolumeRecord(
        name=name,
        mesh_ml=mesh_mm3 / 1000.0,
        given_ml=given_mm3 / 1000.0,
        difference_percent=100.0 * (mesh_mm3 - given_mm3) / given_mm3 if given_mm3 > 0.0 else None,
    )
