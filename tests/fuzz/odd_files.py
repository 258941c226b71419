"""Files of meshes and surfaces that no random damage comes to, each by name: wrong counts, numbers and tags."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fuzz.common import SWEEP, Made
from fuzz.odd_meshes import READERS
from fuzz.sources import Sources

Odd = Callable[[Sources, Path], Made]


def _vtu(points: str, connectivity: str, offsets: str, types: str, counts: tuple[int, int] = (4, 1)) -> str:
    array = '<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="ascii">{}</DataArray>'
    cells = "".join(
        array.format("Int64", name, 1, text)
        for name, text in (("connectivity", connectivity), ("offsets", offsets), ("types", types))
    )
    return (
        '<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">'
        "<UnstructuredGrid>"
        f'<Piece NumberOfPoints="{counts[0]}" NumberOfCells="{counts[1]}"><Points>'
        f"{array.format('Float64', 'Points', 3, points)}</Points><Cells>{cells}</Cells></Piece>"
        "</UnstructuredGrid></VTKFile>"
    )


_P = "0 0 0 9 0 0 0 9 0 0 0 9"
_LEGACY = "# vtk DataFile Version 3.0\na\nASCII\nDATASET "
_FOUR = "4\n1 0. 0. 0.\n2 9. 0. 0.\n3 0. 9. 0.\n4 0. 0. 9.\n"
_NODES = "*NODE\n1,0,0,0\n2,9,0,0\n3,0,9,0\n4,0,0,9\n"
_TET = "*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n"
_GMSH = "$MeshFormat\n{} 0 8\n$EndMeshFormat\n"
_FEB = (
    '<?xml version="1.0"?><febio_spec version="4.0"><Mesh><Nodes>{}</Nodes>'
    '<Elements type="{}" name="a"><elem id="1">{}</elem></Elements></Mesh></febio_spec>'
)
_FEB_NODES = "".join(f'<node id="{i + 1}">{p}</node>' for i, p in enumerate(("0,0,0", "9,0,0", "0,9,0", "0,0,9")))
#: Names and contents of files.
TEXTS: dict[str, tuple[str, str | bytes]] = {
    "VTU: a corner beyond all": ("a.vtu", _vtu(_P, "0 1 2 999999999999", "4", "10")),
    "VTU: a negative corner": ("a.vtu", _vtu(_P, "0 1 2 -3", "4", "10")),
    "VTU: offsets that go back": ("a.vtu", _vtu(_P, "0 1 2 3 0 1 2 3", "8 4", "10 10", (4, 2))),
    "VTU: an offset of nothing": ("a.vtu", _vtu(_P, "0 1 2 3", "0", "10")),
    "VTU: an offset beyond all": ("a.vtu", _vtu(_P, "0 1 2 3", "999999999", "10")),
    "VTU: no such type": ("a.vtu", _vtu(_P, "0 1 2 3", "4", "222")),
    "VTU: a polyhedron": ("a.vtu", _vtu(_P, "0 1 2 3", "4", "42")),
    "VTU: a polygon": ("a.vtu", _vtu(_P, "0 1 2 3", "4", "7")),
    "VTU: a voxel": ("a.vtu", _vtu(_P + " " + _P, "0 1 2 3 4 5 6 7", "8", "11", (8, 1))),
    "VTU: a tetrahedron of three corners": ("a.vtu", _vtu(_P, "0 1 2", "3", "10")),
    "VTU: more points than are there": ("a.vtu", _vtu(_P, "0 1 2 3", "4", "10", (99999999999, 1))),
    "VTU: nothing": ("a.vtu", _vtu("", "", "", "", (0, 0))),
    "VTU: words": ("a.vtu", _vtu("a b c", "0 1 2 3", "4", "10")),
    "VTU: not a number": ("a.vtu", _vtu("nan " * 12, "0 1 2 3", "4", "10")),
    "VTU: empty": ("a.vtu", ""),
    "VTU: an empty tag": ("a.vtu", "<VTKFile/>"),
    "VTU: parts elsewhere": (
        "a.pvtu", '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="/etc/passwd"/>'
        "</PUnstructuredGrid></VTKFile>"),
    "VTU: a collection": (
        "a.pvd", '<VTKFile type="Collection"><Collection><DataSet file="a.pvd"/></Collection></VTKFile>'),
    "VTP: surface as a mesh": ("a.vtp", '<VTKFile type="PolyData"><PolyData/></VTKFile>'),
    "VTK: empty": ("a.vtk", ""),
    "VTK: a heading alone": ("a.vtk", _LEGACY + "UNSTRUCTURED_GRID\n"),
    "VTK: counts beyond all": (
        "a.vtk", _LEGACY + "UNSTRUCTURED_GRID\nPOINTS 999999999999 double\n0 0 0\n"),
    "VTK: structured": (
        "a.vtk", _LEGACY + "STRUCTURED_POINTS\nDIMENSIONS 9999 9999 9999\n"
        "ORIGIN 0 0 0\nSPACING 1 1 1\n"),
    "Abaqus: empty": ("a.inp", ""),
    "Abaqus: nodes alone": ("a.inp", _NODES),
    "Abaqus: elements alone": ("a.inp", _TET),
    "Abaqus: takes in itself": ("a.inp", "*INCLUDE, INPUT=a.inp\n"),
    "Abaqus: takes in a device": ("a.inp", "*INCLUDE, INPUT=/dev/zero\n"),
    "Abaqus: a number twice": ("a.inp", _NODES + "1,5,5,5\n" + _TET + "1,1,2,4,3\n"),
    "Abaqus: a node of 10^18": ("a.inp", _NODES + "1000000000000000000,5,5,5\n" + _TET),
    "Abaqus: a node of -1": ("a.inp", _NODES + "-1,5,5,5\n" + _TET),
    "Abaqus: a billion numbers": ("a.inp", _NODES + _TET + "*ELSET,ELSET=A,GENERATE\n1,100000000000,1\n"),
    "Abaqus: a billion nodes": ("a.inp", _NODES + _TET + "*NSET,NSET=A,GENERATE\n1,100000000000,1\n"),
    "Abaqus: steps of none": ("a.inp", _NODES + _TET + "*ELSET,ELSET=A,GENERATE\n1,9,0\n"),
    "Abaqus: steps back": ("a.inp", _NODES + _TET + "*ELSET,ELSET=A,GENERATE\n9,1,-1\n"),
    "Abaqus: a set of itself": ("a.inp", _NODES + _TET + "*ELSET,ELSET=A\nA\n*ELSET,ELSET=B\nC\n*ELSET,ELSET=C\nB\n"),
    "Abaqus: a surface of nothing": ("a.inp", _NODES + _TET + "*SURFACE,NAME=S,TYPE=ELEMENT\nNONE,S1\n1,S9\n"),
    "Abaqus: elements of no type": ("a.inp", _NODES + "*ELEMENT\n1,1,2,3,4\n*ELEMENT,TYPE=\n2,1,2,3,4\n"),
    "Abaqus: a line of a million commas": ("a.inp", _NODES + "," * 1000000 + "\n" + _TET),
    "Gmsh: empty": ("a.msh", ""),
    "Gmsh: version 1": ("a.msh", "$NOD\n" + _FOUR + "$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n"),
    "Gmsh: version 9": ("a.msh", _GMSH.format("9.9")),
    "Gmsh: counts beyond all": ("a.msh", _GMSH.format("2.2") + "$Nodes\n999999999999\n1 0 0 0\n$EndNodes\n"),
    "Gmsh: version 4.1, counts beyond all": (
        "a.msh", _GMSH.format("4.1") + "$Nodes\n99999999 99999999999 1 9\n3 1 0 99999999999\n$EndNodes\n"),
    "Gmsh: no such type": (
        "a.msh", _GMSH.format("2.2") + "$Nodes\n" + _FOUR + "$EndNodes\n$Elements\n1\n1 999 0 1 2 3 4\n$EndElements\n"),
    "Gmsh: a corner of none": (
        "a.msh", _GMSH.format("2.2") + "$Nodes\n" + _FOUR + "$EndNodes\n$Elements\n1\n1 4 0 1 2 3 9\n$EndElements\n"),
    "FEBio: empty": ("a.feb", ""),
    "FEBio: no such type": ("a.feb", _FEB.format(_FEB_NODES, "tet99", "1,2,3,4")),
    "FEBio: a corner of none": ("a.feb", _FEB.format(_FEB_NODES, "tet4", "1,2,3,99")),
    "FEBio: three corners": ("a.feb", _FEB.format(_FEB_NODES, "tet4", "1,2,3")),
    "FEBio: no nodes": ("a.feb", _FEB.format("", "tet4", "1,2,3,4")),
    "FEBio: words": ("a.feb", _FEB.format(_FEB_NODES, "tet4", "a,b,c,d")),
    "FEBio: entities": ("a.feb", '<!DOCTYPE a [<!ENTITY b "c">]>' + _FEB.format("&b;", "tet4", "1,2,3,4")),
    "FEBio: a hundred thousand tags in each other": ("a.feb", "<a>" * 100000),
    "LS-DYNA: empty": ("a.k", ""),
    "LS-DYNA: takes in itself": ("a.k", "*KEYWORD\n*INCLUDE\na.k\n*END\n"),
    "LS-DYNA: a billion numbers": (
        "a.k", "*KEYWORD\n*NODE\n       1 0.0 0.0 0.0\n*SET_SOLID_GENERATE\n1\n1,100000000000\n*END\n"),
    "LS-DYNA: elements alone": ("a.k", "*KEYWORD\n*ELEMENT_SOLID\n1,1,1,2,3,4,4,4,4,4\n*END\n"),
    "openCARP: no elements": ("a.pts", "4\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n"),
    "openCARP: counts beyond all": ("a.pts", "999999999999\n0 0 0\n"),
    "openCARP: binary": ("a.bpts", b"999999999999 0 1\n".ljust(1024, b"\0")),
    "Medit: empty": ("a.mesh", ""),
    "Medit: counts beyond all": (
        "a.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n999999999999\n0 0 0 0\nEnd\n"),
    "Medit: negative counts": ("a.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n-9\nTetrahedra\n-1\nEnd\n"),
    "Medit: dimension 9": ("a.mesh", "MeshVersionFormatted 2\nDimension 9\nVertices\n1\n0 0 0 0\nEnd\n"),
    "XDMF: empty": ("a.xdmf", ""),
    "XDMF: parts of itself": (
        "a.xdmf", '<Xdmf xmlns:xi="http://www.w3.org/2001/XInclude"><Domain><xi:include href="a.xdmf"/></Domain>'
        "</Xdmf>"),
    "XDMF: a file that is not there": (
        "a.xdmf", '<Xdmf Version="3.0"><Domain><Grid><Geometry GeometryType="XYZ"><DataItem Format="HDF" '
        'Dimensions="4 3">none.h5:/x</DataItem></Geometry></Grid></Domain></Xdmf>'),
    "XDMF: dimensions beyond all": (
        "a.xdmf", '<Xdmf Version="3.0"><Domain><Grid><Geometry GeometryType="XYZ"><DataItem Format="XML" '
        'Dimensions="999999999999 3">0 0 0</DataItem></Geometry></Grid></Domain></Xdmf>'),
    "MED: empty": ("a.med", ""),
    "MED: text": ("a.med", "a heart\n" * 100),
    "MED: a signature alone": ("a.med", b"\x89HDF\r\n\x1a\n" + bytes(100)),
    "Tetgen: counts beyond all": ("a.node", "999999999999 3 0 0\n1 0 0 0\n"),
    "Exodus: empty": ("a.e", ""),
    "CGNS: empty": ("a.cgns", ""),
    "an ending nobody knows": ("a.heart", "a heart"),
    "no ending": ("a", "a heart"),
    "an ending in capitals": ("A.VTU", _vtu(_P, "0 1 2 3", "4", "10")),
    "two endings": ("a.vtu.gz", ""),
}  # fmt: skip


def _text(name: str, content: str | bytes, command: str) -> Odd:
    def made(sources: Sources, folder: Path) -> Made:
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        words, out = READERS[command]
        return Made("", [command, str(path), *words, "-q"], out)

    return made


_BALL = "".join(f"{p}\n" for p in ("0 0 0", "9 0 0", "0 9 0", "0 0 9"))
#: Surfaces as files.
SURFACES: dict[str, tuple[str, str | bytes]] = {
    "STL: empty": ("a.stl", ""),
    "STL: no triangles": ("a.stl", "solid a\nendsolid a\n"),
    "STL: a count beyond all": ("a.stl", bytes(80) + b"\xff\xff\xff\xff" + bytes(50)),
    "STL: one triangle of one point": ("a.stl", bytes(80) + b"\x01\0\0\0" + bytes(50)),
    "STL: not a number": ("a.stl", bytes(80) + b"\x02\0\0\0" + b"\xff" * 100),
    "PLY: empty": ("a.ply", ""),
    "PLY: a count beyond all": (
        "a.ply", "ply\nformat ascii 1.0\nelement vertex 999999999999\nproperty float x\nend_header\n0\n"),
    "PLY: negative counts": ("a.ply", "ply\nformat ascii 1.0\nelement vertex -4\nproperty float x\nend_header\n"),
    "OFF: empty": ("a.off", ""),
    "OFF: a count beyond all": ("a.off", "OFF\n999999999999 999999999999 0\n"),
    "OFF: a corner of none": ("a.off", f"OFF\n4 1 0\n{_BALL}3 0 1 77\n"),
    "OBJ: empty": ("a.obj", ""),
    "OBJ: a corner of none": ("a.obj", "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 99\n"),
    "OBJ: a corner 0": ("a.obj", "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 0 1 2\n"),
    "OBJ: corners counted back": ("a.obj", "v 0 0 0\nv 9 0 0\nv 0 9 0\nf -1 -2 -99\n"),
    "OBJ: points alone": ("a.obj", "v 0 0 0\nv 9 0 0\nv 0 9 0\n"),
    "VTP: empty": ("a.vtp", ""),
    "another ending": ("a.png", b"\x89PNG"),
}  # fmt: skip


def _surface(name: str, content: str | bytes) -> Odd:
    def made(sources: Sources, folder: Path) -> Made:
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return Made("", ["mesh", "-o", "out", "--surface", f"lv={path}", "--surface", f"epi={path}", *SWEEP], "out")

    return made


FILES: dict[str, Odd] = {
    **{f"{command}: {name}": _text(*one, command) for name, one in TEXTS.items() for command in ("check", "convert")},
    **{f"surface, {name}": _surface(*one) for name, one in SURFACES.items()},
}
