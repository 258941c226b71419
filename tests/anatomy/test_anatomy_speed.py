"""Fibres and coordinates of 200,000 elements within 5 s of processor time."""

from __future__ import annotations

import time

import pytest
from anatomy_meshes import ellipsoid

from femprep.anatomy import WallFields, add_coordinates, add_fibres


@pytest.mark.slow
def test_two_hundred_thousand_elements_in_five_seconds():
    mesh = ellipsoid("tetra", size=16, layers=10).mesh
    assert mesh.n_cells > 199_000
    start = time.process_time()  # not the wall clock: other work on the machine does not count
    fields = WallFields(mesh)
    add_fibres(add_coordinates(mesh, fields=fields), fields=fields)
    assert time.process_time() - start < 5.0
