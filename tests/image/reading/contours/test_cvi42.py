"""Workspaces of cvi42 and their images, both made from the published layout: places, phases, valves, refusals."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from drawn_hearts import PIXEL, drawn, write_cvi42

import femprep as fp
from femprep.errors import FileError, MissingDependencyError, OptionError
from femprep.image.reading.contours import images as module

pytest.importorskip("pydicom")
#: Half a subpixel along each axis of the coarsest plane, mm.
HALF = 0.5 * 1.2 * PIXEL / 4.0 * np.sqrt(2.0) + 1e-6


@pytest.fixture(scope="module")
def made():
    return drawn()


@pytest.fixture
def path(made, tmp_path):
    return write_cvi42(tmp_path / "study.cvi42wsx", tmp_path / "images", made)


def test_contours_lie_where_they_were_drawn(made, path):
    found = fp.read_contours(path)  # images are beside the file
    assert [plane.short_axis for plane in found.planes] == [plane.short_axis for plane in made.planes]
    count = 0
    for own, other in zip(made.planes, found.planes):
        np.testing.assert_allclose(other.origin, own.origin, atol=1e-4)
        np.testing.assert_allclose([*other.spacing, other.thickness], [*own.spacing, own.thickness])
        for surface in ("lv", "rv", "epi", "mitral", "apex"):
            for one, two in zip(made.on(own.name, surface), found.on(other.name, surface), strict=True):
                assert one.closed == two.closed
                assert np.linalg.norm(one.points - two.points, axis=1).max() < HALF
                count += 1
    assert count == len(made.contours)
    assert any("freeDrawRoiContour" in notice.what for notice in found.notices)


def test_an_outline_that_runs_along_the_valve_ends_at_it(made, tmp_path):
    lines = []
    for one in made.contours:
        points, closed = one.points, one.closed
        if not closed and not one.is_landmark:
            across = np.linspace(points[-1], points[0], 12)[1:-1]
            points, closed = np.roll(np.concatenate([points, across]), 5, axis=0), True
        lines.append(fp.Contour(one.surface, points, one.plane, closed))
    path = write_cvi42(tmp_path / "study.cvi42wsx", tmp_path / "images", fp.Contours(made.planes, tuple(lines)))
    found = fp.read_contours(path)
    for own, other in zip(made.planes[10:], found.planes[10:]):
        (one,), (two,) = made.on(own.name, "lv"), found.on(other.name, "lv")
        assert not two.closed
        assert len(two.points) >= len(one.points) - 2
        ends = np.linalg.norm(two.points[[0, -1]] - one.points[[0, -1]], axis=1)
        assert ends.max() < 5.0


def test_phases(made, tmp_path):
    path = write_cvi42(tmp_path / "study.cvi42wsx", tmp_path / "images", made, times=5, frame=2)
    text = path.read_text(encoding="utf-8")
    end = "".join(f"</{tag}>" for tag in ("Hash:item", "List:item", "Hash:item", "Hash:item"))
    assert text.endswith(end)
    begin = text.index('<Hash:item Hash:key="1.2.3.1.3"')
    second = text[begin : text.index('<Hash:item Hash:key="1.2.3.2.3"')].replace("1.2.3.1.3", "1.2.3.1.5")
    path.write_text(text[: -len(end)] + second + end, encoding="utf-8")
    with pytest.raises(OptionError, match="2, 4"):
        fp.read_contours(path)
    assert len(fp.read_contours(path, phase=2).planes) == 13
    found = fp.read_contours(path, phase=4)
    assert len(found.planes) == 1
    assert any(notice.kind == "left out" and "phase 4" in notice.what for notice in found.notices)


def test_images_that_are_missing(made, path):
    folder = path.parent / "images"
    with pytest.raises(FileError, match="no such folder"):
        fp.read_contours(path, images=path.parent / "elsewhere")
    for image in folder.glob("IM00*"):
        image.unlink()
    found = fp.read_contours(path, images=folder)
    assert len(found.planes) == 12
    assert any("1 of 13 images" in notice.what for notice in found.notices)
    other = write_cvi42(path.parent / "other.cvi42wsx", path.parent / "others", made)
    text = other.read_text(encoding="utf-8").replace("1.2.3.", "1.2.9.")
    other.write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match="folder of their DICOM images"):
        fp.read_contours(other)
    shutil.rmtree(folder)
    shutil.rmtree(path.parent / "others")
    with pytest.raises(FileError, match="no DICOM image"):
        fp.read_contours(path)


def test_a_file_that_cannot_be_read(made, path):
    text = path.read_text(encoding="utf-8")
    for change in (text[: len(text) // 2], text.replace("<Point:x>", "<Point:x>a", 1), ""):
        path.write_text(change, encoding="utf-8")
        with pytest.raises(FileError, match=r"study\.cvi42wsx"):
            fp.read_contours(path)
    binary = path.with_suffix(".cvi42ws")
    binary.write_bytes(b"\x00\x01\x02")
    with pytest.raises(FileError, match="cvi42wsx"):
        fp.read_contours(binary)


def test_without_pydicom(path, monkeypatch):
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match="pip install"):
        fp.read_contours(path)
