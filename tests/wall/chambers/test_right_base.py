"""A right ventricle that ends below the left one's base: the wall is cut down to a base of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import femprep as fp
from femprep.mesh.topology import border_loops
from femprep.model import FACET_TAGS
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.phantoms import biventricular
from femprep.pipeline import begin
from femprep.report.volumes import labelled_volume
from femprep.wall.anatomies import both_ventricles
from femprep.wall.chambers.right_base import cut_right_base


def short_right(slices: int) -> fp.Segmentation:
    """Both ventricles, the right one without labels in its most basal slices."""
    seg = biventricular().segmentation(spacing=(1.6, 1.6, 8.0))
    labels = np.array(seg.labels)
    last = int(np.flatnonzero((labels == 1).any(axis=(0, 1)))[-1])
    part = labels[:, :, last - slices + 1 :]
    part[part == 1] = 0
    return replace(seg, labels=labels)


@pytest.fixture(scope="module", params=[1, 2])
def cut(request):
    """The label map, the wall before and after the cut, and what it was made from."""
    options = Options(anatomy="biv", surface={"vertices": 700})
    seg, layout, _ = begin(short_right(request.param), options, Stages(None), {})
    parts = both_ventricles(seg, layout, options, Stages(None))
    whole = fp.build_wall(epi=parts.epi, endo=parts.endo, base=parts.base)
    return seg, whole, cut_right_base(whole, parts.right_base, parts.body, 1.0), parts


def test_the_left_ventricle_keeps_its_base(cut):
    seg, _, wall, parts = cut
    left = fp.find_base(seg)
    np.testing.assert_allclose(wall.planes["base"].point, left.point)
    depth = left.signed_distance(parts.right_base.point[None])[0]
    assert depth == pytest.approx(-8.0) or depth == pytest.approx(-16.0)


def test_rims_lie_in_their_planes(cut):
    _, _, wall, _ = cut
    for cavity, plane in (("endo_lv", "base"), ("endo_rv", "base_rv")):
        (rim,) = border_loops(wall.triangles[wall.facet_tag == FACET_TAGS[cavity]])
        assert np.abs(wall.planes[plane].signed_distance(wall.points[rim])).max() < 1e-9


def test_nothing_of_the_right_ventricle_lies_beyond_its_base(cut):
    _, whole, wall, parts = cut
    right = np.unique(wall.triangles[wall.facet_tag == FACET_TAGS["endo_rv"]])
    assert parts.right_base.signed_distance(wall.points[right]).max() < 1e-9
    assert wall.volume < whole.volume


def test_cavities_hold_what_the_labels_hold_below_their_bases(cut):
    seg, _, wall, _ = cut
    blood = fp.fill_cavities(wall)
    for name, plane in (("lv", "base"), ("rv", "base_rv")):
        cells = blood.cavities[name]
        volume = np.linalg.det(blood.points[cells]).sum() / 6.0
        assert volume == pytest.approx(labelled_volume(seg, name, [wall.planes[plane]]), rel=0.03)


def test_a_run_reports_it():
    run = fp.mesh_segmentation(short_right(1), anatomy="biv", surface={"vertices": 700}, volume={"edge_length": 6.0})
    assert {"base", "base_rv"} <= set(run.mesh.facet_names)
    off = run.mesh.planes["base_rv"].signed_distance(
        run.mesh.points[np.unique(run.mesh.facets["triangle"][run.mesh.facet_tag == FACET_TAGS["base_rv"]])]
    )
    assert np.abs(off).max() < 1e-6
    assert all(abs(item.difference_percent) < 3.0 for item in run.volumes if "cavity" in item.name)
    assert any(
        "base of the right ventricle" in notice["what"] for notice in run.wall.planes["base_rv"].record()["notices"]
    )


def test_a_given_base_cuts_both():
    seg = short_right(1)
    base = fp.find_common_base(seg)
    run_options = Options(anatomy="biv", wall={"base": (*base.point.tolist(), *base.normal.tolist())})
    _, layout, _ = begin(seg, run_options, Stages(None), {})
    assert layout.right_base is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("failures", "planes", "words"), [(1, ["base", "base_rv"], "both bases"), (9, ["base"], "one plane")]
)
def test_where_two_bases_give_no_wall_they_move_or_one_plane_cuts_both(failures, planes, words, monkeypatch):
    left = iter(range(failures))

    def cut(*args):
        if next(left, None) is not None:
            raise fp.StageError("no wall")
        return cut_right_base(*args)

    monkeypatch.setattr("femprep.stages.fill.cut_right_base", cut)
    run = fp.mesh_segmentation(short_right(1), anatomy="biv", surface={"vertices": 700}, volume={"edge_length": 6.0})
    assert list(run.wall.planes) == planes
    assert any(words in notice["what"] for notice in run.wall.info["notices"])
