"""What is of no kind that a public function takes is refused in one line, at the one door of the library."""

from __future__ import annotations

import inspect
import pickle
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.door import NOUNS, at_door
from femprep.phantoms import lv_ellipsoid
from femprep.volume import check as check_inside

MESH = truncated_ellipsoid("hexahedron")
SEG = lv_ellipsoid().segmentation(spacing=(3.0, 3.0, 10.0))
SURFACE = fp.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
FUNCTIONS = {name: found for name in fp.__all__ if inspect.isfunction(found := getattr(fp, name))}


@pytest.mark.parametrize(("call", "line"), [
    (lambda: fp.check("heart.vtu"), "check() takes a VolumeMesh as 'mesh' (one comes from read_mesh), got 'heart.vtu'"),
    (lambda: fp.check(mesh=None), "check() takes a VolumeMesh as 'mesh' (one comes from read_mesh), got None"),
    (lambda: fp.boundary_points(SEG), "a LabelObject as 'obj' (one comes from Segmentation.object), got Segmentation("),
    (lambda: fp.build_wall(epi=SURFACE, endo={"lv": 3}), "takes a Mapping[str, Surface] as 'endo'"),
    (lambda: fp.in_slice_distance(SURFACE, SURFACE, [(0, 0, 1)]), "takes a Sequence[Plane] as 'planes'"),
    (lambda: fp.add_fibres(MESH, axes=np.ones(3)), "takes a VentricularAxes or None as 'axes'"),
    (lambda: fp.quadrature_fibres(MESH, points=0), "takes a Mapping[str, FloatArray] or None as 'points', got 0"),
    (lambda: fp.read_masks("lv.nii"), "takes a Mapping[str, "),
    (lambda: fp.add_aha(MESH, fields={}), "takes a WallFields or None as 'fields'"),
    (lambda: fp.refine(MESH, optimised="abc"), "refine() takes True or False as 'optimised', got 'abc'"),
    (lambda: fp.refine(MESH, [[1], [2, 3]]), "refine() takes a whole number as 'levels', got [[1], [2, 3]]"),
    (lambda: fp.sample_image(MESH, "t1.nii", "t1"), "takes an IntensityImage as 'image' (one comes from read_image)"),
    (lambda: fp.refine(MESH, poor=float("nan")), "refine() takes a finite number as 'poor', got nan"),
    (lambda: fp.read_image("a.nii", frame="1"), "read_image() takes a whole number or None as 'frame', got '1'"),
    (lambda: fp.cavity_surface(MESH, 5), "cavity_surface() takes a string as 'name', got 5"),
])  # fmt: skip
def test_what_is_of_another_kind_is_refused_in_one_line(call: Callable[[], Any], line: str) -> None:
    with pytest.raises(fp.InputError, match=re.escape(line)) as refused:
        call()
    assert len(str(refused.value).splitlines()) == 1


def test_numbers_of_numpy_are_taken() -> None:
    assert len(fp.displacements([MESH, MESH], reference=np.int64(0))) == 2
    assert fp.refine(MESH, levels=np.int64(1), optimised=np.bool_(False), poor=np.float32(0.4)).n_cells > MESH.n_cells


def test_a_function_behind_the_door_is_one_and_the_same_everywhere() -> None:
    assert fp.check is fp.check
    assert pickle.loads(pickle.dumps(fp.check)) is fp.check
    assert inspect.unwrap(fp.check) is check_inside
    assert inspect.signature(fp.check) == inspect.signature(check_inside)
    assert fp.check.__doc__ == check_inside.__doc__


def test_every_noun_of_a_public_function_is_known_at_the_door() -> None:
    asked = {
        word
        for found in FUNCTIONS.values()
        for name, annotation in inspect.unwrap(found).__annotations__.items()
        if name != "return" and "Callable" not in annotation
        for word in re.findall(r"\w+", annotation)
        if word in fp.__all__ and not word.endswith("Options")
    }
    assert asked <= set(NOUNS)
    assert all(getattr(fp, source, None) for source in NOUNS.values() if source.islower())


def test_what_the_door_does_not_know_it_lets_through() -> None:
    def given(path: str, number: int = 1, *, way: object = None) -> object:
        return way

    given.__annotations__ = {"path": "str | Path", "number": "int | Callable[[int], int] | None", "way": "object"}
    assert at_door(given)(5, "x", way=3) == 3
