"""Limits travel with a mesh: the same verdict wherever it is judged, unless others are given."""

from __future__ import annotations

from dataclasses import replace

import pytest
from meshes import truncated_ellipsoid

from femprep.errors import InputError
from femprep.model import VolumeMesh, with_verdict, without_failure
from femprep.options import CheckOptions
from femprep.options.check import MESHER_LIMITS
from femprep.volume import check
from femprep.volume.quality.judged import carry


@pytest.fixture(scope="module")
def foreign() -> VolumeMesh:
    """Tetrahedra of a mean ratio that the defaults refuse."""
    mesh = truncated_ellipsoid("tetra")
    assert check(mesh).measures["mean_ratio"].mean < 0.82
    return mesh


def test_a_mesh_made_by_others_gets_the_defaults(foreign: VolumeMesh) -> None:
    report = check(foreign)
    assert report.options == CheckOptions().resolved()
    assert report.limits_from == "the defaults (purpose general)"
    assert any("mean of the mean ratio" in line for line in report.failures)


def test_a_mesh_keeps_the_limits_it_was_judged_by(foreign: VolumeMesh) -> None:
    asked = CheckOptions(mean_of_mean_ratio=0.3, minimum_dihedral=None, purpose="explicit")
    first = check(foreign, options=asked)
    again = check(carry(foreign, first.options, "tetwild"))
    assert again.limits == first.limits
    assert again.failures == first.failures
    assert again.options.purpose == "explicit"
    assert "the mesh's own" in again.limits_from


def test_limits_given_by_hand_win(foreign: VolumeMesh) -> None:
    mesh = carry(foreign, CheckOptions(mean_of_mean_ratio=0.3, maximum_dihedral=179.0), "sweep")
    report = check(mesh, mean_of_mean_ratio=0.99)
    assert (report.options.mean_of_mean_ratio, report.options.maximum_dihedral) == (0.99, 179.0)
    assert report.limits_from.endswith("given by hand: mean_of_mean_ratio")


def test_a_purpose_takes_the_place_of_the_limits_but_the_mesher_s(foreign: VolumeMesh) -> None:
    mesh = carry(foreign, CheckOptions(maximum_dihedral=179.0), "sweep")
    report = check(mesh, purpose="implicit")
    assert report.options == CheckOptions(purpose="implicit").resolved("sweep")
    assert report.options.mean_of_mean_ratio == MESHER_LIMITS["sweep"]["mean_of_mean_ratio"]
    assert report.limits_from == "the defaults (purpose implicit, mesher sweep)"


def test_a_swept_mesh_that_nobody_judged_has_the_limits_of_the_sweep(foreign: VolumeMesh) -> None:
    report = check(replace(foreign, info={"mesher": "sweep"}))
    assert report.options == CheckOptions().resolved("sweep")


def test_what_could_not_be_made_stays_a_failure_until_it_is(foreign: VolumeMesh) -> None:
    mesh = with_verdict(foreign, failures={"fibres": ["fibres: no facets tagged 'base'"]})
    assert "fibres: no facets tagged 'base'" in check(mesh).failures
    made = replace(mesh, info=without_failure(mesh.info, "fibres"))
    assert check(made).failures == check(foreign).failures


def test_limits_of_another_version_and_wrong_ones(foreign: VolumeMesh) -> None:
    assert check(with_verdict(foreign, limits={"of_tomorrow": 3, "worst": 2})).options.worst == 2
    with pytest.raises(InputError, match=r"minimum_dihedral.*-3"):
        check(with_verdict(foreign, limits={"minimum_dihedral": -3}))


def test_failures_against_the_labels_go_along(foreign: VolumeMesh) -> None:
    first = check(foreign)
    mesh = carry(foreign, first.options, "tetwild", ["epi lies 3 pixels off the labels"])
    assert check(mesh).failures == (*first.failures, "epi lies 3 pixels off the labels")
