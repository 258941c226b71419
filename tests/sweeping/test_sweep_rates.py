"""Volumes of swept meshes converge to the closed form: second order straight, third or better curved."""

from __future__ import annotations

import numpy as np
import pytest
from test_sweep import BASE, ENDO, EPI, KINDS, exact, only

from femprep.mesh.measures.volume_elements import element_volumes
from femprep.model import Surface
from femprep.sweeping import sweep
from femprep.sweeping.matching.match import match_surfaces
from femprep.template import charge_template

SIZES = (9.0, 6.0, 4.0)


def surface(axes: np.ndarray, name: str) -> Surface:
    """Many vertices, so that the smooth surface through them adds no error of its own."""
    template = charge_template(3000)
    return Surface(template.directions * axes, template.cells, name=name)


@pytest.mark.slow
@pytest.mark.parametrize(("element", "template"), KINDS)
def test_volumes_converge(element, template):
    endo, epi = surface(ENDO, "lv"), surface(EPI, "epi")
    wanted, sizes, errors = exact(-99.0, 10.0), [], {1: [], 2: []}
    for edge in SIZES:
        pair = match_surfaces(endo=endo, epi=epi, base=BASE, template=template, edge_length=edge)
        sizes.append(len(pair.inner) ** -0.5)
        for order in (1, 2):
            name, cells = only((mesh := sweep(pair, element=element, order=order)).cells)
            errors[order].append(abs(element_volumes(mesh.points, cells, name).sum() / wanted - 1.0))
    steps = np.log(sizes)
    assert 1.8 < np.polyfit(steps, np.log(errors[1]), 1)[0] < 2.2
    # At the finest size nothing is left but the error of the smooth surface itself, 3e-4 mm on these vertices.
    assert (np.log(errors[2][0]) - np.log(errors[2][1])) / (steps[0] - steps[1]) > 2.9
    assert errors[2][2] < errors[2][1]
    assert errors[2][2] < 4e-5
