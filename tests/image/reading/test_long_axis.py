"""Long-axis label maps: read in their pose, found beside the stack by name, refused where they cannot be placed."""

from __future__ import annotations

import numpy as np
import pytest

import femprep as fp
from femprep.errors import FileError, InputError, OptionError
from femprep.phantoms import biventricular

sitk = pytest.importorskip("SimpleITK")

#: Pose of a view: its columns are the directions of the two pixel axes and of the normal.
POSE = np.array([[0.96, 0.0, 0.28], [0.28, 0.0, -0.96], [0.0, 1.0, 0.0]])
ORIGIN = np.array([-80.0, -23.0, -80.0])


@pytest.fixture(scope="module")
def phantom():
    return biventricular()


def write_view(phantom, path, renumber=None):
    """A view of 1.4 mm pixels and 6 mm thickness through the phantom."""
    grid = fp.Grid((110, 120, 1), (1.4, 1.4, 6.0), ORIGIN, POSE)
    labels = np.array(phantom.segmentation(grid=grid).labels)
    plain = labels.copy()
    for old, new in (renumber or {}).items():
        labels[plain == old] = new
    image = sitk.GetImageFromArray(np.moveaxis(labels.astype(np.uint8), [0, 1, 2], [2, 1, 0]))
    image.SetSpacing((1.4, 1.4, 6.0))
    image.SetOrigin(ORIGIN.tolist())
    image.SetDirection(POSE.ravel().tolist())
    sitk.WriteImage(image, str(path))
    return labels[:, :, 0]


def write_stack(phantom, path):
    seg = phantom.segmentation(spacing=(1.8, 1.8, 9.0))
    fp.write_segmentation(seg, path)
    return seg


@pytest.mark.parametrize("ending", [".nii.gz", ".nrrd"])
def test_a_view_is_read_in_its_pose(phantom, tmp_path, ending):
    labels = write_view(phantom, tmp_path / f"la{ending}")
    stack = write_stack(phantom, tmp_path / "sa.nii.gz")
    seg = fp.read_segmentation(tmp_path / "sa.nii.gz", dict(stack.structures))
    (view,) = seg.with_long_axis(tmp_path / f"la{ending}").views
    np.testing.assert_array_equal(view.labels, labels)
    np.testing.assert_allclose(view.to_world([[3, 5]])[0], ORIGIN + 1.4 * POSE[:, :2] @ [3, 5], atol=1e-4)
    assert view.thickness == pytest.approx(6.0)
    assert set(view.shown) == {"lv", "myo", "rv"}


def test_its_own_label_numbers(phantom, tmp_path):
    numbers = dict(phantom.segmentation(spacing=(3.0, 3.0, 9.0)).structures)
    old = {name: own[0] for name, own in numbers.items()}
    write_view(phantom, tmp_path / "la.nii.gz", {old["lv"]: 41, old["myo"]: 42, old["rv"]: 43})
    write_stack(phantom, tmp_path / "sa.nii.gz")
    seg = fp.read_segmentation(
        tmp_path / "sa.nii.gz", numbers, long_axis=(f"{tmp_path / 'la.nii.gz'}:lv=41,myo=42,rv=43",)
    )
    assert seg.views[0].structures["myo"] == (42,)
    assert seg.views[0].mask("lv").any()
    with pytest.raises(InputError, match="41"):
        seg.with_long_axis(tmp_path / "la.nii.gz")


def test_m_and_ms_2_finds_the_view_beside_the_stack(phantom, tmp_path):
    old = {name: own[0] for name, own in phantom.segmentation(spacing=(3.0, 3.0, 9.0)).structures.items()}
    number = {old["lv"]: 1, old["myo"]: 2, old["rv"]: 3}
    labels = np.array(phantom.segmentation(spacing=(1.8, 1.8, 9.0)).labels)
    out = np.zeros_like(labels)
    for one, other in number.items():
        out[labels == one] = other
    seg = phantom.segmentation(spacing=(1.8, 1.8, 9.0))
    fp.write_segmentation(fp.Segmentation(out, seg.grid, {"lv": (1,)}), tmp_path / "001_SA_ED_gt.nii.gz")
    write_view(phantom, tmp_path / "001_LA_ED_gt.nii.gz", {k: v + 50 for k, v in number.items()})
    image = sitk.ReadImage(str(tmp_path / "001_LA_ED_gt.nii.gz"))
    sitk.WriteImage(sitk.Cast((image > 50) * (image - 50), sitk.sitkUInt8), str(tmp_path / "001_LA_ED_gt.nii.gz"))
    found = fp.read_segmentation(tmp_path / "001_SA_ED_gt.nii.gz", preset="mnms2")
    assert [view.name for view in found.views] == ["001_LA_ED_gt"]
    assert any("001_LA_ED_gt.nii.gz" in notice["what"] for notice in found.info["notices"])
    assert fp.read_segmentation(tmp_path / "001_SA_ED_gt.nii.gz", {"lv": 1}).views == ()


def test_one_number_of_uk_biobank_means_two_things_by_view(phantom, tmp_path):
    old = {name: own[0] for name, own in phantom.segmentation(spacing=(3.0, 3.0, 9.0)).structures.items()}
    write_stack(phantom, tmp_path / "seg_sa_ED.nii.gz")
    write_view(phantom, tmp_path / "seg_la_2ch_ED.nii.gz", {old["lv"]: 1, old["myo"]: 0, old["rv"]: 0})
    seg = fp.read_segmentation(tmp_path / "seg_sa_ED.nii.gz", preset="ukb")
    assert [view.shown for view in seg.views] == [("la",)]


def test_a_pattern_beside_the_stack(phantom, tmp_path):
    write_view(phantom, tmp_path / "heart_la_2ch.nii.gz")
    write_view(phantom, tmp_path / "heart_la_4ch.nii.gz")
    stack = write_stack(phantom, tmp_path / "heart_sa.nii.gz")
    seg = fp.read_segmentation(tmp_path / "heart_sa.nii.gz", dict(stack.structures), long_axis=("*_la_*.nii.gz",))
    assert [view.name for view in seg.views] == ["heart_la_2ch", "heart_la_4ch"]
    with pytest.raises(FileError, match="pattern"):
        fp.read_segmentation(tmp_path / "heart_sa.nii.gz", dict(stack.structures), long_axis=("*_lax_*",))


def test_refusals(phantom, tmp_path):
    stack = write_stack(phantom, tmp_path / "sa.nii.gz")
    with pytest.raises(InputError, match="at most"):
        stack.with_long_axis(tmp_path / "sa.nii.gz") if min(stack.labels.shape) > 12 else stack.with_long_axis(
            _thick(phantom, tmp_path)
        )
    write_view(phantom, tmp_path / "la.nii.gz")
    with pytest.raises(OptionError, match="labels"):
        stack.with_long_axis(tmp_path / "la.nii.gz", preset="nothing")
    with pytest.raises(FileError, match="no such file"):
        stack.with_long_axis(tmp_path / "none.nii.gz")


def _thick(phantom, folder):
    """A stack of more slices than a view may have."""
    fp.write_segmentation(phantom.segmentation(spacing=(3.0, 3.0, 4.0)), folder / "many.nii.gz")
    return folder / "many.nii.gz"


def test_views_of_one_phase_are_not_taken_for_all(phantom, tmp_path, capsys):
    from femprep.cli import main

    for name in ("a", "b"):
        write_stack(phantom, tmp_path / f"{name}.nii.gz")
    write_view(phantom, tmp_path / "la.nii.gz")
    maps = [str(tmp_path / f"{name}.nii.gz") for name in ("a", "b")]
    words = ["mesh", *maps, "-o", str(tmp_path / "out"), "--sequence", "--preset", "acdc"]
    assert main([*words, "--long-axis", str(tmp_path / "la.nii.gz")]) == 2
    assert "--long-axis" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
