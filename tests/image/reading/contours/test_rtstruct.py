"""DICOM structure sets: oblique planes found from the contours, names of structures, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_hearts import drawn, write_cvi42, write_rtstruct

import femprep as fp
from femprep.errors import FileError, InputError, OptionError

pydicom = pytest.importorskip("pydicom")
NAMES = {"lv": "LV Endo", "epi": "Left_ventricle-Epicardium", "rv": "RV blood pool", "mitral": "Mitral valve"}


@pytest.fixture(scope="module")
def made():
    return drawn()


def test_oblique_planes_are_found_from_the_contours(made, tmp_path):
    found = fp.read_contours(write_rtstruct(tmp_path / "rt.dcm", made, NAMES))
    assert [plane.short_axis for plane in found.planes] == [True] * 10 + [False] * 3
    truth = {id(one): one for one in made.contours if one.surface in NAMES}
    for one in found.contours:
        own = [t for t in truth.values() if t.surface == one.surface and t.points.shape == one.points.shape]
        assert min(np.abs(t.points - one.points).max() for t in own) < 0.006
    assert len(found.contours) == len(truth)
    normal = made.planes[0].normal
    heights = sorted(plane.origin @ normal for plane in found.planes[:10])
    np.testing.assert_allclose(heights, sorted(plane.origin @ normal for plane in made.planes[:10]), atol=0.01)
    for plane in found.planes[:10]:
        assert abs(plane.normal @ normal) > 1.0 - 1e-6
        assert plane.thickness == pytest.approx(9.0, abs=0.01)
    (assumed,) = (notice.what for notice in found.notices if notice.kind == "assumed")
    assert "'RV blood pool' taken as rv" in assumed
    assert "pixels" in assumed


def test_unusual_names_are_a_question_that_lists_them(made, tmp_path):
    path = write_rtstruct(tmp_path / "rt.dcm", made, {"lv": "Ventricle_L", "epi": "Heart muscle"})
    with pytest.raises(OptionError, match="'Ventricle_L', 'Heart muscle'"):
        fp.read_contours(path)
    found = fp.read_contours(path, structures={"lv": "Ventricle_L", "epi": "Heart muscle"})
    assert {one.surface for one in found.contours} == {"lv", "epi"}
    found = fp.read_contours(path, structures={"lv": "Ventricle_L"})
    assert any("Heart muscle" in notice.what for notice in found.notices if notice.kind == "left out")
    with pytest.raises(OptionError, match="no structure 'LV'"):
        fp.read_contours(path, structures={"lv": "LV"})
    with pytest.raises(OptionError, match="unknown"):
        fp.read_contours(path, structures={"liver": "Ventricle_L"})


def test_two_structures_of_one_meaning_are_a_question(made, tmp_path):
    path = write_rtstruct(tmp_path / "rt.dcm", made, {"lv": "LV", "epi": "LV endo"})
    with pytest.raises(OptionError, match="several mean lv"):
        fp.read_contours(path)


def test_what_is_no_structure_set(made, tmp_path):
    path = write_rtstruct(tmp_path / "rt.dcm", made, NAMES)
    whole = path.read_bytes()
    with pytest.raises(OptionError, match="one phase"):
        fp.read_contours(path, phase=3)
    bent = [fp.Contour("lv", made.contours[0].points, made.contours[0].plane, closed=True)]
    path_bent = write_rtstruct(tmp_path / "bent.dcm", fp.Contours(made.planes, tuple(bent)), {"lv": "lv"})
    data = pydicom.dcmread(path_bent)
    line = data.ROIContourSequence[0].ContourSequence[0]
    line.ContourData = [f"{x + 9.0 * (n % 7 == 0):.2f}" for n, x in enumerate(line.ContourData)]
    data.save_as(path_bent)
    with pytest.raises(InputError, match="no plane"):
        fp.read_contours(path_bent)
    path.write_bytes(whole[: len(whole) // 3])
    with pytest.raises(FileError, match=r"rt\.dcm"):
        fp.read_contours(path)
    write_cvi42(tmp_path / "study.cvi42wsx", tmp_path / "images", made)
    with pytest.raises(InputError, match="MR Image"):
        fp.read_contours(tmp_path / "images" / "IM0000")
