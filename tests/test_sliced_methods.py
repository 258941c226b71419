"""The benchmark of stacks and views: methods by name, functions of others, and their surfaces in any form."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from femprep.phantoms import biventricular


@pytest.fixture(scope="module")
def bench():
    sys.path.insert(0, str(Path(__file__).parent / "benchmarks"))
    try:
        import bench_long_axis

        yield bench_long_axis
    finally:
        sys.path.pop(0)


def true_and_grown(seg):
    """A function of others: the true left ventricle as arrays, and an epicardium that is 2 mm too large."""
    heart = biventricular()
    world, ball = seg.info["world"], trimesh.creation.icosphere(subdivisions=4)
    found = {}
    for name in ("lv", "epi"):
        points = heart.exact_surface(name, ball.vertices)
        mesh = trimesh.Trimesh((points @ world["tilt"]) @ world["turn"].T + world["place"], ball.faces, process=False)
        found[name] = (mesh.vertices, mesh.faces)
    mesh.vertices = mesh.vertices + 2.0 * mesh.vertex_normals
    return found | {"epi": mesh, "liver": mesh}


def test_a_function_of_others_beside_marching_cubes(bench, capsys):
    heart = bench.phantom(biventricular(), "biv")
    names = [f"{__name__}:true_and_grown", "marching cubes"]
    own, cubes = bench.compare(heart, [3], names, {"slices": 3.0, "views": 2.0})
    assert own["lv"] < 0.25
    assert own["epi"] == pytest.approx(2.0, abs=0.3)
    assert "rv" not in own
    assert {"lv", "rv", "epi"} <= set(cubes)
    assert own["lv"] < cubes["lv"] < 3.0
    table = capsys.readouterr().out
    assert "| none |" in table
    assert f"| {names[0]} |" in table


def test_a_method_that_is_unknown(bench):
    for name in ("marching squares", "marching cubes + luck"):
        with pytest.raises(SystemExit, match="module:function"):
            bench.method_of(name)


def test_the_same_arguments_cut_the_same_scan(bench):
    heart = bench.phantom(biventricular(), "biv")
    one, two = (bench.scan(heart, 4, pixel=2.0, distance=10.0) for _ in range(2))
    np.testing.assert_array_equal(one.seg.labels, two.seg.labels)
    np.testing.assert_allclose(one.seg.grid.spacing, [2.0, 2.0, 10.0])
    assert [view.thickness for view in one.seg.views] == [6.0] * 3
