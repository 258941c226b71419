"""Choosing the format, and files that are there whole or not at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from meshes import truncated_ellipsoid

from femprep.errors import FileError, InputError, OptionError
from femprep.export import FORMATS, read_mesh, require_formats, write_format, write_mesh
from femprep.export.deck.names import facet_names, region_names
from femprep.export.files import whole_files


def test_unknown_format_names_the_known_ones(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    with pytest.raises(OptionError, match="unknown format 'nastran'; choose from vtu, abaqus"):
        write_mesh(mesh, tmp_path / "lv.bdf", format="nastran")
    with pytest.raises(OptionError, match=r"no ending of a known format; name one of vtu \(.vtu\)"):
        write_mesh(mesh, tmp_path / "lv.bdf")
    with pytest.raises(OptionError, match="unknown format 'x'"):
        require_formats(["abaqus", "x"])
    assert not list(tmp_path.iterdir())


def test_unknown_option_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="unknown option 'unit'"):
        write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.inp", unit="mm")


def test_missing_folder_is_said(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="does not exist; make it"):
        write_mesh(truncated_ellipsoid("tetra"), tmp_path / "no" / "lv.inp")


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no folder that even root cannot write")
def test_folder_that_cannot_be_written_is_said() -> None:
    with pytest.raises(FileError, match="'/proc' cannot be written"):
        write_mesh(truncated_ellipsoid("tetra"), "/proc/lv.inp")


def test_target_that_is_a_folder_is_said(tmp_path: Path) -> None:
    (tmp_path / "lv.inp").mkdir()
    with pytest.raises(FileError, match="is a folder"):
        write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.inp")
    assert [path.name for path in tmp_path.iterdir()] == ["lv.inp"]


def test_failure_leaves_an_earlier_file_alone(tmp_path: Path) -> None:
    (tmp_path / "lv.inp").write_text("earlier")
    mesh = truncated_ellipsoid("tetra")
    no_base = mesh.__class__(mesh.points, mesh.cells, mesh.region)
    with pytest.raises(InputError, match="needs facets tagged base and endo; this mesh has none"):
        write_mesh(no_base, tmp_path / "lv.inp", step="inflation")
    assert (tmp_path / "lv.inp").read_text() == "earlier"
    assert [path.name for path in tmp_path.iterdir()] == ["lv.inp"]


def test_interrupt_leaves_nothing(tmp_path: Path) -> None:
    def interrupted() -> None:
        with whole_files(tmp_path) as (partial, _):
            (partial / "half.inp").write_text("*NODE")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_has_its_place_in_an_output_folder(name: str, tmp_path: Path) -> None:
    written = write_format(truncated_ellipsoid("tetra"), tmp_path, name)
    assert written
    assert all(path.exists() for path in written)
    assert (tmp_path / FORMATS[name].filename).exists()
    # Formats do not tread on each other's files.
    assert len({entry.filename for entry in FORMATS.values()}) == len(FORMATS)


def test_ending_alone_chooses_the_format(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    for ending in (".vtu", ".inp", ".msh"):
        assert write_mesh(mesh, tmp_path / f"lv{ending}") == [tmp_path / f"lv{ending}"]
        assert read_mesh(tmp_path / f"lv{ending}").n_cells == mesh.n_cells


@pytest.mark.parametrize("name", FORMATS)
def test_names_from_elsewhere_do_no_harm(name: str, tmp_path: Path) -> None:
    """Names with blanks, quotes, slashes or nothing but a number stay within the folder and apart."""
    mesh = truncated_ellipsoid("tetra")
    strange = {'../../Left "ventricle"': 1, "42": 3, "a/b": 101, "a b": 102, "<base> & more": 103, "*NODE": 104}
    mesh = replace(mesh, info={"tag_names": strange})
    (tmp_path / "out").mkdir()
    write_format(mesh, tmp_path / "out", name)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert set(facet_names(mesh)) == {"a_b", "a_b_102", "base_more", "NODE"}
    assert set(region_names(mesh)) == {"Left_ventricle", "set_42"}
