"""Arrays in text: as many numbers as there are points and cells, or the file is refused."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from femprep.errors import FileError
from femprep.mesh.vtk.reading import load

pyvista = pytest.importorskip("pyvista")


def ball() -> object:
    made = pyvista.Icosphere(radius=30.0, nsub=1)
    made.point_data["direction"] = made.points
    made.cell_data["load"] = range(made.n_cells)
    return made


@pytest.fixture(params=["vtp", "vtu"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    made = ball()
    file = tmp_path / f"ball.{request.param}"
    (made if request.param == "vtp" else made.cast_to_unstructured_grid()).save(file, binary=False)  # type: ignore[attr-defined]
    assert load(file).GetNumberOfCells() == 80
    return file


@pytest.mark.parametrize("name", ["Points", "direction", "load", "connectivity", "offsets"])
def test_a_number_too_many_is_refused(path: Path, name: str) -> None:
    """VTK left the last one, and all behind it moved on by one."""
    text = path.read_text()
    array = next(one for one in re.finditer(r'<DataArray[^>]*Name="(\w+)"[^>]*>\s*(-?\d\S*\s)', text) if one[1] == name)
    path.write_text(text[: array.start(2)] + array[2] + text[array.start(2) :])
    with pytest.raises(FileError, match=r"numbers, expected|end at corner"):
        load(path)


def test_numbers_that_are_missing_are_refused(path: Path) -> None:
    text = path.read_text()
    array = next(
        one for one in re.finditer(r'<DataArray[^>]*Name="(\w+)"[^>]*>\s*(-?\d\S*\s)', text) if one[1] == "load"
    )
    path.write_text(text[: array.start(2)] + text[array.end(2) :])
    with pytest.raises(FileError, match="its array 'load' has 79 numbers, expected 80"):
        load(path)
