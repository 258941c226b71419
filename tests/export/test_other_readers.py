"""FEBio, LS-DYNA, svMultiPhysics, openCARP and MED files, element by element, by readers that are not ours."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import pyvista
from meshes import mixed, truncated_ellipsoid, with_fibres

from femprep.errors import InputError
from femprep.export import write_mesh
from femprep.export.deck.names import facet_nodes
from femprep.mesh.elements import ELEMENTS, match_facets
from femprep.model import REGION_TAGS, VolumeMesh

KINDS = [*ELEMENTS, "mixed"]


def mesh_of(kind: str) -> VolumeMesh:
    mesh = with_fibres(mixed() if kind == "mixed" else truncated_ellipsoid(kind, curved=True))
    return mesh.with_data(cell={"aha": np.arange(mesh.n_cells, dtype=np.int32) % 17 + 1})


def tagged(mesh: VolumeMesh, tag: int) -> list[list[int]]:
    """The facets of a tag as lists of node numbers, over all blocks in order."""
    out, first = [], 0
    for block in mesh.facets.values():
        out += block[mesh.facet_tag[first : first + len(block)] == tag].tolist()
        first += len(block)
    return out


# ----------------------------------------------------------------------------------------------- FEBio


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("kind", KINDS)
def test_febio_python_reads_the_feb(kind: str, tmp_path: Path) -> None:
    feb_module = pytest.importorskip("febio_python.feb")
    mesh = mesh_of(kind)
    write_mesh(mesh, tmp_path / "lv.feb", step="inflation", length_unit="cm")
    # febio-python keeps what it once read by the text of ``repr``, which says only how many nodes a file has.
    own = type("Feb40", (feb_module.Feb40,), {"__repr__": lambda self: str(tmp_path)})
    feb = own(filepath=tmp_path / "lv.feb")
    nodes = np.concatenate([block.coordinates for block in feb.get_nodes(dtype=np.float64)])
    assert np.array_equal(nodes, mesh.points * 0.1)

    febio = {"tetra": "TET4", "tetra10": "TET10", "wedge": "PENTA6", "wedge15": "PENTA15"}
    febio |= {"hexahedron": "HEX8", "hexahedron20": "HEX20"}
    sheets = {part.name: part for part in feb.get_volume_elements()}
    material_axes = _material_axes(tmp_path / "lv.feb")
    seen, first = 0, 0
    for name, block in mesh.cells.items():
        for region, tag in REGION_TAGS.items():
            rows = np.flatnonzero(mesh.region[first : first + len(block)] == tag)
            if not rows.size:
                continue
            part = sheets[region if region in sheets else f"{region}_{febio[name].lower()}"]
            assert part.type.upper() == febio[name]
            assert np.array_equal(part.connectivity, block[rows])
            fiber, sheet = material_axes[part.name]
            assert np.array_equal(fiber, np.asarray(mesh.cell_data["fiber"])[rows + first])
            assert np.array_equal(sheet, np.asarray(mesh.cell_data["sheet"])[rows + first])
            seen += len(rows)
        first += len(block)
    assert seen == mesh.n_cells
    ids = np.concatenate([part.ids for part in feb.get_volume_elements()])
    assert np.array_equal(ids, np.arange(mesh.n_cells))  # FEBio wants them to increase

    node_sets = {entry.name: entry.ids for entry in feb.get_nodesets()}
    for facet, tag in mesh.facet_names.items():
        assert np.array_equal(node_sets[facet], facet_nodes(mesh, tag))
    assert [load.surface for load in feb.get_pressure_loads()] == ["endo"]
    assert feb.get_pressure_loads()[0].multiplier == pytest.approx(1e4)  # 1 kPa in dyn/cm2
    assert [domain.mat for domain in feb.get_mesh_domains()] == ["myocardium"] * len(sheets)
    # Of boundary conditions febio-python knows those alone that FEBio gives no reactions of.
    held = ElementTree.parse(tmp_path / "lv.feb").getroot().findall("Boundary/bc")
    assert [(bc.get("node_set"), bc.findtext("dof"), bc.findtext("value")) for bc in held] == [
        ("base", axis, "0") for axis in "xyz"
    ]
    assert len(feb.get_loadcurves()) == 1


def _material_axes(path: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    found = {}
    for data in ElementTree.parse(path).getroot().iterfind("MeshData/ElementData[@type='mat_axis']"):
        rows = list(data.iterfind("elem"))
        assert [int(row.get("lid", "")) for row in rows] == list(range(1, len(rows) + 1))
        fiber, sheet = ([[float(x) for x in (row.findtext(axis) or "").split(",")] for row in rows] for axis in "ad")
        found[data.get("elem_set", "")] = (np.array(fiber), np.array(sheet))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_febio_surfaces_sets_and_order_of_sections(kind: str, tmp_path: Path) -> None:
    mesh = mesh_of(kind)
    write_mesh(mesh, tmp_path / "lv.feb", step="inflation", material="orthotropic")
    root = ElementTree.parse(tmp_path / "lv.feb").getroot()
    order = [
        "Module",
        "Control",
        "Material",
        "Mesh",
        "MeshDomains",
        "MeshData",
        "Boundary",
        "Loads",
        "LoadData",
        "Output",
    ]
    assert [child.tag for child in root] == order
    for name, tag in mesh.facet_names.items():
        surface = root.find(f"Mesh/Surface[@name='{name}']")
        assert surface is not None
        facets = [[int(text) - 1 for text in (facet.text or "").split(",")] for facet in surface]
        assert facets == tagged(mesh, tag)
        sizes = {"tri3": 3, "tri6": 6, "quad4": 4, "quad8": 8}
        assert [sizes[facet.tag] for facet in surface] == [len(facet) for facet in facets]
    materials = root.findall("Material/material")
    assert [entry.get("type") for entry in materials] == ["orthotropic elastic"]
    constants = {child.tag: float(child.text or "nan") for child in materials[0]}
    assert constants["E1"] == pytest.approx(0.09)  # MPa: three times 30 kPa
    # The compliance is symmetric: v31 / E3 = v13 / E1.
    assert constants["v31"] / constants["E3"] == pytest.approx(0.4 / constants["E1"])
    numbers = {}
    for part in root.iterfind("Mesh/Elements"):
        for element in part:
            numbers[tuple(int(t) - 1 for t in (element.text or "").split(","))] = int(element.get("id", ""))
    elements = [tuple(row) for block in mesh.cells.values() for row in block.tolist()]
    for segment in (1, 17):
        entry = root.find(f"Mesh/ElementSet[@name='aha_{segment}']")
        assert entry is not None
        rows = np.flatnonzero(np.asarray(mesh.cell_data["aha"]) == segment)
        assert {int(t) for t in (entry.text or "").split(",")} == {numbers[elements[row]] for row in rows}


def test_febio_file_without_a_step_has_no_loads(tmp_path: Path) -> None:
    write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.feb")
    assert [c.tag for c in ElementTree.parse(tmp_path / "lv.feb").getroot()] == [
        *("Module", "Material", "Mesh", "MeshDomains", "Output")
    ]


# --------------------------------------------------------------------------------------------- LS-DYNA


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge", "hexahedron", "mixed"])
def test_pydyna_reads_the_keyword_file(kind: str, tmp_path: Path) -> None:
    dyna = pytest.importorskip("ansys.dyna.core")
    mesh = mesh_of(kind)
    write_mesh(mesh, tmp_path / "lv.k")
    deck = dyna.Deck()
    deck.loads((tmp_path / "lv.k").read_text())
    assert not deck.string_keywords
    table = next(iter(deck.get_kwds_by_type("NODE"))).nodes
    assert np.array_equal(table["nid"], np.arange(1, len(mesh.points) + 1))
    # Sixteen characters hold ten digits behind the point of what lies below 1000 mm.
    assert np.abs(table[["x", "y", "z"]].to_numpy(dtype=float) - mesh.points).max() <= 1e-10

    parts = {}
    for entry in deck.get_kwds_by_type("PART"):
        rows = entry.parts
        parts |= {int(pid): str(title).split()[0] for pid, title in zip(rows["pid"], rows["heading"])}
    found = [entry.elements for entry in deck.get_kwds_by_type("ELEMENT")]
    fiber = np.concatenate([e[["a1", "a2", "a3"]].to_numpy(dtype=float) for e in found])
    sheet = np.concatenate([e[["d1", "d2", "d3"]].to_numpy(dtype=float) for e in found])
    np.testing.assert_allclose(fiber, mesh.cell_data["fiber"], rtol=0, atol=1e-13)
    np.testing.assert_allclose(sheet, mesh.cell_data["sheet"], rtol=0, atol=1e-13)
    regions = np.concatenate([[REGION_TAGS[parts[int(pid)]] for pid in e["pid"]] for e in found])
    assert np.array_equal(regions, mesh.region)
    for entry, (name, block) in zip(found, mesh.cells.items()):
        columns = [f"n{i}" for i in range(1, (10 if name == "tetra10" else 8) + 1)]
        nodes = entry[columns].to_numpy(dtype=int) - 1
        assert np.array_equal(nodes, _places(name, block))
        if name != "tetra10":
            assert _hexahedron_volume(mesh.points, nodes).min() > 0

    segments = {int(e.sid): e for e in deck.get_kwds_by_type("SET") if "SEGMENT" in e.get_title()}
    nodes = {int(e.sid): e for e in deck.get_kwds_by_type("SET") if "NODE" in e.get_title()}
    solids = _solid_sets(tmp_path / "lv.k")
    for tag in mesh.facet_names.values():
        rows = segments[tag].segments[["n1", "n2", "n3", "n4"]].to_numpy(dtype=int) - 1
        wanted = [row[: len(row) if len(row) < 6 else len(row) // 2] for row in tagged(mesh, tag)]
        assert rows.tolist() == [row if len(row) == 4 else [*row, row[-1]] for row in wanted]
        assert sorted(int(n) - 1 for n in nodes[tag].nodes) == facet_nodes(mesh, tag).tolist()
    assert [e.title for e in deck.get_kwds_by_type("SET") if "SOLID" in e.get_title()] == list(solids)
    for name, rows in {"lv": mesh.region == 1, "septum": mesh.region == 3, "aha_7": mesh.cell_data["aha"] == 7}.items():
        assert solids[name] == (np.flatnonzero(rows) + 1).tolist()


def _solid_sets(path: Path) -> dict[str, list[int]]:
    """Sets of solids by title, in fields of ten columns: pydyna reads but the first card of each."""
    found = {}
    for section in path.read_text().split("*SET_SOLID_TITLE\n")[1:]:
        title, _, *cards = section.split("*")[0].splitlines()
        found[title] = [int(card[i : i + 10]) for card in cards for i in range(0, len(card), 10)]
    return found


def _places(kind: str, block: np.ndarray) -> np.ndarray:
    """The eight places of LS-DYNA's solid, written from its manual: repeated nodes draw edges together."""
    if kind == "tetra":
        return np.column_stack([block, block[:, [3, 3, 3, 3]]])
    if kind == "wedge":
        a, b, c, d, e, f = block.T
        return np.column_stack([b, a, d, e, c, c, f, f])
    return block


def _hexahedron_volume(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Volume of hexahedra, drawn together or not, by Gauss points."""
    corner = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]])
    corner = np.vstack([corner, corner * [1, 1, -1]])
    volume = np.zeros(len(nodes))
    for spot in corner / np.sqrt(3):
        slope = np.stack([corner[:, i] * np.prod(1 + np.delete(corner * spot, i, 1), axis=1) / 8 for i in range(3)])
        volume += np.linalg.det(np.einsum("dn,enx->edx", slope, points[nodes]))
    return volume


@pytest.mark.parametrize("kind", ["wedge15", "hexahedron20"])
def test_elements_that_ls_dyna_files_do_not_hold_are_refused(kind: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"no elements of type {kind}; write linear elements"):
        write_mesh(truncated_ellipsoid(kind), tmp_path / "lv.k")
    assert not list(tmp_path.iterdir())


# -------------------------------------------------------------------------------------- svMultiPhysics


@pytest.mark.parametrize("kind", KINDS)
def test_vtk_reads_the_mesh_complete_folder(kind: str, tmp_path: Path) -> None:
    mesh = mesh_of(kind)
    folder = tmp_path / "lv"
    assert write_mesh(mesh, folder, format="svmultiphysics", length_unit="cm") == [folder]
    grid = pyvista.read(folder / "mesh-complete.mesh.vtu")
    assert np.array_equal(grid.points, mesh.points * 0.1)
    assert np.array_equal(grid.point_data["GlobalNodeID"], np.arange(1, len(mesh.points) + 1))
    assert np.array_equal(grid.cell_data["GlobalElementID"], np.arange(1, mesh.n_cells + 1))
    assert np.array_equal(grid.cell_data["DOMAIN_ID"], mesh.region)
    assert np.array_equal(grid.cell_data["aha"], mesh.cell_data["aha"])
    nodes = np.concatenate([block.ravel() for block in mesh.cells.values()])
    assert np.array_equal(grid.cell_connectivity, nodes)
    element, _ = match_facets(mesh.cells, mesh.facets)
    assert {path.stem for path in (folder / "mesh-surfaces").iterdir()} == set(mesh.facet_names)
    for name, tag in mesh.facet_names.items():
        face = pyvista.read(folder / "mesh-surfaces" / f"{name}.vtp")
        number = np.asarray(face.point_data["GlobalNodeID"]) - 1
        assert np.array_equal(face.points, grid.points[number])
        assert [number[list(cell.point_ids)].tolist() for cell in face.cell] == tagged(mesh, tag)
        assert np.array_equal(face.cell_data["GlobalElementID"], element[mesh.facet_tag == tag] + 1)
    for file, data in (("fibersLong", "fiber"), ("fibersSheet", "sheet")):
        assert np.array_equal(pyvista.read(folder / f"{file}.vtu").cell_data["FIB_DIR"], mesh.cell_data[data])


def test_an_earlier_folder_is_replaced_whole(tmp_path: Path) -> None:
    write_mesh(mesh_of("tetra"), tmp_path / "lv", format="svmultiphysics")
    write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv", format="svmultiphysics")
    assert not (tmp_path / "lv" / "fibersLong.vtu").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["lv"]


# -------------------------------------------------------------------------------------------- openCARP


@pytest.mark.parametrize("kind", KINDS)
def test_opencarp_files_after_their_own_description(kind: str, tmp_path: Path) -> None:
    mesh = mesh_of(kind)
    write_mesh(mesh, tmp_path / "lv.pts", length_unit="m")  # openCARP's unit stays micrometres
    points = _table(tmp_path / "lv.pts")
    corners = np.unique(np.concatenate([b[:, : ELEMENTS[k].corners].ravel() for k, b in mesh.cells.items()]))
    np.testing.assert_allclose(points, mesh.points[corners] * 1000, rtol=1e-15)
    lines = (tmp_path / "lv.elem").read_text().splitlines()
    assert int(lines[0]) == mesh.n_cells == len(lines) - 1
    row = 0
    for name, block in mesh.cells.items():
        count = ELEMENTS[name].corners
        for nodes in block[:, :count].tolist():
            word, *numbers = lines[1 + row].split()
            *found, tag = map(int, numbers)
            assert word == {4: "Tt", 6: "Pr", 8: "Hx"}[count]
            assert tag == mesh.region[row]
            assert [corners[n] for n in found] == nodes[: count // 2 + (count == 4) * 2] + _carp_top(nodes)
            row += 1
    header, *rest = (tmp_path / "lv.lon").read_text().splitlines()
    assert header == "2"
    axes = np.array([line.split() for line in rest], dtype=float)
    assert np.array_equal(axes[:, :3], mesh.cell_data["fiber"])
    assert np.array_equal(axes[:, 3:], mesh.cell_data["sheet"])
    for name, tag in mesh.facet_names.items():
        count, *facets = (tmp_path / f"lv.{name}.surf").read_text().splitlines()
        assert int(count) == len(facets)
        found = [[int(corners[int(n)]) for n in line.split()[1:]] for line in facets]
        wanted = [row if len(row) < 6 else row[: len(row) // 2] for row in tagged(mesh, tag)]
        assert found == [[row[0], *row[:0:-1]] for row in wanted]  # MeshTool's surfaces look inwards
        assert [line.split()[0] for line in facets] == [{3: "Tr", 4: "Qd"}[len(row)] for row in wanted]
        count, kind_, *vertices = (tmp_path / f"lv.{name}.vtx").read_text().splitlines()
        assert (int(count), kind_) == (len(vertices), "extra")
        assert {int(corners[int(v)]) for v in vertices} == {n for row in wanted for n in row}
    assert [int(n) for n in (tmp_path / "lv.aha.dat").read_text().split()] == list(mesh.cell_data["aha"])
    assert "1 lv\n3 septum\n101 endo\n" in (tmp_path / "lv.tags.txt").read_text()


def _carp_top(nodes: list[int]) -> list[int]:
    """The second face of openCARP's prism (node 3 above 0, 5 above 1, 4 above 2) and hexahedron (4, 7, 6, 5)."""
    if len(nodes) == 6:
        return [nodes[3], nodes[5], nodes[4]]
    return [nodes[4], nodes[7], nodes[6], nodes[5]] if len(nodes) == 8 else []


def _table(path: Path) -> np.ndarray:
    count, *lines = path.read_text().splitlines()
    assert int(count) == len(lines)
    return np.array([line.split() for line in lines], dtype=float)


def test_opencarp_without_fibres_and_with_fibres_alone(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    write_mesh(mesh, tmp_path / "plain.pts")
    assert set((tmp_path / "plain.lon").read_text().splitlines()[1:]) == {"1.0 0.0 0.0"}
    fiber = with_fibres(mesh).cell_data["fiber"]
    write_mesh(mesh.with_data(cell={"fiber": fiber}), tmp_path / "one.pts")
    assert (tmp_path / "one.lon").read_text().splitlines()[0] == "1"
    assert np.array_equal(np.loadtxt(tmp_path / "one.lon", skiprows=1), fiber)


# ------------------------------------------------------------------------------------------------- MED


@pytest.mark.solver
@pytest.mark.parametrize("kind", KINDS)
def test_medconforme_accepts_the_med_file(kind: str, tmp_path: Path) -> None:
    program = shutil.which("medconforme")
    if program is None:
        pytest.skip("medconforme is not installed")
    write_mesh(mesh_of(kind), tmp_path / "lv.med")
    result = subprocess.run([program, str(tmp_path / "lv.med")], capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.count(" conforme ") == 2


@pytest.mark.parametrize("kind", KINDS)
def test_gmsh_finds_groups_and_positive_elements_in_the_med_file(kind: str, tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    mesh = mesh_of(kind)
    write_mesh(mesh, tmp_path / "lv.med")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "lv.med"))
        groups = {gmsh.model.getPhysicalName(d, t): (d, t) for d, t in gmsh.model.getPhysicalGroups() if d >= 2}
        for name, tag in {**mesh.region_names, **mesh.facet_names}.items():
            dim, group = groups[name]
            entities = gmsh.model.getEntitiesForPhysicalGroup(dim, group)
            found = sum(len(e) for entity in entities for e in gmsh.model.mesh.getElements(dim, entity)[1])
            assert dim == (3 if tag < 100 else 2)
            assert found == np.sum((mesh.region if dim == 3 else mesh.facet_tag) == tag)
        assert {f"aha_{n}" for n in range(1, 18)} <= set(groups)
        for element in gmsh.model.mesh.getElementTypes(3):
            numbers, _ = gmsh.model.mesh.getElementsByType(element)
            assert np.min(gmsh.model.mesh.getElementQualities(numbers, "minDetJac")) > 0
    finally:
        gmsh.finalize()
