"""Pictures of the data: what each pixel and each line is, one colour for one thing, how many slices are drawn."""

from __future__ import annotations

import base64
import re
import struct
import zlib
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest
from greys import MEANS, cine

import femprep as fp
from femprep.image.underlay import lay_under
from femprep.model import FACET_TAGS, REGION_TAGS
from femprep.phantoms import lv_ellipsoid
from femprep.report.pictures.colours import colour, region_colour, structure_colour
from femprep.report.pictures.long_axes import long_axis_pictures
from femprep.report.pictures.overlay import Overlay
from femprep.report.pictures.raster import png_address
from femprep.report.pictures.slices import MOST, shown_slices, slice_pictures

LIMITS = (0.0, 255.0)


@pytest.fixture(scope="module")
def seg() -> fp.Segmentation:
    return lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 8.0))


@pytest.fixture(scope="module")
def surfaces(seg: fp.Segmentation) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The ellipsoid's endocardium, as a sphere of triangles stretched."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4)
    return {"endo": (np.asarray(ball.vertices) * [25.0, 25.0, 60.0], np.asarray(ball.faces))}


def pixels(address: str) -> np.ndarray:
    """Rows of a PNG picture, read by the letter of its standard."""
    data = base64.b64decode(address.removeprefix("data:image/png;base64,"))
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = {}, 8
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        name, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(name + body)
        chunks[name], at = body, at + 12 + length
    columns, rows, depth, kind = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    assert depth == 8
    channels = {0: 1, 6: 4}[kind]
    lines = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), dtype=np.uint8).reshape(rows, -1)
    assert not lines[:, 0].any()
    return lines[:, 1:].reshape((rows, columns) if channels == 1 else (rows, columns, channels))


def layers(svg: str) -> dict[str, list[ElementTree.Element]]:
    root = ElementTree.fromstring(svg)
    return {group.get("class", ""): list(group) for group in root[0]}


@pytest.mark.parametrize("shape", [(3, 5), (4, 2, 4)])
def test_png_holds_the_pixels(shape: tuple[int, ...]) -> None:
    drawn = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    assert np.array_equal(pixels(png_address(drawn)), drawn)


def test_slice_shows_the_image_the_labels_and_the_outline(seg: fp.Segmentation, surfaces) -> None:
    under = lay_under(seg, cine(seg))
    for svg in slice_pictures(seg, Overlay(surfaces, under=under, limits=LIMITS)):
        k = int(re.search(r'aria-label="slice (\d+)"', svg)[1])
        found = layers(svg)
        assert list(found)[:2] == ["image", "labels"]
        grey = pixels(found["image"][0].get("href"))
        # Columns go along i and rows along j of the label map, from the box of the labels with room around.
        low, high = (np.argwhere(seg.labels > 0).min(axis=0) - 6, np.argwhere(seg.labels > 0).max(axis=0) + 7)
        low, high = np.maximum(low, 0)[:2], np.minimum(high[:2], seg.labels.shape[:2])
        wanted = np.clip(cine(seg).values[low[0] : high[0], low[1] : high[1], k].T, *LIMITS)
        assert grey.shape == wanted.shape
        assert np.abs(grey - wanted).max() < 1.5
        assert {one.get("fill") for one in found["labels"]} <= {structure_colour("lv"), structure_colour("myo")}
    middle = seg.labels.shape[2] // 2
    outline = layers(slice_pictures(seg, Overlay(surfaces))[middle])["outlines"][0]
    assert outline.get("stroke") == colour("endo")


def test_long_axis_shows_apex_below_and_the_outline_on_the_edge_of_the_labels(seg: fp.Segmentation, surfaces) -> None:
    heart = fp.orient(seg)
    for svg in long_axis_pictures(heart, Overlay(surfaces, under=lay_under(heart, cine(seg)), limits=LIMITS)):
        root, found = ElementTree.fromstring(svg), layers(svg)
        width, height = map(float, root.get("viewBox").split()[2:])
        label = pixels(found["labels"][0].get("href"))
        rows, columns = label.shape[:2]
        blood = (label[..., :3] == list(bytes.fromhex(structure_colour("lv")[1:]))).all(axis=2) & (label[..., 3] == 255)
        across = blood.sum(axis=1) * width / columns
        # The cavity is 50 mm wide and narrows downwards, to the apex.
        assert across.max() == pytest.approx(50.0, abs=3.0)
        filled = np.flatnonzero(across)
        assert across[filled[: len(filled) // 2]].mean() > across[filled[len(filled) // 2 :]].mean() + 5.0
        grey = pixels(found["image"][0].get("href"))
        inner = blood & np.roll(blood, 4, 0) & np.roll(blood, -4, 0) & np.roll(blood, 4, 1) & np.roll(blood, -4, 1)
        assert grey[inner].mean() == pytest.approx(MEANS["lv"], abs=8.0)
        ends = np.array(re.findall(r"[ML]([\d.-]+) ([\d.-]+)", found["outlines"][0].get("d")), dtype=float)
        assert np.ptp(ends[:, 0]) == pytest.approx(50.0, abs=0.6)
        assert np.ptp(ends[:, 1]) == pytest.approx(120.0, abs=0.6)
        assert ends[:, 1].max() < height
        step = width / columns
        side = ends[np.abs(ends[:, 1] - step * filled[len(filled) // 4]) < 2.0][:, 0]
        edge = step * np.flatnonzero(blood[filled[len(filled) // 4]])[[0, -1]]
        assert np.abs([side.min() - edge[0], side.max() - edge[1]]).max() < 2.5
        assert rows == pytest.approx(height / step, abs=1)


def test_dots_are_drawn_in_the_cut_they_lie_in(seg: fp.Segmentation, surfaces) -> None:
    heart = fp.orient(seg)
    middle = heart.grid.to_world(np.argwhere(heart.labels > 0)).mean(axis=0)
    near, far = middle + 10.0 * heart.frame[:, 0], middle + 10.0 * heart.frame[:, 1]
    first, second = (
        layers(svg).get("off", []) for svg in long_axis_pictures(heart, Overlay(surfaces, off=[near[None]]))
    )
    assert (len(first), len(second)) == (1, 0)
    first, second = (
        layers(svg).get("off", []) for svg in long_axis_pictures(heart, Overlay(surfaces, off=[far[None]]))
    )
    assert (len(first), len(second)) == (0, 1)


def test_of_many_slices_some_are_drawn_and_the_ends_with_them() -> None:
    assert shown_slices(3, 3 + MOST) == list(range(3, 3 + MOST))
    some = shown_slices(5, 300)
    assert (some[0], some[-1], len(some)) == (5, 299, MOST)
    steps = [b - a for a, b in pairwise(some)]
    assert max(steps) - min(steps) <= 1


def test_one_thing_has_one_colour() -> None:
    assert region_colour("blood_rv") == structure_colour("rv")
    assert len({structure_colour(name) for name in ("lv", "rv", "la", "ra", "myo", "rv_wall", "la_wall")}) == 7
    assert len({region_colour(name) for name in REGION_TAGS}) == len(REGION_TAGS)
    together = ("endo_lv", "endo_rv", "endo_la", "endo_ra", "epi", "mitral", "tricuspid", "aortic", "pulmonary")
    assert len({colour(name) for name in together}) == len(together)
    assert all(re.fullmatch("#[0-9a-f]{6}", colour(name)) for name in FACET_TAGS)
