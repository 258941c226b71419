"""Elements cut along the outlines of scar and border zone: regions end there, volumes stay, elements stay good."""

from __future__ import annotations

import numpy as np
import pytest
from second_images import late_enhancement, sector, stack, ventricle

import femprep as fp
from femprep.errors import InputError, OptionError
from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.volume_elements import all_centroids, all_volumes
from femprep.options import choose
from femprep.phantoms import lv_ellipsoid

PIXELS = (1.6, 1.6, 8.0)


def wrong(mesh: fp.VolumeMesh) -> float:
    """Volume of the elements on the wrong side of the scar, by its own."""
    size, true = all_volumes(mesh.points, mesh.cells), sector(all_centroids(mesh.points, mesh.cells), 0.25, 0.75)
    return float(size[(mesh.region == fp.REGION_TAGS["scar"]) != true].sum() / size[true].sum())


@pytest.mark.slow
def test_a_scar_in_the_middle_of_the_wall_has_its_own_faces() -> None:
    wall, image = fp.add_pericardium(ventricle(size=7)), late_enhancement(stack(PIXELS), 0.25, 0.75)
    plain, found = fp.add_regions(wall, image), fp.add_regions(wall, image, conforming=True)
    assert wrong(found) < 0.9 * wrong(plain)
    told = found.info["tissues"]["tissues"][0]
    assert told["region_ml"] == pytest.approx(told["wall_ml"], rel=0.03)
    assert told["threshold"] is None
    before, after = fp.check(wall).measures, fp.check(found).measures
    assert after["minimum_dihedral"].min > min(14.0, before["minimum_dihedral"].min)
    assert after["mean_ratio"].mean > before["mean_ratio"].mean - 0.02
    # The wall is the same wall, with its tags and fields, and sound.
    assert all_volumes(found.points, found.cells).sum() == pytest.approx(
        all_volumes(wall.points, wall.cells).sum(), rel=0.005
    )
    assert found.facet_names == wall.facet_names
    faces = boundary_faces(found.cells)["triangle"].nodes
    assert len(faces) == found.n_facets
    assert set(wall.point_data) <= set(found.point_data)
    epi = found.points[found.facets["triangle"][found.facet_tag == fp.FACET_TAGS["epi"]]]
    area = np.linalg.norm(np.cross(epi[:, 1] - epi[:, 0], epi[:, 2] - epi[:, 0]), axis=1).sum() / 2
    assert found.point_data["pericardium_area"].sum() == pytest.approx(area, rel=1e-12)
    assert np.hypot(found.point_data["rotational_cos"], found.point_data["rotational_sin"]).min() > 1 - 1e-9
    assert fp.add_regions(wall, image, conforming=True).points.tobytes() == found.points.tobytes()


@pytest.mark.slow
def test_border_zone_beside_a_scar() -> None:
    image = late_enhancement(stack((2.0, 2.0, 8.0)))
    found = fp.add_regions(ventricle(size=7), image, {"scar": 1, "border": 2, "healthy": 3}, conforming=True)
    assert found.region_names == {"lv": 1, "scar": 21, "border": 22}
    for one in found.info["tissues"]["tissues"]:
        assert one["region_ml"] == pytest.approx(one["wall_ml"], rel=0.06)
    assert all_volumes(found.points, found.cells).min() > 0.0
    assert fp.check(found).measures["minimum_dihedral"].min > 8.0


@pytest.mark.parametrize("kind", ["hexahedron", "wedge"])
def test_other_elements_are_refused(kind: str) -> None:
    with pytest.raises(InputError, match=f"tetrahedra of order 1; the mesh has {kind}"):
        fp.add_regions(ventricle(kind, 3, 3), late_enhancement(stack(PIXELS)), conforming=True)


def test_options_that_do_not_go_with_it_are_refused() -> None:
    with pytest.raises(OptionError, match="order 2"):
        choose(fp.Options, None, {"conforming": True, "volume": {"order": 2}})
    with pytest.raises(OptionError, match="hexahedron"):
        choose(
            fp.Options,
            None,
            {"conforming": True, "volume": {"mesher": "sweep"}, "sweep": {"element": "hexahedron"}},
        )
    seg = lv_ellipsoid().segmentation((2.0, 2.0, 8.0))
    with pytest.raises(OptionError, match="--regions"):
        fp.mesh_segmentation(seg, conforming=True)


@pytest.mark.slow
def test_purkinje_fibres_are_left_out_and_told() -> None:
    pytest.importorskip("fractal_tree")
    wall = fp.add_purkinje(ventricle(size=5), generations=2)
    found = fp.add_regions(wall, late_enhancement(stack(PIXELS)), conforming=True)
    assert found.purkinje is None
    assert any("Purkinje" in notice["what"] for notice in found.info["notices"])
