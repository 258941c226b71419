"""The cubed sphere: counts, valences, orientation, evenness, and the area of the sphere as it is refined."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.errors import InputError
from femprep.mesh.topology import is_closed, is_consistently_wound
from femprep.model import Surface
from femprep.template.cubed import cubed_sphere


@settings(deadline=None, max_examples=15)
@given(cells=st.integers(1, 24))
def test_it_is_a_closed_sphere_of_quadrilaterals(cells):
    template = cubed_sphere(cells)
    assert len(template.cells) == 6 * cells**2
    assert len(template.directions) == 6 * cells**2 + 2
    assert np.allclose(np.linalg.norm(template.directions, axis=1), 1.0)
    assert np.bincount(np.bincount(template.cells.ravel()), minlength=5)[3] == 8
    assert is_closed(template.cells)
    assert is_consistently_wound(template.cells)
    middle = template.directions[template.cells]
    outward = np.cross(middle[:, 2] - middle[:, 0], middle[:, 3] - middle[:, 1])
    assert np.all(np.einsum("ij,ij->i", outward, middle.sum(axis=1)) > 0.0)
    assert np.all(np.diff(template.directions[:, 2]) < 1e-12)


def test_cells_are_nearly_even_and_volumes_converge_in_second_order():
    errors = []
    for cells in (6, 12):
        template = cubed_sphere(cells)
        corner = template.directions[template.cells]
        area = 0.5 * np.linalg.norm(np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]), axis=1)
        assert area.max() / area.min() < 1.5
        surface = Surface(template.directions, template.cells)
        errors.append(1.0 - surface.volume / (4.0 / 3.0 * np.pi))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("cells", [0, -3, 61])
def test_other_numbers_are_refused(cells):
    with pytest.raises(InputError, match="expected 1 to 60"):
        cubed_sphere(cells)
