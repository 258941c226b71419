"""numba's kernels: kept for the next process, and beside each other by the plainest of its libraries for threads."""

import errno
import os
import subprocess
import sys
from itertools import product

import numpy as np
import pytest
from numba.core.caching import FunctionCache
from numba.core.errors import NumbaError

from femprep.mesh.compiled import compiled

#: Two threads search at once; numba's own work queue ends the process where two kernels are spread at a time.
_TWO_AT_ONCE = """
import threading
import numpy as np
from femprep.mesh.search.closest import ClosestFinder
points = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
finder = ClosestFinder(points, np.array([(0, 1, 2)]))
queries = np.random.default_rng(0).random((20000, 3))
alone = finder(queries).distance
found = []
def search():
    found.extend(finder(queries).distance for _ in range(20))
threads = [threading.Thread(target=search) for _ in range(2)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert len(found) == 40
assert all(np.array_equal(distance, alone) for distance in found)
"""


@pytest.mark.slow
def test_kernels_of_two_threads_are_spread_one_after_the_other():
    layer = {"NUMBA_THREADING_LAYER": "workqueue", "NUMBA_NUM_THREADS": "2"}
    done = subprocess.run(
        [sys.executable, "-c", _TWO_AT_ONCE], env={**os.environ, **layer}, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr


def test_full_disk_keeps_no_machine_code_and_stops_nothing(monkeypatch, caplog):
    def refuse(self, sig, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(FunctionCache, "save_overload", refuse)

    @compiled()
    def twice(x):
        return 2 * x

    assert twice(21) == 42
    assert "cannot be kept" in caplog.text


#: What the kernels' library for threads is told while it is loaded, and what the user's variables are afterwards.
_ASLEEP = """
import os
import numpy as np
from femprep.mesh.measures.tetrahedra import tetra_volumes
told = []
import femprep.mesh.compiled as room
load = room.import_module
room.import_module = lambda name: (told.append((name, os.environ.get("OMP_WAIT_POLICY"))), load(name))
for _ in range(2):
    tetra_volumes(np.eye(4, 3), np.array([(0, 1, 2, 3)]))
print(told, os.environ.get("OMP_WAIT_POLICY"))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "found"),
    [({}, "[('numba.np.ufunc.omppool', 'passive')] None"), ({"OMP_WAIT_POLICY": "active"}, "[] active")],
)
def test_threads_sleep_while_they_wait_unless_the_user_tells_them_how(given, found):
    kept = {name: value for name, value in os.environ.items() if name not in ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT")}
    done = subprocess.run(
        [sys.executable, "-c", _ASLEEP], env={**kept, **given}, capture_output=True, text=True, timeout=300
    )
    assert done.stdout.strip() == found, done.stderr


def test_a_kernel_is_compiled_once_whatever_of_its_arrays_may_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    monkeypatch.setattr(FunctionCache, "load_overload", lambda self, sig, context: None)
    monkeypatch.setattr(FunctionCache, "save_overload", lambda self, sig, data: made.append(sig))

    @compiled(writes="out")
    def add(one: np.ndarray, rest: tuple[np.ndarray, np.ndarray], out: np.ndarray) -> None:
        for i in range(len(out)):
            out[i] = one[i] + rest[0][i] + rest[1][i]

    given, kept, out = np.ones(3), np.ones(3), np.zeros(3)
    kept.flags.writeable = False
    for one, two, three in product((given, kept), repeat=3):
        add(one, (two, three), out)
    assert len(made) == 1
    assert (out == 3.0).all()
    assert given.flags.writeable
    with pytest.raises(NumbaError, match="read"):
        add(given, (given, given), kept)


def test_what_a_kernel_does_not_say_it_writes_to_it_cannot() -> None:
    @compiled(writes="")
    def spoil(values: np.ndarray) -> None:
        values[0] = 1.0

    with pytest.raises(NumbaError, match="read"):
        spoil(np.zeros(3))
