"""An argument of another kind, such as the path of a file, is refused in one line."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import femprep as fp
from femprep.phantoms import lv_ellipsoid

SEG = lv_ellipsoid().segmentation(spacing=(3.0, 3.0, 10.0))


@pytest.mark.parametrize(
    ("call", "kind"),
    [
        (lambda: fp.check("heart.vtu"), "VolumeMesh"),
        (lambda: fp.write_mesh(None, "heart.inp"), "VolumeMesh"),
        (lambda: fp.fit_surface(SEG), "LabelObject or a Surface"),
        (lambda: fp.mesh_segmentation("heart.nii.gz"), "Segmentation"),
        (lambda: fp.mesh_surfaces({"lv": "endo.stl", "epi": "epi.stl"}), "Surface"),
    ],
)
def test_an_argument_of_another_kind_is_refused_in_one_line(call: Callable[[], object], kind: str) -> None:
    with pytest.raises(fp.InputError, match=f"expected a {kind}") as refused:
        call()
    assert len(str(refused.value).splitlines()) == 1
