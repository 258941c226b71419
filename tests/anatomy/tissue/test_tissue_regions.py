"""Scar and border zone of a second image on a mesh: volume, place, depth, and what must not get any."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from second_images import depth, late_enhancement, sector, stack, ventricle

import femprep as fp
from femprep.anatomy.tissue.label_volumes import label_volumes
from femprep.anatomy.tissue.levels import classes_of, levels_for
from femprep.anatomy.tissue.slice_maps import wall_locator
from femprep.anatomy.tissue.wall_samples import _lattice
from femprep.errors import InputError
from femprep.mesh.measures.volume_elements import centroids, element_volumes

PIXELS = (1.6, 1.6, 8.0)


def sizes(mesh: fp.VolumeMesh) -> tuple[np.ndarray, np.ndarray]:
    blocks = [(element_volumes(mesh.points, b, k), centroids(mesh.points, b, k)) for k, b in mesh.cells.items()]
    return np.concatenate([v for v, _ in blocks]), np.concatenate([c for _, c in blocks])


def truth() -> tuple[float, np.ndarray]:
    """Volume, mL, and centroid of the middle half of the wall: the flat faces of the mesh cut none of it."""
    points = np.random.default_rng(0).uniform([-36, -36, -66], [36, 36, 15], (400_000, 3))
    mine = sector(points, 0.25, 0.75)
    return mine.mean() * 72 * 72 * 81 / 1e3, points[mine].mean(axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 25.0])
def test_a_sector_of_half_the_depth_has_its_volume_place_and_depth_from_slices_of_8_mm(tilt: float) -> None:
    found = fp.add_regions(ventricle(), late_enhancement(stack(PIXELS, tilt), 0.25, 0.75))
    told = found.info["tissues"]["tissues"][0]
    volume, centre = truth()
    assert told["shares_ml"] == pytest.approx(volume, rel=0.03)
    assert told["region_ml"] == pytest.approx(told["shares_ml"], rel=0.01)
    assert np.linalg.norm(np.array(told["centroid_mm"]) - centre) < 1.0
    assert told["transmurality_percent"] == pytest.approx(50.0, abs=2.5)
    segments = told["transmurality_of_segments"]
    assert all(segments[k - 1] is None or segments[k - 1] < 10 for k in (3, 4, 5, 9, 10, 11))
    assert min(segments[k - 1] for k in (1, 2, 7, 8)) > 40.0
    size, place = sizes(found)
    share = found.cell_data["scar_share"]
    assert share.min() >= 0.0
    assert share.max() <= 1.0
    deep = depth(place)
    assert (share * size)[(deep > 0.9) | (deep < 0.1)].sum() < 0.02 * (share * size).sum()
    # Fewer elements are wrong than by the voxel at their centre.
    true = sector(place, 0.25, 0.75)
    grid = stack(PIXELS, tilt)
    index = np.clip(np.rint(grid.to_index(place)).astype(int), 0, np.array(grid.shape) - 1)
    plain = late_enhancement(grid, 0.25, 0.75).labels[tuple(index.T)] == 1
    tagged = found.region == fp.REGION_TAGS["scar"]
    assert size[tagged != true].sum() < size[plain != true].sum()


@pytest.mark.slow
def test_border_zone_beside_a_scar_and_healthy_wall_named() -> None:
    image = late_enhancement(stack((2.0, 2.0, 8.0)))
    found = fp.add_regions(ventricle(size=4), image, {"scar": 1, "border": 2, "healthy": 3})
    assert found.region_names == {"lv": 1, "scar": 21, "border": 22}
    scar, border = found.info["tissues"]["tissues"]
    assert [scar["name"], border["name"]] == ["scar", "border"]
    for one in (scar, border):
        assert one["shares_ml"] == pytest.approx(one["wall_ml"], rel=0.01)
    assert np.all(found.cell_data["scar_share"] + found.cell_data["border_share"] < 1.0 + 1e-9)
    assert border["transmurality_percent"] == pytest.approx(20.0, abs=5.0)
    again = fp.add_regions(found, image, {"scar": 1})
    assert "border_share" not in again.cell_data
    np.testing.assert_array_equal(again.cell_data["wall_region"], 1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hexahedron", "wedge"])
def test_every_element_type_takes_tissue_and_every_format_names_it(kind: str, tmp_path: Path) -> None:
    found = fp.add_regions(ventricle(kind, 3, 3), late_enhancement(stack((2.0, 2.0, 8.0))))
    assert "scar" in found.region_names
    fp.write_mesh(found, tmp_path / "heart.inp")
    assert "ELSET=scar" in (tmp_path / "heart.inp").read_text()
    back = fp.read_mesh(tmp_path / "heart.inp")
    assert back.region_names == found.region_names


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 25.0])
def test_a_thin_layer_has_the_volume_of_its_own_voxels(tilt: float) -> None:
    # A third of the wall is two pixels: an endocardium a tenth of a millimetre off would lose three percent.
    grid = stack(PIXELS, tilt)
    index = np.argwhere(np.ones(grid.shape, dtype=bool))
    inner = sector(grid.to_world(index.astype(float)), 0.0, 1 / 3)
    image = fp.Segmentation(inner.reshape(grid.shape).astype(np.uint8), grid, {"scar": (1,)})
    mesh = ventricle(size=4)
    told = fp.add_regions(mesh, image).info["tissues"]["tissues"][0]
    fine = np.arange(64) / 64 + 1 / 128 - 0.5
    boxes = grid.to_world((index[inner][:, None] + fine[:, None] * [0.0, 0.0, 1.0]).reshape(-1, 3))
    own = np.mean(boxes[:, 2] <= 15.0) * inner.sum() * grid.voxel_volume / 1e3
    assert told["wall_ml"] == pytest.approx(own, rel=0.005)
    assert told["shares_ml"] == pytest.approx(own, rel=0.005)


def test_labels_of_something_else_than_the_wall_do_not_count() -> None:
    mesh, grid = ventricle(size=4), stack((2.0, 2.0, 8.0))
    locator, labels = wall_locator(mesh), np.zeros(grid.shape, dtype=np.uint8)
    base, lv = np.rint(grid.to_index([[30.0, 0.0, 0.0], [0.0, 0.0, 0.0]])).astype(int)
    labels[tuple(base)], labels[tuple(lv)] = 1, 2
    found = label_volumes(mesh, locator, labels, grid, 2)
    np.testing.assert_allclose(found, [grid.voxel_volume, 0.0])
    # Of a box through the base what lies beyond it is none of the mesh's.
    top = grid.to_world([[0, 0, int(base[2]) + 2]])[0, 2]
    labels[:] = 0
    labels[base[0], base[1], base[2] + 2] = 1
    below = np.clip((15.0 - top + 4.0) / 8.0, 0.0, 1.0)
    assert 0.0 < below < 1.0
    assert label_volumes(mesh, locator, labels, grid, 1)[0] == pytest.approx(below * grid.voxel_volume, abs=2.0)


@pytest.mark.slow
def test_wall_beyond_the_image_has_no_tissue_and_is_told() -> None:
    whole = stack((2.0, 2.0, 8.0))
    half = whole.window((0, 0, 0), (*whole.shape[:2], 7))
    found = fp.add_regions(ventricle(size=4), late_enhancement(half))
    record = found.info["tissues"]
    assert record["unknown_ml"] > 10.0
    assert any("lie beyond the second image, which" in one["what"] for one in found.info["notices"])
    _, place = sizes(found)
    top = half.to_world([[0, 0, 6]])[0, 2]
    assert found.cell_data["scar_share"][place[:, 2] > top + 12.0].max() == 0.0


def test_what_cannot_be_marked_is_refused() -> None:
    mesh, image = ventricle(size=3, layers=2), late_enhancement(stack())
    with pytest.raises(InputError, match="no tissue of a second image; choose from scar, border"):
        fp.add_regions(mesh, image, {"wound": 1})
    with pytest.raises(InputError, match="does not occur"):
        fp.add_regions(mesh, image, {"scar": 7})
    with pytest.raises(InputError, match="give at least one"):
        fp.add_regions(mesh, image, {"healthy": 3})
    far = late_enhancement(stack())
    grid = fp.Grid(far.grid.shape, far.grid.spacing, far.grid.origin + 500.0, far.grid.direction)
    with pytest.raises(InputError, match="same world coordinates"):
        fp.add_regions(mesh, fp.Segmentation(far.labels, grid, {"scar": (1,)}))
    bare = fp.VolumeMesh(mesh.points, mesh.cells, mesh.region, mesh.facets, mesh.facet_tag)
    with pytest.raises(InputError, match="add the ventricular coordinates"):
        fp.add_regions(bare, image)


def test_levels_give_each_class_its_volume() -> None:
    rng = np.random.default_rng(1)
    scores, volume = rng.normal(size=(5000, 2)), rng.random(5000)
    wanted = np.array([0.2, 0.35]) * volume.sum()
    levels = levels_for(scores, volume, wanted, 0.0, 5.0)
    chosen = classes_of(scores, levels)
    for k in range(2):
        assert volume[chosen == k].sum() == pytest.approx(wanted[k], rel=0.02)


@pytest.mark.parametrize("cuts", [1, 2, 3, 4])
def test_samples_of_an_element_stand_for_equal_parts(cuts: int) -> None:
    rule = _lattice(cuts)
    assert rule.shape == (cuts**3, 4)
    np.testing.assert_allclose(rule.sum(axis=1), 1.0)
    np.testing.assert_allclose(rule.mean(axis=0), 0.25)
    assert rule.min() > 0.0
