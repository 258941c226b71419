"""Element quality is held to a baseline over phantoms and real maps: what falls below it beyond its tolerance fails.

``python tests/quality_cases.py`` measures it anew.
"""

import json

import numpy as np
import pytest
from quality_cases import ACDC, BASELINE, KINDS, PHANTOMS, VENTRICLES, figures, make
from slow_params import slow_but

RECORD = json.loads(BASELINE.read_text())


def fallen(case: str, kind: str) -> dict[str, tuple[float, float]]:
    """Figures below their baseline beyond its tolerance, or of inverted elements: measured, baseline."""
    found = figures(make(case, kind))
    wanted, tolerance = RECORD["cases"][f"{case} {kind}"], RECORD["tolerances"][kind.split("-")[0]]
    least = {name: wanted[name] - tolerance[name] for name in found}
    inverted = {"smallest_relative_jacobian"} if found["smallest_relative_jacobian"] <= 0.0 else set()
    return {name: (value, wanted[name]) for name, value in found.items() if value < least[name] or name in inverted}


def swept(cases) -> list[tuple[str, str]]:
    """Cases with their kinds of swept mesh."""
    return [(case, kind) for case in cases for kind in KINDS[case] if kind.startswith("sweep")]


@pytest.mark.slow
@pytest.mark.parametrize(("case", "kind"), swept(PHANTOMS))
def test_swept_phantom(case, kind):
    assert fallen(case, kind) == {}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["tetwild-fast", "tetwild-good-10"])
def test_tetwild_phantom(kind):
    assert fallen("round", kind) == {}


@pytest.mark.slow
@pytest.mark.parametrize("case", PHANTOMS)
def test_tetwild_phantom_of_good_quality(case):
    assert fallen(case, "tetwild-good") == {}


@pytest.mark.slow
@pytest.mark.parametrize("kind", VENTRICLES)
def test_ventricles_of_a_phantom(kind):
    assert fallen("ventricles", kind) == {}


@pytest.mark.data
@pytest.mark.parametrize(("case", "kind"), slow_but([one for one in swept(ACDC) if "021" in one[0]], swept(ACDC)))
def test_swept_map(data, case, kind):
    assert fallen(case, kind) == {}


def test_baseline_holds_every_case_within_the_limits_promised():
    """The baseline itself is no lower than what is promised of any mesh."""
    assert set(RECORD["cases"]) == {f"{case} {kind}" for case, kinds in KINDS.items() for kind in kinds}
    for key, values in RECORD["cases"].items():
        assert np.isfinite(list(values.values())).all()
        if "tetwild-good" in key and not key.endswith("-10"):
            assert values["smallest_dihedral"] >= 15.0, key
            assert values["mean_of_mean_ratio"] >= 0.82, key
        if "biv" in key:
            assert values["smallest_dihedral"] >= 15.0, key
            assert values["mean_of_mean_ratio"] >= 0.82, key
        if "sweep-tetra" in key and not key.endswith("10"):
            assert values["smallest_dihedral"] >= 8.0, key
            assert values["mean_of_mean_ratio"] >= 0.75, key
        if key.endswith(("sweep-wedge", "sweep-hexahedron")):
            assert values["smallest_scaled_jacobian"] >= 0.15, key
