"""The same bytes on every machine: templates by committed hashes, surfaces to swept mesh by processor and threads."""

from __future__ import annotations

import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from processors import processors

from femprep.template import Template, charge_template, cubed_template

pytestmark = pytest.mark.bytes

#: Of the numbers of vertices that the paper, the defaults and the fits ask for. Raise the store's VERSION with them.
CHARGES = {
    58: "a49a0eab805cff2b",
    204: "8e09df5c8e8ae619",
    227: "aa477b684631a1c9",
    300: "31487ac3a1a0e585",
    748: "854747d999e96da0",
    1180: "6afca9dbc9bc5e87",
    1500: "fc41304b1e67f0b8",
    2472: "ed2729728e7b43ee",
}
CUBES = {602: "d2cdf825e1ac5905", 1538: "b7ea71ae93a969c1"}

#: Prints a hash for each thing made of a small phantom.
_STAGES = f"""
import sys
sys.path[:0] = [{str(Path(__file__).parent / "benchmarks")!r}, {str(Path(__file__).parent)!r}]
from bench_determinism import digest, stages
from femprep.phantoms import lv_ellipsoid
seg = lv_ellipsoid().segmentation(spacing=(1.8, 1.8, 9.0), apex="uncapped")
for name, arrays in stages("phantom", seg, vertices=400, edge=5.0):
    print(name, digest(arrays))
"""

#: Makes the same again with each elementary function of NumPy one digit off in its last place, and tells what differs:
#: stands in for processors, such as those with AVX-512, for which NumPy has other code for them.
_SHAKEN = f"""
import os, sys
sys.path[:0] = [{str(Path(__file__).parent / "benchmarks")!r}, {str(Path(__file__).parent)!r}]
import numpy as np
from bench_determinism import digest, stages
from femprep.phantoms import lv_ellipsoid
names = "sin cos tan arcsin arccos arctan arctan2 sinh cosh tanh exp exp2 expm1 log log2 log10 log1p cbrt power hypot"
class Shaken:
    def __getattr__(self, name):
        own = getattr(np, name)
        return (lambda *args, **more: np.nextafter(own(*args, **more), np.inf)) if name in names.split() else own
seg = lv_ellipsoid().segmentation(spacing=(1.8, 1.8, 9.0), apex="uncapped")
def made():
    return {{name: digest(arrays) for name, arrays in stages("phantom", seg, vertices=400, edge=5.0)}}
first = made()
os.environ["FEMPREP_CACHE"] += " again"
shaken = 0
for name, module in list(sys.modules.items()):
    if name.startswith("femprep") and getattr(module, "np", None) is np:
        module.np = Shaken()
        shaken += 1
assert shaken > 50
second = made()
print({{name: (own, second[name]) for name, own in first.items() if own != second[name]}})
"""

#: Slides the vertices of a template as large as a whole heart's epicardium, whose sums a linear algebra library would
#: cut in two for two threads.
_DESCENT = """
from hashlib import sha256
import numpy as np
from femprep.mesh.energies.lbfgs import descend, on_sphere, smoother
from femprep.mesh.energies.distortion import Ideal
from femprep.template.sphere import fibonacci, triangulate
points = fibonacci(6750)
cells = triangulate(points)
ideal = Ideal.even(cells, np.full(len(cells), 4.0 * np.pi / len(cells)))
moved = points + 0.002 * np.random.default_rng(0).normal(size=points.shape)
place, steps = descend(moved, on_sphere, ideal, smoother(cells, len(points)), 1.0, 8)
assert steps == 8
print(sha256(place.points.tobytes()).hexdigest())
"""


def digest(template: Template) -> str:
    return sha256(template.directions.tobytes() + template.cells.tobytes()).hexdigest()[:16]


def told(script: str, folder: Path, processor: str, threads: int, **changes: str) -> str:
    """What a script prints in a process of its own, with code for a processor, and with stores of its own.

    Compiled code of each processor is kept beside that of the other tests, where it has a place: it takes a minute.
    """
    code = f"{os.environ.get('NUMBA_CACHE_DIR', folder / 'code')}-{processor}"
    environment = {
        **os.environ,
        "NUMBA_CPU_NAME": processor,
        "NUMBA_NUM_THREADS": str(threads),
        "OPENBLAS_NUM_THREADS": str(threads),
        "NUMBA_CACHE_DIR": code,
        "FEMPREP_CACHE": str(folder / f"templates {processor} {threads}"),
        **changes,
    }
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=1800, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("vertices", CHARGES)
def test_templates_have_the_committed_hashes(vertices: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("FEMPREP_CACHE", str(tmp_path))
    assert digest(charge_template(vertices)) == CHARGES[vertices]


@pytest.mark.parametrize("vertices", CUBES)
def test_cubed_spheres_have_the_committed_hashes(vertices: int) -> None:
    assert digest(cubed_template(vertices)) == CUBES[vertices]


@pytest.mark.slow
def test_surfaces_wall_and_swept_mesh_are_the_same_on_every_processor(tmp_path: Path) -> None:
    found = {
        (processor, threads): told(_STAGES, tmp_path, processor, threads)
        for processor in processors()
        for threads in (1, 2)
    }
    first = next(iter(found.values()))
    assert [line.split()[1] for line in first.splitlines()] == ["endocardium", "epicardium", "wall", "swept"]
    assert {key: text for key, text in found.items() if text != first} == {}


@pytest.mark.slow
def test_surfaces_wall_and_swept_mesh_are_the_same_with_other_code_of_libraries(tmp_path: Path) -> None:
    """OpenBLAS as on a processor of 2004, NumPy without the code that it chooses by processor."""
    name = processors()[-1]
    chosen = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    plain = {"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": " ".join(chosen)}
    assert told(_STAGES, tmp_path, name, 2, **plain) == told(_STAGES, tmp_path, name, 2)


@pytest.mark.slow
def test_no_position_hangs_on_the_last_digit_of_a_function_of_numpy(tmp_path: Path) -> None:
    assert told(_SHAKEN, tmp_path, processors()[-1], 2) == "{}\n"


@pytest.mark.slow
def test_a_large_surface_is_the_same_by_one_and_two_threads(tmp_path: Path) -> None:
    name = processors()[-1]
    assert told(_DESCENT, tmp_path, name, 1) == told(_DESCENT, tmp_path, name, 2)
