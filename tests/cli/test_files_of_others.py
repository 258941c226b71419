"""Files of others are data: nothing in them runs, is written elsewhere, or takes up what it says without a check."""

from __future__ import annotations

import gzip
import os
import re
import shutil
import struct
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.cli import main
from femprep.export.table import FORMATS
from femprep.phantoms import lv_ellipsoid

SCRIPT = "<script>document.title='run'</script><img src=x onerror=\"document.title='run'\">"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def named(names: dict[str, int]) -> fp.VolumeMesh:
    """A mesh whose file brought names of its own for its tags."""
    mesh = truncated_ellipsoid(heights=2, around=6, layers=1)
    tags = np.array(mesh.facet_tag)
    for (_, number), own in zip(names.items(), np.unique(tags), strict=False):
        tags[tags == own] = number
    return replace(mesh, facet_tag=tags, info={"tag_names": names})


@pytest.mark.parametrize("format", sorted(FORMATS))
@pytest.mark.parametrize("name", ["../../evil", "/tmp/evil", "a/b", "..", "con\x00", "a" * 400])
def test_names_of_tags_are_no_paths(tmp_path: Path, format: str, name: str) -> None:
    """openCARP and svMultiPhysics have a file for each set."""
    inner = tmp_path / "a" / "b" / "made"
    inner.mkdir(parents=True)
    before = sorted(tmp_path.rglob("*"))
    fp.write_mesh(named({name: 301}), inner / Path(FORMATS[format].filename).name, format=format)
    made = [path for path in sorted(tmp_path.rglob("*")) if path not in before]
    assert made
    assert [path for path in made if inner not in path.parents] == []
    assert [path.name for path in made if not re.fullmatch(r"[\w.-]{1,120}", path.name)] == []


@pytest.mark.parametrize("name", ["../../evil", "/evil", "..", ".hidden", "a/b", "a\nb"])
def test_names_of_objects_are_no_paths(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path, config = tmp_path / "heart.nii.gz", tmp_path / "options.toml"
    fp.write_segmentation(lv_ellipsoid().segmentation((3.0, 3.0, 10.0)), path)
    quoted = '"' + name.replace("\n", "\\n") + '"'
    config.write_text(f"[structures]\n{quoted} = [3]\n")
    out = tmp_path / "x" / "out"
    for arguments in (["--config", str(config)], ["--structure", "lv=3", "--object", f"{name}=lv"]):
        before = sorted(tmp_path.rglob("*"))
        assert main(["surface", str(path), "-o", str(out), *arguments]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert "cannot be the name of an object" in said
        assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.slow
def test_pages_show_names_and_do_not_run_them(tmp_path: Path) -> None:
    mesh = named({SCRIPT: 301, "base": 103})
    region = np.full_like(mesh.region, 77)
    mesh = replace(mesh, region=region, info={"tag_names": {SCRIPT: 77}})
    path, page = tmp_path / f"{SCRIPT.replace('/', '|')}.vtu", tmp_path / "page.html"
    fp.write_mesh(mesh, path)
    assert main(["check", str(path), "--html", str(page), "-q"]) in (0, 1)
    text = page.read_text()
    assert "<script" not in text
    assert "<img src=x" not in text
    assert "&lt;script&gt;" in text
    if CHROMIUM is None:
        return
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    shown = subprocess.run(
        [*command, "--dump-dom", page.as_uri()], capture_output=True, text=True, timeout=120, check=False
    )
    if shown.returncode:  # where it cannot start, the page itself has been looked at above
        pytest.skip(f"Chromium does not start here: {shown.stderr[-200:]}")
    assert "<title>run</title>" not in shown.stdout
    assert "&lt;script&gt;" in shown.stdout


def test_an_image_that_grows_beyond_its_header(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, path = tmp_path / "small.nii", tmp_path / "bomb.nii.gz"
    fp.write_segmentation(lv_ellipsoid().segmentation((3.0, 3.0, 10.0)), source)
    with gzip.open(path, "wb", compresslevel=9) as file:
        file.write(source.read_bytes())
        for _ in range(100):
            file.write(bytes(1 << 20))
    assert path.stat().st_size < 1 << 20
    assert main(["mesh", str(path), "-o", str(tmp_path / "out"), "--preset", "acdc"]) == 2
    assert "holds more than the" in capsys.readouterr().err


def test_an_image_larger_than_the_memory(tmp_path: Path, monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "large.nrrd"
    fp.write_segmentation(lv_ellipsoid().segmentation((3.0, 3.0, 10.0)), path)
    monkeypatch.setattr("femprep.image.reading.native.memory", lambda: 10_000)
    assert main(["mesh", str(path), "-o", str(tmp_path / "out"), "--preset", "acdc"]) == 2
    said = capsys.readouterr().err
    assert "voxels need about" in said
    assert "crop or resample" in said


@pytest.mark.parametrize("compressed", [True, False])
def test_images_that_say_they_are_huge(tmp_path: Path, compressed: bool, capsys: pytest.CaptureFixture[str]) -> None:
    """A header of a few bytes that asks for terabytes is refused without asking for them."""
    source, path = tmp_path / "small.nii", tmp_path / ("huge.nii.gz" if compressed else "huge.nii")
    fp.write_segmentation(lv_ellipsoid().segmentation((3.0, 3.0, 10.0)), source)
    data = bytearray(source.read_bytes())
    struct.pack_into("<8h", data, 40, 3, 32767, 32767, 32767, 1, 1, 1, 1)
    path.write_bytes(gzip.compress(bytes(data)) if compressed else bytes(data))
    start = time.process_time()
    assert main(["mesh", str(path), "-o", str(tmp_path / "out"), "--preset", "acdc"]) == 2
    assert "cut short" in capsys.readouterr().err
    assert time.process_time() - start < 10.0
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("ending", [".nii.gz", ".nrrd", ".mha"])
def test_images_that_unpack_to_gigabytes(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A small file whose header tells of all that it unpacks to: more than the memory, or than there can be."""
    path, side = tmp_path / f"bomb{ending}", 300
    zeros = sitk.GetImageFromArray(np.zeros((side, side, side), dtype=np.uint8))
    sitk.WriteImage(zeros, str(path), useCompression=True)
    assert path.stat().st_size < side**3 / 900
    monkeypatch.setattr("femprep.image.reading.files.memory", lambda: side**3 - 1)
    monkeypatch.setattr("femprep.image.reading.files._unpacked", None)  # nothing is unpacked
    assert main(["mesh", str(path), "-o", str(tmp_path / "out"), "--preset", "acdc"]) == 2
    assert "of memory; crop or resample" in capsys.readouterr().err
    data = path.read_bytes()
    if ending != ".nii.gz":
        path.write_bytes(data.replace(f"{side} {side} {side}".encode(), b"90000 90000 90000"))
        assert main(["mesh", str(path), "-o", str(tmp_path / "out"), "--preset", "acdc"]) == 2
        assert "cut short" in capsys.readouterr().err


@pytest.mark.parametrize("ending", [".nrrd", ".mha"])
def test_images_that_unpack_to_more_than_their_header_tells(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, side = tmp_path / f"bomb{ending}", 450
    zeros = sitk.GetImageFromArray(np.zeros((side, side, side), dtype=np.uint8))
    sitk.WriteImage(zeros, str(path), useCompression=True)
    path.write_bytes(path.read_bytes().replace(f"{side} {side} {side}".encode(), b"4 4 4"))
    assert main(["mesh", str(path), "-o", str(tmp_path / "out"), "--preset", "acdc"]) == 2
    assert "holds more than the 64 voxels its header tells of" in capsys.readouterr().err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
@pytest.mark.parametrize("name", ["heart.vtu", "heart.nii", "heart.dcm", "heart.1"])
def test_pipes_are_not_waited_for(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / name
    os.mkfifo(path)
    command = "check" if name.endswith(".vtu") else "mesh"
    given = ["-o", str(tmp_path / "out"), "--preset", "acdc"] if command == "mesh" else []
    assert main([command, str(path), *given]) == 2
    assert "is no regular file" in capsys.readouterr().err


@pytest.mark.parametrize("axes", ["-1", "0x10", "9" * 30])
def test_axes_that_are_no_number(axes: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "heart.mha"
    fp.write_segmentation(lv_ellipsoid().segmentation((3.0, 3.0, 10.0)), path)
    path.write_bytes(path.read_bytes().replace(b"NDims = 3", f"NDims = {axes}".encode()))
    assert main(["mesh", str(path), "-o", str(tmp_path / "out"), "--preset", "acdc"]) == 2
    assert "its header has 'NDims'" in capsys.readouterr().err
