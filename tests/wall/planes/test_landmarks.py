from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest
from wall_shapes import stack, turned

from femprep.errors import InputError, OptionError
from femprep.image import read_segmentation
from femprep.wall import find_apex, find_base
from femprep.wall.planes.stack import read_stack


def slice_of(seg, plane) -> float:
    return float(seg.grid.to_index(plane.point[None])[0, 2])


def test_planes_lie_in_the_outermost_closed_rings():
    seg = stack(list(".coooooom."))
    base, apex = find_base(seg), find_apex(seg)
    assert slice_of(seg, base) == pytest.approx(2.0)
    assert slice_of(seg, apex) == pytest.approx(7.0)
    assert base.normal == pytest.approx([0, 0, -1])
    assert apex.normal == pytest.approx([0, 0, 1])
    assert "slice 2" in base.source


def test_a_flipped_stack_gives_the_same_planes_in_the_world():
    slices, radii = list("coooom"), np.linspace(24.0, 12.0, 6)
    seg = stack(slices, radii=radii)
    mirrored = stack(slices[::-1], radii=radii[::-1])
    assert slice_of(mirrored, find_base(mirrored)) == pytest.approx(5 - slice_of(seg, find_base(seg)))
    assert find_base(mirrored).normal == pytest.approx(-find_base(seg).normal)


@pytest.mark.parametrize("seed", range(4))
def test_oblique_images_give_oblique_planes(seed):
    turn = turned(seed)
    if seed % 2:
        turn = turn * [1, 1, -1]  # a left-handed grid
    straight, oblique = stack(list("ooooo")), stack(list("ooooo"), direction=turn)
    base = find_base(oblique)
    assert base.normal == pytest.approx(turn @ find_base(straight).normal)
    assert slice_of(oblique, base) == pytest.approx(slice_of(straight, find_base(straight)))


def test_an_open_ring_tells_the_base_of_a_cylinder():
    seg = stack(list("cooooo"), radii=np.full(6, 20.0))
    assert read_stack(seg).basal == -1
    seg = stack(list("oooooc"), radii=np.full(6, 20.0))
    assert read_stack(seg).basal == 1


def test_the_basal_end_can_be_given():
    seg = stack(list("oooo"))
    assert slice_of(seg, find_base(seg, basal_end="last")) == pytest.approx(3.0)
    assert find_base(seg, basal_end="last").normal == pytest.approx([0, 0, 1])


def test_the_offset_moves_the_base_towards_the_apex():
    seg = stack(list("oooo"))
    plain, moved = find_base(seg), find_base(seg, base_offset=3.0)
    assert moved.point - plain.point == pytest.approx(-3.0 * plain.normal)
    assert find_apex(seg, base_offset=3.0).point == pytest.approx(find_apex(seg).point)


def test_a_slice_that_leaves_cavity_bare_is_passed_over():
    radii = [10.0, 26.0, 24.0, 22.0, 20.0]  # 10 + 8 mm of ring against 26 mm of cavity: half of it is bare
    seg = stack(list("ooooo"), radii=radii)
    base = find_base(seg, basal_end="first")
    assert slice_of(seg, base) == pytest.approx(1.0)
    assert "passed over slice 0" in base.source
    seg = stack(list("ooooo"), radii=[17.5, *radii[1:]])  # 4 %
    assert slice_of(seg, find_base(seg, basal_end="first")) == pytest.approx(0.0)


def test_a_cylinder_has_no_base():
    with pytest.raises(InputError, match=r"both ends of the stack look alike.*--basal-end"):
        find_base(stack(list("oooo"), radii=np.full(4, 20.0)))


def test_no_closed_ring_is_refused():
    with pytest.raises(InputError, match="closes around the cavity in none of slices 0 to 3"):
        find_base(stack(list("cccc")))


def test_where_no_ring_closes_the_nearest_slice_is_told():
    whole = stack(list("oooo"), radii=np.linspace(24.0, 18.0, 4))
    labels = np.array(whole.labels)
    for k in range(4):  # a gap of one voxel in each slice, through the wall from the cavity outward
        row = int(np.argwhere(labels[:, :, k] == whole.structures["lv"][0])[:, 0].mean())
        last = int(np.flatnonzero(labels[row, :, k] == whole.structures["lv"][0])[-1])
        labels[row, last + 1 :, k] = 0
    labels[row + 1, last + 1 :, 1:] = 0  # of two in the others
    with pytest.raises(
        InputError, match=r"mend the labels: slice 0 is nearest to a ring, with \d % of it open"
    ) as caught:
        find_base(replace(whole, labels=labels))
    assert "--base" not in str(caught.value)


def test_one_ring_has_no_apex_of_its_own():
    with pytest.raises(InputError, match="in slice 1 alone"):
        find_apex(stack(list("com")))


@pytest.mark.parametrize(("slices", "message"), [("mmm", "'lv' has no voxel|label 3"), (".o.", "lie in slice 1 alone")])
def test_missing_structures_are_named(slices, message):
    with pytest.raises(InputError, match=message):
        find_base(stack(list(slices)))


def test_unknown_options_are_refused():
    with pytest.raises(OptionError, match="basal_ends"):
        find_base(stack(list("ooo")), basal_ends="first")


@pytest.mark.slow
@pytest.mark.data
def test_basal_end_of_every_acdc_map(data):
    """cases.csv says which end is basal: all maps that are there agree but one, where it goes by the LV alone.

    That one's LV is a tube; its RV ends at the other end, and so does the same heart at end-diastole.
    """
    wrong, seen = [], 0
    with open(data / "acdc" / "cases.csv", newline="") as file:
        for case in csv.DictReader(file):
            path = data / "acdc" / case["file"]
            if not path.exists():
                continue
            seg = read_segmentation(path, preset="acdc")
            seen += 1
            if read_stack(seg).basal != {"zmin": -1, "zmax": 1}[case["base_end"]]:
                wrong.append(case["id"])
            index = slice_of(seg, find_base(seg))
            ring = read_stack(seg).closed
            assert ring[round(index)], case["id"]
    assert seen >= 200
    assert wrong == ["patient047_frame09"]
