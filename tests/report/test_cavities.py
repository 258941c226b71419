"""Closed surfaces of cavities in an output folder: what has none is told, and no other error is taken for that."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from anatomy_meshes import ellipsoid

import femprep.report.output
from femprep.errors import DiskFullError
from femprep.model import FACET_TAGS, VolumeMesh
from femprep.report.output import write_cavities


def test_a_cavity_whose_rims_touch_is_left_out_and_told(tmp_path: Path) -> None:
    # Two quadrilaterals that share a corner: their rims are no rings.
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1, 2) for x in (0, 1, 2)], dtype=float)
    bricks = [[0, 1, 4, 3, 9, 10, 13, 12], [4, 5, 8, 7, 13, 14, 17, 16]]
    tags = [FACET_TAGS["endo"]] * 2
    mesh = VolumeMesh(points, {"hexahedron": bricks}, [1, 1], {"quad": [[9, 10, 13, 12], [13, 14, 17, 16]]}, tags)
    (notice,) = write_cavities(mesh, tmp_path)
    assert notice.kind == "left out"
    assert "touches itself" in notice.what
    assert list((tmp_path / "cavities").iterdir()) == []


def test_a_full_disk_is_no_open_cavity(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise DiskFullError("no room")

    monkeypatch.setattr(femprep.report.output, "write_surface", full)
    with pytest.raises(DiskFullError):
        write_cavities(ellipsoid().mesh, tmp_path)
