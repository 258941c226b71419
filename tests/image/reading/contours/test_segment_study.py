"""Studies of Medviso Segment: poses, slice direction and phases as they were written, in both kinds of MATLAB file."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_hearts import drawn, segment_stacks, write_mat5, write_mat73

import femprep as fp
from femprep.errors import FileError, InputError, OptionError


@pytest.fixture(scope="module")
def made():
    return drawn()


def pairs(found, made):
    """Contours of a file and those that were written, plane by plane."""
    planes = [p.name for p in made.planes], [p.name for p in found.planes]
    assert len(planes[0]) == len(planes[1])
    for own, other in zip(*planes):
        for surface in ("lv", "rv", "epi"):
            yield from zip(made.on(own, surface), found.on(other, surface), strict=True)


@pytest.mark.parametrize("write", [write_mat5, write_mat73])
def test_contours_lie_where_they_were_drawn(made, tmp_path, write):
    found = fp.read_contours(write(tmp_path / "study.mat", segment_stacks(made)))
    assert [plane.short_axis for plane in found.planes] == [plane.short_axis for plane in made.planes]
    for own, other in zip(made.planes, found.planes):
        np.testing.assert_allclose(other.origin, own.origin, atol=1e-9)
        np.testing.assert_allclose(other.axes, own.axes, atol=1e-9)
        np.testing.assert_allclose([*other.spacing, other.thickness], [*own.spacing, own.thickness])
    count = 0
    for own, other in pairs(found, made):
        np.testing.assert_allclose(other.points, own.points, atol=1e-9)
        count += 1
    assert count == sum(not one.is_landmark for one in made.contours)


@pytest.mark.parametrize("write", [write_mat5, write_mat73])
def test_one_stack_of_one_phase(made, tmp_path, write):
    """MATLAB keeps a single stack without references, and drops dimensions of one at the end."""
    (stack, *_) = segment_stacks(made, times=1, frame=0)
    stack["ImageViewPlane"] = ""
    found = fp.read_contours(write(tmp_path / "study.mat", [stack]))
    assert all(plane.short_axis for plane in found.planes)
    assert len(found.planes) == 10
    view = segment_stacks(made, times=1, frame=0)[-1]
    for name in list(view):
        if name[-1] in "XY" and np.ndim(view[name]) == 4:
            view[name] = view[name].reshape(-1, 1)
    found = fp.read_contours(write(tmp_path / "view.mat", [view]))
    assert [plane.short_axis for plane in found.planes] == [False]


def two_phases(made):
    """Stack of 30 frames drawn at 0 and 10, views of 24 frames drawn at 0 and 8; one view at 0 alone."""
    stack, *views = segment_stacks(made, times=30, frame=0)
    others = [segment_stacks(made, times=24, frame=0)[n + 1] for n in range(len(views))]
    for entry, frame in [(stack, 10), *((view, 8) for view in others[:-1])]:
        for name, values in entry.items():
            if name[-1] in "XY" and np.ndim(values) == 3:
                values[:, frame] = values[:, 0] + (1.0 if name.endswith("X") else 0.0)
    return [stack, *others]


def test_phases_of_stacks_with_other_numbers_of_frames(made, tmp_path):
    path = write_mat5(tmp_path / "study.mat", two_phases(made))
    with pytest.raises(OptionError, match="0, 10"):
        fp.read_contours(path)
    with pytest.raises(OptionError, match="no contours of phase 5"):
        fp.read_contours(path, phase=5)
    first, second = fp.read_contours(path, phase=0), fp.read_contours(path, phase=10)
    assert len(first.planes) == len(second.planes) + 1
    assert any(notice.kind == "left out" and "4CH" in notice.what for notice in second.notices)
    plane = second.planes[0]
    moved = second.on(plane.name, "lv")[0].points - first.on(plane.name, "lv")[0].points
    np.testing.assert_allclose(moved, np.tile(plane.spacing[1] * plane.axes[:, 1], (len(moved), 1)), atol=1e-9)


def test_of_several_short_axis_stacks_the_one_with_most_contours(made, tmp_path):
    stacks, still = segment_stacks(made), segment_stacks(made)[0]
    for name in list(still):
        if name[-1] in "XY" and np.ndim(still[name]) == 3:
            still[name][:, :, 3:] = np.nan
    found = fp.read_contours(write_mat5(tmp_path / "study.mat", [still, *stacks]))
    assert sum(plane.short_axis for plane in found.planes) == 10
    assert any("stack 2" in notice.what for notice in found.notices)


def emptied(stack):
    """A stack without an outline."""
    stack.update({name: np.full_like(v, np.nan) for name, v in stack.items() if name[-1] in "XY" and np.ndim(v) == 3})


@pytest.mark.parametrize(
    ("change", "error", "word"),
    [
        (lambda stack: stack.update(Rotated=True), InputError, "rotated"),
        (lambda stack: stack.update(TSize=7.0), FileError, "damaged"),
        (lambda stack: stack.update(ImagePosition=np.zeros((1, 2))), FileError, "damaged"),
        (emptied, InputError, "no contours"),
    ],
)
@pytest.mark.parametrize("write", [write_mat5, write_mat73])
def test_what_is_wrong_is_one_line(made, tmp_path, write, change, error, word):
    stack = segment_stacks(made)[0]
    change(stack)
    with pytest.raises(error, match=word) as caught:
        fp.read_contours(write(tmp_path / "study.mat", [stack]))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("write", [write_mat5, write_mat73])
def test_a_damaged_or_foreign_file(made, tmp_path, write):
    path = write(tmp_path / "study.mat", segment_stacks(made))
    whole = path.read_bytes()
    for length in (3 * len(whole) // 4, len(whole) // 2, 700):
        path.write_bytes(whole[:length])
        with pytest.raises(FileError, match=r"study\.mat"):
            fp.read_contours(path)
    from scipy.io import savemat

    savemat(path, {"endo_c": np.zeros(3)})
    with pytest.raises(FileError, match="setstruct"):
        fp.read_contours(path)
    with pytest.raises(OptionError, match="images"):
        fp.read_contours(path, images=tmp_path)
