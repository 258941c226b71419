"""Templates: Euler's count, outward triangles, evenness, the platonic solids, the same bytes each time."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from faults import faults
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.errors import InputError, StageError
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.topology import euler_characteristic, is_closed, is_consistently_wound
from femprep.template import charge_template, sphere_points
from femprep.template.charges import relax
from femprep.template.sphere import Template, fibonacci, triangulate

pytestmark = pytest.mark.bytes


def faults_of_sphere(template: Template, vertices: int) -> list[str]:
    """What a template is not that a sphere of so many vertices is: of its size and radius, closed, wound outward."""
    d, t = template.directions, template.cells
    a, b, c = (d[t[:, k]] for k in range(3))
    off = np.abs(np.linalg.norm(d, axis=1) - 1.0).max()
    return faults(
        (d.shape == (vertices, 3), f"directions of shape {d.shape}"),
        (t.shape == (2 * vertices - 4, 3), f"cells of shape {t.shape}"),
        (off < 1e-14, f"a vertex {off} off the sphere"),
        (is_closed(t), "not closed"),
        (is_consistently_wound(t), "not consistently wound"),
        (euler_characteristic(t) == 2, f"Euler characteristic {euler_characteristic(t)}"),
        (np.all(np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0.0), "a triangle wound inward"),
    )


@settings(deadline=None, max_examples=10)
@given(st.integers(12, 300))
def test_any_number_of_vertices(vertices: int) -> None:
    assert faults_of_sphere(charge_template(vertices), vertices) == []


@pytest.mark.parametrize("vertices", [748, 1500, pytest.param(2472, marks=pytest.mark.slow)])
def test_sizes_of_the_paper_are_even(vertices: int) -> None:
    template = charge_template(vertices)
    assert faults_of_sphere(template, vertices) == []
    quality = triangle_quality(template.directions, template.cells)
    # The paper's own spheres reach a mean of 0.93 to 0.95.
    assert quality.mean() > 0.985
    assert quality.min() > 0.7


@pytest.mark.parametrize("vertices", [3001])
def test_cut_off_force_is_as_even(vertices: int) -> None:
    template = charge_template(vertices)
    assert faults_of_sphere(template, vertices) == []
    quality = triangle_quality(template.directions, template.cells)
    assert quality.mean() > 0.985
    assert quality.min() > 0.7


@pytest.mark.slow
@pytest.mark.parametrize("vertices", [8000, 20_000])
def test_largest_templates(vertices: int) -> None:
    template = charge_template(vertices)
    assert faults_of_sphere(template, vertices) == []
    assert triangle_quality(template.directions, template.cells).mean() > 0.985


@pytest.mark.parametrize(
    ("count", "energy"), [(4, 3.674234614), (6, 9.985281374), (12, 49.165253058), (24, 223.34707405)]
)
def test_energies_are_the_known_minima(count: int, energy: float) -> None:
    # Thomson's problem: Wales & Ulker 2006, doi 10.1103/PhysRevB.74.212101.
    points = sphere_points(count)
    first, second = np.triu_indices(count, 1)
    assert np.sum(1.0 / np.linalg.norm(points[first] - points[second], axis=1)) == pytest.approx(energy, abs=1e-7)


def test_twelve_charges_make_an_icosahedron() -> None:
    template = charge_template(12)
    edges = np.linalg.norm(
        template.directions[template.cells] - template.directions[template.cells[:, [1, 2, 0]]], axis=2
    )
    np.testing.assert_allclose(edges, 1.0514622242382672, atol=1e-6)


def test_vertices_run_from_north_to_south() -> None:
    assert np.all(np.diff(charge_template(500).directions[:, 2]) <= 0.0)


def test_relaxing_lowers_the_energy() -> None:
    def energy(points: np.ndarray) -> float:
        first, second = np.triu_indices(len(points), 1)
        return float(np.sum(1.0 / np.linalg.norm(points[first] - points[second], axis=1)))

    start = fibonacci(150)
    assert energy(relax(start)) < energy(start) - 1.0


@pytest.mark.parametrize("vertices", [0, 11, 20_001])
def test_numbers_out_of_range_are_refused(vertices: int) -> None:
    with pytest.raises(InputError, match=f"template with {vertices} vertices asked for, expected 12 to 20000"):
        charge_template(vertices)


def test_too_few_points_are_refused() -> None:
    with pytest.raises(InputError, match="at least 4"):
        sphere_points(3)


@pytest.mark.parametrize(
    "directions",
    [
        np.vstack([fibonacci(20), fibonacci(20)[:1]]),
        fibonacci(40)[:15],
        np.tile([[0.0, 0.0, 1.0]], (8, 1)),
    ],
    ids=["coincident", "half a sphere", "one point"],
)
def test_points_without_a_sphere_have_no_triangulation(directions: np.ndarray) -> None:
    with pytest.raises(StageError, match=r"points on the sphere|the hull of"):
        triangulate(directions)


_CHILD = """
import hashlib, sys
from femprep.template import charge_template
digest = hashlib.sha256()
for vertices in map(int, sys.argv[1:]):
    template = charge_template(vertices)
    digest.update(template.directions.tobytes() + template.cells.tobytes())
print(digest.hexdigest())
"""


@pytest.mark.slow
def test_same_bytes_with_one_thread_and_two(tmp_path: Path) -> None:
    # 4000 charges: beyond the size at which OpenBLAS splits sums among threads.
    digests = []
    for threads in ("1", "2"):
        child = subprocess.run(
            [sys.executable, "-c", _CHILD, "150", "800", "4000"],
            env={
                **os.environ,
                "FEMPREP_CACHE": str(tmp_path / threads),
                "NUMBA_NUM_THREADS": threads,
                "OPENBLAS_NUM_THREADS": threads,
            },
            capture_output=True,
            text=True,
            check=True,
        )
        digests.append(child.stdout.strip())
    assert digests[0] == digests[1]
    files = [sorted(path.name for path in (tmp_path / threads).iterdir()) for threads in ("1", "2")]
    assert files[0] == files[1]
    for name in files[0]:
        one, two = ((tmp_path / threads / name).read_bytes() for threads in ("1", "2"))
        assert hashlib.sha256(one).digest() == hashlib.sha256(two).digest()
