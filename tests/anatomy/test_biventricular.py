"""Both ventricles: coordinates, segments and fibres on each wall, no jumps inside, the hand, ldrb as a witness."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from biventricular import LV_EPI, RV_EPI, biventricular, level

from femprep.anatomy.aha import add_aha
from femprep.anatomy.axes.find_axes import ventricular_axes
from femprep.anatomy.axes.mirror import flip
from femprep.anatomy.axes.ventricular_axes import VentricularAxes
from femprep.anatomy.coordinates import add_coordinates
from femprep.anatomy.fibres import add_fibres, helix_angle, quadrature_fibres
from femprep.anatomy.frames import make_frames
from femprep.anatomy.laplace.fields import WallFields
from femprep.anatomy.rules import node_fields
from femprep.mesh.elements import element_faces


@pytest.fixture(scope="module")
def fields() -> WallFields:
    return WallFields(biventricular(5.0))


def _lines(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip(np.abs(np.sum(a * b, axis=-1)), 0, 1)))


def _wall_angles(fields: WallFields, **options) -> dict[str, np.ndarray]:
    """Helix angles at the nodes of each surface, in the frame of its own outward direction."""
    mesh = add_fibres(fields.mesh, fields=fields, nodes=True, **options)
    nodes = node_fields(fields)
    outward = {"lv": -nodes.to_across, "rv": nodes.to_across, "epi": nodes.to_outside}
    fibre = mesh.point_data["fiber"][fields.space.nodes]
    rim = np.union1d(fields.base, fields.apex_nodes)
    lv, rv = np.setdiff1d(fields.lv, rim), np.setdiff1d(fields.rv, rim)
    epi = np.setdiff1d(fields.epi, np.concatenate([rim, lv, rv]))
    right = nodes.side < 0
    groups = {
        "lv": ("lv", lv),
        "rv": ("rv", rv),
        "epi_lv": ("epi", epi[~right[epi]]),
        "epi_rv": ("epi", epi[right[epi]]),
    }
    return {k: helix_angle(fibre[at], nodes.to_base[at], outward[side][at]) for k, (side, at) in groups.items()}


@pytest.mark.slow
def test_mesh_is_found_anatomical_and_its_twin_mirrored(fields):
    assert fields.axes.mirrored is False
    assert fields.axes.septal[0] < -0.9
    assert fields.axes.anterior[1] < -0.9
    assert ventricular_axes(flip(fields.mesh)).mirrored is True


def test_insertion_points_lie_in_the_grooves(fields):
    front, back = fields.axes.insertions["anterior"], fields.axes.insertions["inferior"]
    for point in (front, back):
        assert level(point[None], LV_EPI)[0] == pytest.approx(1, abs=0.08)
        assert level(point[None], RV_EPI)[0] == pytest.approx(1, abs=0.08)
    assert front[1] < -20
    assert back[1] > 20
    turn = fields.axes.angle(np.array([front, back]))
    assert turn[0] == pytest.approx(360 - turn[1], abs=1e-6)
    given = VentricularAxes([0.0, 0, -62], [0.0, 0, 10], [-1.0, 0, 0], False)
    kept = WallFields(fields.mesh, given).axes
    assert kept.septal == pytest.approx([-1, 0, 0])
    assert sorted(kept.insertions) == ["anterior", "inferior"]


def test_coordinates_on_their_surfaces(fields):
    mesh = add_coordinates(fields.mesh, fields=fields)
    depth, side = mesh.point_data["transmural"], mesh.point_data["transventricular"]
    assert depth[fields.lv] == pytest.approx(0, abs=0)
    assert depth[fields.rv] == pytest.approx(0, abs=0)
    only = np.setdiff1d(fields.epi, np.union1d(fields.lv, fields.rv))
    assert depth[only] == pytest.approx(1, abs=0)
    assert (side[fields.lv] == 0).all()
    assert (side[fields.rv] == 1).all()
    x = mesh.points[only]
    assert side[only][x[:, 0] > 5].max() == 0
    assert side[only][x[:, 0] < -40].min() == 1
    assert set(np.unique(side)) == {0.0, 1.0}
    # Mid-septum, between the cavities: as deep as it gets.
    septum = np.abs(mesh.points - [-27.0, 0, -5]).max(axis=1) < 2.0
    assert depth[septum].max() > 0.6


def test_depth_is_linear_in_the_septum(fields):
    mesh = add_coordinates(fields.mesh, fields=fields)
    x = mesh.points
    near = (np.abs(x[:, 1]) < 6) & (np.abs(x[:, 2]) < 6) & (x[:, 0] < 0)
    radius = np.hypot(x[near, 0], x[near, 1])
    inner, outer = 22 * np.sqrt(1 - (x[near, 2] / 52) ** 2), 32 * np.sqrt(1 - (x[near, 2] / 62) ** 2)
    share = (radius - inner) / (outer - inner)
    septum = (share >= -0.01) & (share <= 1.01)
    true = 1 - np.abs(1 - 2 * share[septum])
    assert np.count_nonzero(septum) > 10
    assert np.abs(mesh.point_data["transmural"][near][septum] - true).max() < 0.08


def test_every_segment_of_both_ventricles_is_there(fields):
    mesh = add_aha(fields.mesh, fields=fields)
    assert sorted(mesh.info["aha"]["volumes_mm3"]) == [*range(1, 18), *range(21, 30)]
    centre = mesh.points[mesh.cells["tetra"]].mean(axis=1)
    segment = mesh.cell_data["aha"]
    assert centre[segment >= 21, 0].max() < 5
    for front, back in ((21, 23), (24, 26), (27, 29)):
        assert centre[segment == front, 1].mean() < centre[segment == back, 1].mean()
    assert centre[segment == 21, 2].mean() > centre[segment == 27, 2].mean()
    corner = mesh.points[mesh.facets["triangle"]]
    septal = (np.abs(level(corner.reshape(-1, 3), LV_EPI) - 1).reshape(-1, 3) < 1e-4).all(axis=1)
    septal &= (mesh.facet_tag == mesh.facet_names["endo_rv"]) & (np.abs(corner[..., 1]).max(axis=1) < 12)
    assert np.count_nonzero(septal) > 20
    assert np.isin(mesh.facet_data["aha"][septal], [2, 3, 8, 9, 14]).all()  # the septum is the LV's, on both sides


def test_helix_angles_on_the_walls_are_those_asked_for(fields):
    angles = _wall_angles(fields)
    for name, wanted in (("lv", 60), ("rv", 60), ("epi_lv", -60), ("epi_rv", -60)):
        error = np.abs((angles[name] - wanted + 90) % 180 - 90)
        assert np.median(error) < 0.5, name
        assert np.mean(error < 10) > 0.95, name


def test_right_ventricle_may_have_its_own_angles_and_zero_is_an_angle(fields):
    angles = _wall_angles(fields, endo_angle=60.0, epi_angle=-60.0, rv_endo_angle=80.0, rv_epi_angle=0.0)
    assert np.median(angles["lv"]) == pytest.approx(60, abs=0.5)
    assert np.median(angles["rv"]) == pytest.approx(80, abs=0.5)
    assert np.median(angles["epi_lv"]) == pytest.approx(-60, abs=0.5)
    assert np.median(angles["epi_rv"]) == pytest.approx(0, abs=0.5)


def test_default_rule_does_not_jump_where_the_printed_one_does(fields):
    faces = element_faces(fields.mesh.cells)["triangle"]
    _, inverse = np.unique(np.sort(faces.nodes, axis=1), axis=0, return_inverse=True)
    order = np.argsort(inverse.ravel(), kind="stable")
    same = np.diff(inverse.ravel()[order]) == 0
    one, two = faces.element[order][:-1][same], faces.element[order][1:][same]

    def steps(**options) -> float:
        fibre = add_fibres(fields.mesh, fields=fields, **options).cell_data["fiber"]
        return float(np.mean(_lines(fibre[one], fibre[two]) > 60))

    assert steps() < 0.005
    assert steps(rule="bayer", depth="laplace") > 0.05


@pytest.mark.parametrize("rule", ["linear", "bayer"])
def test_orthonormal_everywhere(fields, rule):
    mesh = add_fibres(fields.mesh, fields=fields, rule=rule, nodes=True, endo_sheet_angle=30.0, epi_sheet_angle=-20.0)
    triads = [np.stack([t["fiber"], t["sheet"], t["normal"]], axis=2) for t in (mesh.cell_data, mesh.point_data)]
    triads += [t.reshape(-1, 3, 3) for t in quadrature_fibres(mesh, fields=fields, rule=rule).values()]
    for t in triads:
        assert np.abs(np.einsum("nij,nik->njk", t, t) - np.eye(3)).max() < 1e-10
        assert np.linalg.det(t) == pytest.approx(1.0)
    correlation = mesh.info["fibres"]["depth_angle_correlation"]
    assert correlation["lv"] < -0.85
    assert correlation["rv"] < -0.85


@pytest.mark.parametrize("rule", ["linear", "bayer"])
def test_mirrored_twin_has_mirrored_fibres(fields, rule):
    mesh = add_fibres(fields.mesh, fields=fields, rule=rule, endo_sheet_angle=20.0)
    twin = flip(mesh)
    again = add_fibres(twin, rule=rule, endo_sheet_angle=20.0)
    assert again.info["fibres"]["mirrored"] is True
    # Where two frames are equally near, rounding decides the way round: a handful of elements.
    for name in ("fiber", "sheet"):
        assert np.mean(_lines(again.cell_data[name], twin.cell_data[name]) > 1e-3) < 2e-3


def test_sheets_run_through_the_wall(fields):
    mesh = add_fibres(fields.mesh, fields=fields)
    cells = node_fields(fields).each(fields.space.to_cells)
    frames, _ = make_frames(cells.to_base, cells.to_outside)
    outer = (cells.outside > 0.8) & (np.abs(cells.across) < 0.2)
    assert np.median(_lines(mesh.cell_data["sheet"], frames[:, :, 2])[outer]) < 3.0


_LDRB = """
import sys, json, types
sys.modules["h5py"] = types.ModuleType("h5py")  # ldrb needs it for saving alone
import dolfin as df, ldrb, numpy as np
source, target, angles, markers = sys.argv[1], sys.argv[2], json.loads(sys.argv[3]), json.loads(sys.argv[4])
d = np.load(source)
mesh, editor = df.Mesh(), df.MeshEditor()
editor.open(mesh, "tetrahedron", 3, 3)
editor.init_vertices(len(d["points"])); editor.init_cells(len(d["cells"]))
for i, p in enumerate(d["points"]): editor.add_vertex(i, p)
for i, c in enumerate(d["cells"]): editor.add_cell(i, np.sort(c).astype(np.uintp))
editor.close(False)
mesh.init(2, 0)
tags = df.MeshFunction("size_t", mesh, 2, 0)
known = {tuple(sorted(f)): int(t) for f, t in zip(d["facets"], d["tags"])}
for facet in df.facets(mesh):
    tag = known.get(tuple(sorted(facet.entities(0))))
    if tag is not None: tags[facet] = tag
fibre, _, _ = ldrb.dolfin_ldrb(mesh=mesh, fiber_space="DG_0", ffun=tags, markers=markers, log_level=40, **angles)
values, dofs = fibre.vector().get_local(), fibre.function_space().dofmap()
np.save(target, np.array([values[dofs.cell_dofs(c)] for c in range(mesh.num_cells())]))
"""


@pytest.mark.slow
@pytest.mark.solver
def test_printed_rule_agrees_with_ldrb(tmp_path, capsys):
    """Needs a Python with legacy dolfin and ldrb, named by FEMPREP_LDRB_PYTHON (or /usr/bin/python3)."""
    python = os.environ.get("FEMPREP_LDRB_PYTHON", "/usr/bin/python3")
    probe = "import sys, types; sys.modules['h5py'] = types.ModuleType('h5py'); import dolfin, ldrb"
    if not Path(python).exists() or subprocess.run([python, "-c", probe], capture_output=True).returncode:
        pytest.skip(f"{python} has no dolfin and ldrb; set FEMPREP_LDRB_PYTHON")
    fields = WallFields(biventricular(4.0))
    mesh = fields.mesh
    source, target = tmp_path / "mesh.npz", tmp_path / "fibre.npy"
    np.savez(source, points=mesh.points, cells=mesh.cells["tetra"], facets=mesh.facets["triangle"], tags=mesh.facet_tag)
    angles = {"alpha_endo_lv": 40, "alpha_epi_lv": -50, "beta_endo_lv": -90, "beta_epi_lv": -90}
    names = mesh.facet_names
    markers = {"lv": names["endo_lv"], "rv": names["endo_rv"], "epi": names["epi"], "base": names["base"]}
    command = [python, "-c", _LDRB, str(source), str(target), json.dumps(angles), json.dumps(markers)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr[-2000:]
    ours = add_fibres(mesh, fields=fields, endo_angle=40.0, epi_angle=-50.0, rule="bayer", depth="laplace")
    error = _lines(ours.cell_data["fiber"], np.load(target))
    mean = float(np.average(error, weights=fields.space.volume))
    with capsys.disabled():
        print(
            f"\nldrb against femprep: mean {mean:.2f}, median {np.median(error):.2f} degrees over {len(error)} elements"
        )
    assert mean < 3.0
    assert np.median(error) < 1.0
