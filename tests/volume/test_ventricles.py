"""Regions of a mesh of both ventricles: where they lie, in one piece each, with interfaces that are smooth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from biventricular import LV_EPI, biventricular, level

from femprep.errors import InputError
from femprep.mesh.measures.volume_elements import centroids
from femprep.model import REGION_TAGS, Surface
from femprep.template import charge_template
from femprep.volume.ventricles import label_ventricles, neighbours, tidy_regions


@pytest.fixture(scope="module")
def mesh():
    return biventricular(5.0)


@pytest.fixture(scope="module")
def body():
    template = charge_template(1000)
    axes, centre, _ = LV_EPI
    return Surface(template.directions * axes + np.array(centre), template.cells)


@pytest.mark.parametrize("with_body", [True, False])
def test_each_region_lies_where_it_should(mesh, body, with_body):
    labelled = label_ventricles(mesh, body if with_body else None)
    assert set(labelled.region_names) == {"lv", "rv", "septum"}
    centre = centroids(mesh.points, mesh.cells["tetra"], "tetra")
    of = {name: centre[labelled.region == tag] for name, tag in labelled.region_names.items()}
    # The RV lies on the -x side: its free wall beyond the septum, the septum between the cavities.
    middle = {name: points[np.abs(points[:, 1]) < 8] for name, points in of.items()}
    assert middle["lv"][:, 0].max() > 25
    assert middle["septum"][:, 0].max() < 0
    assert middle["rv"][:, 0].min() < -45
    if with_body:
        outside = level(of["rv"], LV_EPI) > 1
        assert outside.mean() > 0.97
        assert (level(of["septum"], LV_EPI) < 1).mean() > 0.97


def test_each_region_is_in_one_piece(mesh, body):
    labelled = label_ventricles(mesh, body)
    pairs = neighbours(labelled)
    for tag in np.unique(labelled.region):
        inside = pairs[(labelled.region[pairs] == tag).all(axis=1)]
        reached = np.unique(inside)
        assert len(reached) == (labelled.region == tag).sum()
        assert pieces_of(inside) == 1


def pieces_of(pairs) -> int:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    nodes, local = np.unique(pairs, return_inverse=True)
    local = local.reshape(-1, 2)
    graph = coo_array((np.ones(len(local)), (local[:, 0], local[:, 1])), shape=(len(nodes),) * 2)
    return connected_components(graph, directed=False)[0]


def test_a_stray_element_joins_its_neighbours(mesh, body):
    region = label_ventricles(mesh, body).region.copy()
    centre = centroids(mesh.points, mesh.cells["tetra"], "tetra")
    stray = int(np.argmax(np.where(region == REGION_TAGS["lv"], centre[:, 0], -np.inf)))
    region[stray] = REGION_TAGS["rv"]
    assert tidy_regions(mesh, region)[stray] == REGION_TAGS["lv"]


def test_missing_facets_are_named(mesh, body):
    tags = mesh.facet_tag.copy()
    tags[tags == mesh.facet_names["endo_rv"]] = mesh.facet_names["epi"]
    with pytest.raises(InputError, match="no facets tagged 'endo_rv'"):
        label_ventricles(replace(mesh, facet_tag=tags), body)
