"""HDF5 files of others: sizes with nothing behind them, and ways into other files, are refused; ours are read."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.errors import FileError
from femprep.export.hdf5 import require_hdf5

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


def huge(group: object, name: str, _: Path) -> None:
    group.create_dataset(name, (2**40, 3), "<f8", chunks=(1024, 3))  # type: ignore[attr-defined]


def linked(group: object, name: str, folder: Path) -> None:
    group[name] = h5py.ExternalLink(str(folder / "other.h5"), "/x")  # type: ignore[index]


def counted(group: object, name: str, _: Path) -> None:
    group.create_group(name).attrs["NBR"] = 2**40  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (counted, "has 1099511627776 parts"),
        (huge, "has 26388279066624 bytes, and 0 are stored"),
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


def test_ring_of_free_room(mesh: tuple[Path, Path]) -> None:
    path, store = mesh
    with h5py.File(store, "r+") as file:
        file.create_group("empty")
    content = bytearray(store.read_bytes())
    assert content.count(b"HEAP")
    heap = content.rindex(b"HEAP")
    (place,) = struct.unpack_from("<Q", content, heap + 24)
    # The only free block of an empty group's names begins at 8; as the next one it names itself.
    (first,) = struct.unpack_from("<Q", content, heap + 16)
    struct.pack_into("<Q", content, place + first, first)
    store.write_bytes(content)
    with pytest.raises(FileError, match="never ends"):
        fp.read_mesh(path)


def test_points_without_end(mesh: tuple[Path, Path]) -> None:
    path, store = mesh
    with h5py.File(store, "r+") as file:
        found: list[str] = []
        file.visititems(lambda name, item: found.append(name) if getattr(item, "dtype", None) == np.float64 else None)
        shape = file[found[0]].shape
        del file[found[0]]
        file.create_dataset(found[0], (2**45, *shape[1:]), "<f8", chunks=(64, *shape[1:]), compression="gzip")
    with pytest.raises(FileError, match="are stored"):
        fp.read_mesh(path)


def test_arrays_that_compress_well_are_read(tmp_path: Path) -> None:
    path, zeros = tmp_path / "zeros.h5", np.zeros((1_000_000, 3))
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=zeros, compression="gzip", shuffle=True)
    assert path.stat().st_size < zeros.nbytes / 100
    require_hdf5(path)  # refuses nothing
    with h5py.File(path) as file:
        assert file["x"].shape == zeros.shape


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


def test_texts_that_are_larger_than_the_file_are_refused(tmp_path: Path) -> None:
    """HDF5 asked for 4 GB to read a word."""
    path = tmp_path / "mesh.h5m"
    with h5py.File(path, "w") as store:
        store.attrs["kind"] = "Tetrahedron"
    require_hdf5(path)
    content = bytearray(path.read_bytes())
    heap = content.index(b"GCOL")
    struct.pack_into("<Q", content, heap + 8, 2**32)
    path.write_bytes(content)
    with pytest.raises(FileError, match="heaps is larger than the file"):
        require_hdf5(path)


def test_a_place_in_hdf5_under_another_format_is_not_followed(tmp_path: Path) -> None:
    """Nobody has looked for links and sizes in a file that is not named as HDF5."""
    path = tmp_path / "mesh.xdmf"
    fp.write_mesh(truncated_ellipsoid(heights=2, around=6, layers=1), path, format="dolfinx")
    path.write_text(path.read_text().replace('Format="HDF"', 'Format="XML"'))
    with pytest.raises(FileError, match="no numbers"):
        fp.read_mesh(path)


def test_a_dimension_that_is_missing_is_refused(tmp_path: Path) -> None:
    """HDF5 asks for gigabytes to unpack a part of an array that has another number of dimensions."""
    path = tmp_path / "mesh.h5m"
    with h5py.File(path, "w") as store:
        store.create_dataset("points", data=np.zeros((5, 7)), chunks=(5, 7), compression="gzip")
    require_hdf5(path)
    head = bytes([1, 2, 1, 0, 0, 0, 0, 0]) + np.array([5, 7], "<u8").tobytes()
    content = path.read_bytes()
    assert content.count(head) == 1
    path.write_bytes(content.replace(head, bytes([1, 1]) + head[2:]))
    with pytest.raises(FileError, match="'points' has 1 dimensions, and keeps it in 2"):
        require_hdf5(path)


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


def test_a_driver_in_the_first_block_is_refused(tmp_path: Path) -> None:
    """HDF5 takes what stands at its place for a size: 1 GB for a file of 76 kB."""
    path = tmp_path / "mesh.med"
    fp.write_mesh(truncated_ellipsoid(heights=2, around=6, layers=1), path)
    data = bytearray(path.read_bytes())
    assert data[8] == 0
    data[48:56] = struct.pack("<Q", 35)
    path.write_bytes(data)
    with pytest.raises(FileError, match="its first block tells of a driver"):
        fp.read_mesh(path)


def test_hdf5_behind_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mesh.med"
    fp.write_mesh(truncated_ellipsoid(heights=2, around=6, layers=1), path)
    path.write_bytes(bytes(1024) + path.read_bytes())
    with pytest.raises(FileError, match="is HDF5 behind 1024 bytes of something else"):
        fp.read_mesh(path)
