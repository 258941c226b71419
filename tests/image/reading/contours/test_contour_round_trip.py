"""A phantom's contours in each kind of file, read back, make a heart with the phantom's volumes and surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_hearts import drawn, phantom, segment_stacks, write_cvi42, write_mat5, write_mat73, write_rtstruct

import femprep as fp
from femprep.mesh.topology import volume

#: Half a slice above the highest one.
TOP = 19.5


@pytest.fixture(scope="module")
def made():
    return drawn()


def read(kind, made, folder):
    if kind in ("MATLAB 5", "MATLAB 7.3"):
        write = write_mat5 if kind == "MATLAB 5" else write_mat73
        return fp.read_contours(write(folder / "study.mat", segment_stacks(made)))
    if kind == "JSON":
        made.save(folder / "contours.json")
        return fp.read_contours(folder / "contours.json")
    pytest.importorskip("pydicom")
    if kind == "cvi42":
        return fp.read_contours(write_cvi42(folder / "study.cvi42wsx", folder, made))
    return fp.read_contours(write_rtstruct(folder / "rt.dcm", made, {"lv": "LV endo", "epi": "LV epi", "rv": "RV"}))


@pytest.mark.parametrize("kind", ["JSON", "MATLAB 5", "MATLAB 7.3", "cvi42", "RTSTRUCT"])
def test_volumes_agree_with_the_phantom(made, tmp_path, kind):
    heart = phantom()
    seg = read(kind, made, tmp_path).to_segmentation(pixel=0.7)
    assert len(seg.views) == 3
    truth = {name: heart.volume(name, high=TOP) for name in ("lv", "rv", "epi")}
    truth["myo"] = truth.pop("epi") - truth["lv"]
    for name, expected in truth.items():
        found = seg.mask(name).sum() * np.prod(seg.grid.spacing)
        assert found == pytest.approx(expected, rel=0.003)


def test_json_keeps_every_digit(made, tmp_path):
    found = read("JSON", made, tmp_path)
    for one, other in zip(made.planes, found.planes, strict=True):
        assert (one.name, one.thickness, one.short_axis) == (other.name, other.thickness, other.short_axis)
        for name in ("origin", "axes", "spacing"):
            assert np.array_equal(getattr(one, name), getattr(other, name))
    for one, other in zip(made.contours, found.contours, strict=True):
        assert (one.surface, one.plane, one.closed) == (other.surface, other.plane, other.closed)
        assert np.array_equal(one.points, other.points)


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ('"unit": "mm"', '"unit": "m"', "unit"),
        ('"coordinates": "LPS"', '"coordinates": "RAS"', "LPS"),
        ('"closed"', '"shut"', "shut"),
        ('"contours": [', '"contours": [{},', "contours.0"),
        ("{", "{,", "JSON"),
    ],
)
def test_a_json_file_that_is_wrong_is_refused_by_place(made, tmp_path, old, new, word):
    path = tmp_path / "contours.json"
    made.save(path)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(fp.FileError, match=word):
        fp.read_contours(path)


def test_surfaces_lie_on_the_phantom(made, tmp_path):
    heart = phantom()
    seg = read("cvi42", made, tmp_path).to_segmentation()
    for name, parts in (("lv", ("lv",)), ("epi", ("lv", "myo"))):
        surface = fp.fit_surface(seg.object(*parts, name=name), vertices=800)
        assert volume(surface.points, surface.triangles) == pytest.approx(heart.volume(name), rel=0.02)
        below = surface.points[heart.height(surface.points) < 12.0]
        assert np.abs(heart.distance(name, below)).mean() < 0.15
