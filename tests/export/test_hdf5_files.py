"""HDF5 files of others: ways into other files are refused; ours are read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.errors import FileError

h5py = pytest.importorskip("h5py")


@pytest.fixture(params=["med", "dolfinx"])
def mesh(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, Path]:
    """A mesh and its HDF5 file."""
    path = tmp_path / ("mesh.med" if request.param == "med" else "mesh.xdmf")
    fp.write_mesh(truncated_ellipsoid(heights=2, around=6, layers=1), path, format=request.param)
    store = path if request.param == "med" else path.with_suffix(".h5")
    assert fp.read_mesh(path).n_cells > 0
    return path, store


def elsewhere(group: object, name: str, folder: Path) -> None:
    other = folder / "other.bin"
    other.write_bytes(bytes(800))
    group.create_dataset(name, (100,), "<f8", external=[(str(other), 0, 800)])  # type: ignore[attr-defined]


def virtual(group: object, name: str, folder: Path) -> None:
    layout = h5py.VirtualLayout((100,), "<f8")
    layout[:] = h5py.VirtualSource(str(folder / "other.h5"), "x", (100,))
    group.create_virtual_dataset(name, layout)  # type: ignore[attr-defined]


def linked(group: object, name: str, folder: Path) -> None:
    group[name] = h5py.ExternalLink(str(folder / "other.h5"), "/x")  # type: ignore[index]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (elsewhere, "in other files"),
        (virtual, "in other files"),
        (linked, "leads to .*other.h5"),
    ],
)
def test_what_leads_nowhere_good_is_refused(
    mesh: tuple[Path, Path], spoil: Callable[..., None], words: str, tmp_path: Path
) -> None:
    path, store = mesh
    with h5py.File(store, "r+") as file:
        name = "ENS_MAA" if "ENS_MAA" in file else "Mesh"
        spoil(file[name], "extra", tmp_path)
    with pytest.raises(FileError, match=words) as caught:
        fp.read_mesh(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("format", "text"), [("HDF", "none.h5:/x"), ("HDF", "/dev:/x"), ("Binary", "/dev/zero")])
def test_xdmf_that_names_no_file(format: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / "mesh.xdmf"
    item = f'<DataItem DataType="Float" Dimensions="4 3" Format="{format}" Precision="8">{text}</DataItem>'
    path.write_text(
        f'<Xdmf Version="3.0"><Domain><Grid Name="Grid"><Geometry GeometryType="XYZ">{item}</Geometry></Grid></Domain>'
        "</Xdmf>"
    )
    with pytest.raises(FileError, match="which is no file"):
        fp.read_mesh(path)


def test_a_place_in_hdf5_under_another_format_is_not_followed(tmp_path: Path) -> None:
    """Nobody has looked for links and sizes in a file that is not named as HDF5."""
    path = tmp_path / "mesh.xdmf"
    fp.write_mesh(truncated_ellipsoid(heights=2, around=6, layers=1), path, format="dolfinx")
    path.write_text(path.read_text().replace('Format="HDF"', 'Format="XML"'))
    with pytest.raises(FileError, match="no numbers"):
        fp.read_mesh(path)


@pytest.mark.parametrize("place", ["cell_data/fiber", "cell_tags/values"])
def test_xdmf_that_says_another_number_of_numbers(place: str, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(heights=2, around=6, layers=1)
    path = tmp_path / "mesh.xdmf"
    fp.write_mesh(mesh.with_data(cell={"fiber": np.ones((mesh.n_cells, 3))}), path, format="dolfinx")
    with h5py.File(path.with_suffix(".h5"), "a") as store:
        values = store[place][...]
        del store[place]
        store[place] = values[:0]
    with pytest.raises(FileError, match=f"says that '/{place}' is .*, and 'mesh.h5' has 0 numbers there"):
        fp.read_mesh(path)


def test_a_field_of_med_without_values_is_told(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(heights=2, around=6, layers=1)
    path = tmp_path / "mesh.med"
    fp.write_mesh(mesh.with_data(cell={"fiber": np.ones((mesh.n_cells, 3))}), path)
    places: list[str] = []
    with h5py.File(path, "a") as store:
        store["CHA/fiber"].visititems(lambda name, found: places.append(name) if hasattr(found, "shape") else None)
        place = "CHA/fiber/" + next(place for place in places if "MAI.TR" not in place and "MAI.QU" not in place)
        values = store[place][...]
        del store[place]
        store[place] = values[:0]
    (notice,) = fp.read_mesh(path).info["notices"]
    assert notice["what"] == "fiber is left out: it does not have numbers of one shape for all elements"
