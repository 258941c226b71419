"""XDMF that counts points from another number than 0, or in another order, which meshio passes over."""

from __future__ import annotations

from pathlib import Path

import pytest

import femprep as fp
from femprep.errors import FileError

TEXT = """<Xdmf Version="3.0"><Domain><Grid Name="a" GridType="Uniform">
<Topology TopologyType="Tetrahedron" NumberOfElements="1"{}>
<DataItem Dimensions="1 4" Format="XML" NumberType="Int">0 1 2 3</DataItem></Topology>
<Geometry GeometryType="XYZ">
<DataItem Dimensions="5 3" Format="XML" NumberType="Float">0 0 0 9 0 0 0 9 0 0 0 9 9 9 9</DataItem></Geometry>
</Grid></Domain></Xdmf>"""


def test_points_counted_otherwise_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.xdmf"
    for plain in ("", ' BaseOffset="0"'):
        path.write_text(TEXT.format(plain))
        assert fp.read_mesh(path).n_cells == 1
    for other in (' BaseOffset="1"', ' Order="3 2 1 0"'):
        path.write_text(TEXT.format(other))
        with pytest.raises(FileError, match="counts points from another number than 0, or in another order"):
            fp.read_mesh(path)
