"""The example of a beating heart: fenicsx-pulse fills and contracts our mesh along our fibres, from our folder.

``FEMPREP_DOLFINX_PYTHON`` names a Python that has fenicsx-pulse and cardiac-geometriesx.
"""

from __future__ import annotations

import runpy
import shlex
from pathlib import Path

import numpy as np
import pytest
from solver_tools import dolfinx_python

EXAMPLE = Path(__file__).parents[2] / "examples" / "07_beating_heart.py"


@pytest.mark.slow
@pytest.mark.solver
def test_phantom_beats_in_fenicsx_pulse(tmp_path: Path) -> None:
    command = dolfinx_python("import h5py; from mpi4py import MPI; import pulse, cardiac_geometries")
    found = runpy.run_path(str(EXAMPLE))["main"](tmp_path, command=shlex.join(command))["femprep"]
    # Pressure brings back the shape that it was taken out of; P2 edges bend where the mesh's were straight.
    assert found["end_diastolic_mmhg"] == pytest.approx(10.0, abs=0.1)
    assert found["end_diastolic_ml"] == pytest.approx(found["image_ml"], rel=0.03)
    assert 0.5 < found["unloaded_ml"] / found["image_ml"] < 0.85
    assert 40 < found["ejection_fraction_percent"] < 75
    with np.load(tmp_path / "beat_femprep.npz") as result:
        loop, shapes = result["loop"], {name: result[name] for name in ("end_diastole", "end_systole")}
    time, volume, pressure, aorta = loop.T[:4]
    # Both valves closed: the volume stays. The outer one open: blood leaves while pressure is above the aorta's.
    shut = (pressure[1:] < aorta[1:]) & (pressure[1:] > 10.5) & (time[1:] > 0.3)
    assert shut.sum() >= 4
    np.testing.assert_allclose(np.diff(volume)[shut], 0.0, atol=1e-3)
    out = (pressure[1:] > aorta[1:] + 0.1) & (time[1:] > 0.3)
    assert out.sum() >= 3
    assert (np.diff(volume)[out] < 0).all()
    # Work of a beat, by the loop's area: mmHg mL are 1.33e-4 J.
    assert 0.2 < -((pressure[1:] + pressure[:-1]) / 2 @ np.diff(volume)) * 1.333e-4 < 2.0
    for shape in shapes.values():
        assert np.isfinite(shape).all()
        assert 1e-3 < np.linalg.norm(shape, axis=1).max() < 4e-2  # metres
