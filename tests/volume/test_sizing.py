"""Edge lengths that vary: thickness of the wall, fields of the user, gradation, and what fTetWild makes of them."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from analytic_walls import ellipsoid_wall
from scipy.spatial import cKDTree

from femprep.errors import FileError, InputError, OptionError, ResourceError
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FACET_TAGS, Wall
from femprep.options import QUALITY, Options, VolumeOptions, choose
from femprep.volume import tetrahedralize
from femprep.volume.background import background_field
from femprep.volume.blood import Filling
from femprep.volume.quality.transmural import elements_through_wall, mesh_edges
from femprep.volume.refine.plan import measured_thickness
from femprep.volume.sizing import THROUGH, read_sizing, sizing_field, thickness_at
from femprep.volume.validate import check_sizing
from femprep.wall import fill_cavities


def ball_wall(inner: float = 20.0, outer: float = 30.0) -> Wall:
    """Half a spherical shell, 10 mm thick, cut at z = 0."""
    return ellipsoid_wall((inner,) * 3, (outer,) * 3, height=0.0, rings=16, layers=3)


def test_thickness_is_that_of_the_shell():
    rng = np.random.default_rng(3)
    direction = rng.normal(size=(200, 3))
    direction[:, 2] = -np.abs(direction[:, 2]) - 0.2
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    points = direction * rng.uniform(21.0, 29.0, (200, 1))
    # Chords of the triangles lie up to l^2 / 8 r inside: 0.1 mm at these edges of 2 and 3 mm.
    np.testing.assert_allclose(thickness_at(ball_wall(), points), 10.0, atol=0.15)


def test_septum_counts_between_its_two_cavities():
    """Three sheets: the two nearest ones bound the tissue, whatever their names."""
    wall = ball_wall()
    tag = np.array(wall.facet_tag)
    centre = wall.points[wall.triangles].mean(axis=1)
    tag[(tag == FACET_TAGS["endo"]) & (centre[:, 0] > 0)] = FACET_TAGS["endo_rv"]
    three = Wall(wall.points, wall.triangles, tag, wall.template, wall.planes)
    x = np.array([[-15.0, 0.0, -20.0], [15.0, 0.0, -20.0]])
    np.testing.assert_allclose(thickness_at(three, x), thickness_at(wall, x))
    between = np.array([[0.0, 0.0, -20.2]])
    assert thickness_at(three, between)[0] < 1.0


def test_one_sheet_has_no_thickness():
    wall = ball_wall()
    tag = np.full(len(wall.triangles), FACET_TAGS["epi"])
    with pytest.raises(InputError, match="no two sheets"):
        thickness_at(Wall(wall.points, wall.triangles, tag, wall.template), wall.points)


def test_no_field_where_one_length_holds():
    assert sizing_field(ball_wall(), VolumeOptions()) is None


@pytest.mark.slow
def test_lengths_grow_outside_of_what_is_filled():
    """Blood is filled: in a cavity with it edges are as the wall next to them wants them."""
    wall = ball_wall()
    filling = Filling(wall, fill_cavities(wall))
    asked = VolumeOptions(elements_through_wall=4)
    bare, filled = sizing_field(wall, asked), sizing_field(wall, asked, body=filling.outer)
    np.testing.assert_array_equal(bare.points, filled.points)
    far = ClosestFinder(wall.points, wall.triangles).signed(bare.points)
    # Nodes of cubes that reach into the body keep their lengths: cubes of 1.5 mm.
    reached = far < 1.5
    for field in (bare, filled):
        assert field.values[reached].max() == pytest.approx(field.coarsest)
        assert (field.values <= field.coarsest + far.clip(0.0)).all()
    middle = np.argmin(np.linalg.norm(bare.points - [0.0, 0.0, -3.0], axis=1))
    assert far[middle] > 15.0
    assert bare.values[middle] > 10.0
    assert filled.values[middle] == pytest.approx(filled.coarsest, rel=0.03)


@pytest.mark.slow
def test_lengths_follow_thickness_and_count():
    wall = ball_wall()
    for number in (2, 4):
        field = sizing_field(wall, VolumeOptions(elements_through_wall=number))
        assert field.finest == pytest.approx(THROUGH * 10.0 / number, rel=0.03)
        # At the inner rim of the base a point is as near to the epicardium as elsewhere: the length is the same.
        assert field.coarsest == pytest.approx(THROUGH * 10.0 / number, rel=0.03)
        assert field.elements == pytest.approx(wall.volume / (THROUGH * 10.0 / number) ** 3, rel=0.05)
    capped = sizing_field(wall, VolumeOptions(elements_through_wall=2, edge_length=3.0))
    assert capped.coarsest == 3.0


@pytest.mark.slow
def test_a_field_is_a_function_or_points_with_values_or_a_file(tmp_path):
    import pyvista

    wall = ball_wall()
    wanted = lambda x: 2.0 + 0.05 * (x[:, 0] + 30.0)  # noqa: E731
    grid = pyvista.ImageData(dimensions=(62, 62, 42), spacing=(1, 1, 1), origin=(-30.5, -30.5, -35.5))
    points = np.asarray(grid.points, dtype=float)
    grid.point_data["edge_length"] = wanted(points)
    grid.save(tmp_path / "field.vti")
    options = VolumeOptions()
    called = sizing_field(wall, options, wanted)
    given = sizing_field(wall, options, (points, wanted(points)))
    read = sizing_field(wall, VolumeOptions(sizing=str(tmp_path / "field.vti")))
    assert np.abs(called.values - given.values).max() <= 0.05
    np.testing.assert_array_equal(read.values, given.values)
    assert called.finest == pytest.approx(2.0, abs=0.1)
    assert called.coarsest == pytest.approx(5.0, abs=0.15)


@pytest.mark.slow
def test_lengths_grow_no_faster_than_the_gradation():
    wall = ball_wall()
    jump = lambda x: np.where(x[:, 0] < 0.0, 1.0, 9.0)  # noqa: E731
    for rate in (0.1, 0.5):
        field = sizing_field(wall, VolumeOptions(gradation=rate), jump)
        pairs = field.tets[:, [0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3]].reshape(-1, 2)
        near = ClosestFinder(wall.points, wall.triangles).signed(field.points) < 1.5
        pairs = pairs[near[pairs].all(axis=1)]
        apart = np.linalg.norm(field.points[pairs[:, 0]] - field.points[pairs[:, 1]], axis=1)
        assert (np.abs(np.diff(field.values[pairs], axis=1)[:, 0]) <= rate * apart + 1e-9).all()
        assert field.values.min() == 1.0
        low = near & (field.points[:, 0] < -5.0)
        assert (field.values[low] == 1.0).all()


def test_background_mesh_is_sound_and_covers_the_wall():
    wall = ball_wall()
    field = sizing_field(wall, VolumeOptions(elements_through_wall=2))
    corners = field.points[field.tets]
    volume = np.einsum("ij,ij->i", corners[:, 1] - corners[:, 0],
                       np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 0])) / 6  # fmt: skip
    assert volume.min() > 0
    assert volume.sum() == pytest.approx(np.prod(np.ptp(field.points, axis=0)))
    assert (field.points.min(axis=0) < wall.points.min(axis=0)).all()
    assert (field.points.max(axis=0) > wall.points.max(axis=0)).all()


@pytest.mark.parametrize(
    ("sizing", "message"),
    [
        (lambda x: np.full(len(x), np.nan), "edge length nan at"),
        (lambda x: -np.ones(len(x)), "edge length -1 at"),
        (lambda x: np.ones(3), "array of shape"),
        ((np.zeros((2, 2)), np.ones(2)), "points of the sizing field"),
        ((np.zeros((2, 3)), np.ones(3)), "lengths of the sizing field"),
    ],
)
def test_wrong_fields_are_refused(sizing, message):
    with pytest.raises(InputError, match=message):
        sizing_field(ball_wall(), VolumeOptions(), sizing)


def test_wrong_files_are_refused(tmp_path):
    import pyvista

    with pytest.raises(FileError, match="not there"):
        read_sizing(tmp_path / "none.vti")
    (tmp_path / "bad.vtu").write_text("no VTK")
    with pytest.raises(FileError):
        read_sizing(tmp_path / "bad.vtu")
    other = pyvista.ImageData(dimensions=(2, 2, 2))
    other.point_data["size"] = np.ones(8)
    other.save(tmp_path / "other.vti")
    with pytest.raises(FileError, match=r"no point data 'edge_length' \(found: size\)"):
        read_sizing(tmp_path / "other.vti")


def test_files_that_may_run_something_are_not_opened(tmp_path):
    class Evil:
        def __reduce__(self):
            return Path.touch, (tmp_path / "taken",)

    (tmp_path / "field.pkl").write_bytes(pickle.dumps(Evil()))
    with pytest.raises(FileError, match=r"field\.pkl' is of an unknown format; name a \.vti"):
        read_sizing(tmp_path / "field.pkl")
    assert not (tmp_path / "taken").exists()


def test_too_many_elements_are_refused_before_any_meshing():
    field = sizing_field(ball_wall(), VolumeOptions(), lambda x: np.full(len(x), 0.05))
    with pytest.raises(ResourceError, match="memory_limit"):
        check_sizing(field, VolumeOptions())


def test_quality_names_targets_that_options_override():
    assert VolumeOptions().targets == QUALITY["good"]
    assert VolumeOptions(quality="best").targets.minimum_dihedral == 20.0
    given = VolumeOptions(quality="fast", stop_energy=8.0, mean_ratio=0.9, retries=0).targets
    assert (given.stop_energy, given.mean_ratio, given.retries) == (8.0, 0.9, 0)
    assert given.minimum_dihedral == QUALITY["fast"].minimum_dihedral
    with pytest.raises(OptionError, match="'quality' is 'great'"):
        choose(VolumeOptions, None, {"quality": "great"})
    # What was left to the defaults stays so through further changes: no largest edge was asked for.
    assert choose(VolumeOptions, VolumeOptions(quality="best"), {"order": 2}).largest_edge is None
    assert choose(VolumeOptions, VolumeOptions(edge_length=2.5), {"order": 2}).largest_edge == 2.5


def test_sweep_takes_layers_and_order_from_the_same_options():
    layers = Options(volume={"elements_through_wall": 3, "order": 2, "edge_length": 4.0}).layers
    assert (layers.layers, layers.order, layers.edge_length) == (3, 2, 4.0)
    own = Options(
        volume={"mesher": "sweep", "elements_through_wall": 3, "order": 2}, sweep={"layers": 5, "order": 1}
    ).layers
    assert (own.layers, own.order) == (5, 1)


def test_sweep_takes_no_sizing_field():
    with pytest.raises(OptionError, match=r"does not read volume\.sizing.*--mesher tetwild"):
        choose(Options, None, {"volume": {"mesher": "sweep", "sizing": "field.vti"}})


@pytest.mark.slow
def test_edges_follow_the_field():
    """Fine on one side, coarse on the other: mean edges of either side within a fifth of what was asked for."""
    wall = ellipsoid_wall(rings=10, layers=2)
    mesh = tetrahedralize(
        wall, quality="fast", retries=0, gradation=1.0, sizing=lambda x: np.where(x[:, 0] < 0.0, 3.0, 7.0)
    )
    edges = mesh_edges(mesh.cells)
    length = np.linalg.norm(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]], axis=1)
    x = mesh.points[edges].mean(axis=1)[:, 0]
    assert length[x < -8.0].mean() == pytest.approx(3.0, rel=0.2)
    assert length[x > 10.0].mean() == pytest.approx(7.0, rel=0.25)
    assert mesh.info["edge_length_mm"] == [pytest.approx(3.0), pytest.approx(7.0)]


@pytest.mark.slow
def test_elements_through_the_wall_are_as_many_as_asked_for():
    wall = ellipsoid_wall(rings=10, layers=2)
    mesh = tetrahedralize(wall, quality="fast", retries=0, elements_through_wall=2)
    count = elements_through_wall(mesh)
    found = mesh.info["elements_through_wall"]
    assert found["asked"] == 2
    assert found["share_of_nodes"] == (count >= 2).mean() >= 0.95
    assert found["minimum"] == count.min()
    assert count.max() <= 4


@pytest.mark.slow
def test_edges_follow_a_wall_that_is_thinner_than_they_are_long():
    wall = ellipsoid_wall((22.0, 22.0, 42.0), (31.0, 25.0, 51.0), 10.0, rings=24)
    thickness = measured_thickness(wall)
    field = background_field(Filling(wall, None), 5.0, 0.3, thickness)
    at = cKDTree(field.points).query([[0.0, 23.5, 0.0], [26.5, 0.0, 0.0]])[1]
    # 3 mm thick on the y axis, 9 mm on the x axis.
    assert field.values[at[0]] == pytest.approx(1.05 * 3.0, rel=0.1)
    assert field.values[at[1]] == 5.0
    assert (field.finest, field.coarsest) == (pytest.approx(1.05 * thickness.values.min()), 5.0)
    assert 11.0 * field.elements > wall.volume / 5.0**3
