"""Files of public repositories through the command that a user would type: what comes of each, as a table.

    python tests/benchmarks/bench_public_files.py FOLDER --table docs/public-files.md [--only WORD] [--keep OUT]

``FOLDER`` holds ``OWNER+NAME/PATH`` for each file below, as the repository ``github.com/OWNER/NAME`` publishes it under
its own licence; none of them is part of femprep. Files that are not there are left out of the table, and named.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple


class File(NamedTuple):
    """A file, where it is published, what it holds, and a command; ``{}`` is its path, ``{folder}`` its folder's."""

    repository: str
    licence: str
    path: str
    what: str
    command: str


_MESH = "mesh --surface {} --edge-length 4 --mesher sweep"
_OWN = "mesh --surface lv={folder}/%s --surface epi={} --edge-length 4 --mesher sweep"
_TWO = "mesh --surface lv={folder}/%s --surface rv={folder}/%s --surface epi={} --edge-length 5"
_PULSE, _LDRB = ("finsberg/pulse", "LGPL-3.0"), ("KIT-IBT/LDRB_Fibers", "GPL-3.0")
_DIGITAL = ("UK-Digital-Heart-Project/Statistical-Shape-Model", "none named")
_ATRIA, _CHASTE = ("pcmlab/atrialmtk", "GPL-3.0"), ("Chaste/Chaste", "BSD-3-Clause")
_SVFSI, _AMBIT = ("SimVascular/svFSI-Tests", "none named"), ("marchirschvogel/ambit", "MIT")
_COBIVECO, _FOAM = ("KIT-IBT/Cobiveco", "Apache-2.0"), ("solids4foam/cardiacFoam", "GPL-3.0")
_GLASGOW, _CISTIB = ("HaoGao/GlasgowHeart", "none named"), ("rbonazzola/CardioMesh", "MIT")
_H5 = "src/pulse/example_meshes"
_LA = "Examples/Example-Biatrial-CT-shape-model/0SurfaceMeshData/LA_1/LA_1"
_BIVME = "example/fitted-models/default/patient1/obj/patient1"

FILES = (
    File(*_DIGITAL, "LV_ED_mean.vtk", "closed boundary of a mean left ventricle", _MESH),
    File(*_DIGITAL, "Both_ED_mean.vtk", "the same beside a right ventricle's cavity", _MESH),
    File(*_DIGITAL, "Both_ED_mean.vtk", "its largest piece", _MESH.replace("{}", "{}#1")),
    File(*_PULSE, f"{_H5}/benchmark.h5", "FEniCS mesh, facets and fibres", "annotate {}"),
    File(*_PULSE, f"{_H5}/biv_ellipsoid.h5", "FEniCS mesh of both ventricles", "annotate {}"),
    File(*_PULSE, f"{_H5}/ellipsoid.h5", "FEniCS mesh, AHA segments and fibres", "annotate {}"),
    File(*_PULSE, f"{_H5}/prolate_ellipsoid.h5", "FEniCS mesh, coarse", "check {}"),
    File(*_PULSE, f"{_H5}/simple_ellipsoid.h5", "FEniCS mesh", "convert {} {out}/lv.vtu"),
    File("finsberg/ldrb", "LGPL-3.0", "demos/mesh.msh", "Gmsh 2.2 with physical groups", "annotate {}"),
    File(*_AMBIT, "demos/solid_flow0d/input/heart3D_domain.xdmf", "XDMF of tetrahedra, inline", "annotate {}"),
    File(*_AMBIT, "demos/solid_flow0d/input/heart3D_boundary.xdmf", "XDMF of triangles, inline", "check {}"),
    File(*_LDRB, "examples/input_ellipsoid/heart.vtu", "tetrahedra of an ellipsoid", "annotate {}"),
    File(*_LDRB, "examples/input_ellipsoid/epi.obj", "open surfaces of it", _OWN % "lv.obj"),
    File(
        *_LDRB,
        "examples/input_coarse/heart.vtp",
        "closed boundary of both ventricles",
        "mesh --surface {} --edge-length 6",
    ),
    File(
        *_COBIVECO, "examples/geo1/heart.vtp", "closed boundary of both ventricles", "mesh --surface {} --edge-length 6"
    ),
    File(
        *_COBIVECO,
        "examples/geo2/heart_epi.ply",
        "three open surfaces, two of them with valves",
        _TWO % ("heart_endo_lv.ply", "heart_endo_rv.ply"),
    ),
    File(*_ATRIA, f"{_LA}.elem", "openCARP triangles of an atrium", "check {}"),
    File(*_ATRIA, f"{_LA}.vtk", "the same as an unstructured grid", "mesh --surface {}"),
    File(
        "UOA-Heart-Mechanics-Research/biv-me",
        "Apache-2.0",
        f"{_BIVME}_EPICARDIAL_000.obj",
        "fitted surfaces of both ventricles with valves",
        _TWO % ("patient1_LV_ENDOCARDIAL_000.obj", "patient1_RV_ENDOCARDIAL_000.obj"),
    ),
    File(
        *_FOAM,
        "frontend/public/base_geometry.ply",
        "five surfaces of a whole heart",
        "mesh --surface {} --edge-length 8",
    ),
    File(*_FOAM, "applications/purkinje_network.msh", "Gmsh 2.2, tetrahedra of a slab", "check {}"),
    File(
        *_CHASTE,
        "heart/test/data/human_wedge_mesh/HumanWedgeMesh.node",
        "tetgen in Chaste's binary variant",
        "check {}",
    ),
    File(*_CHASTE, "heart/test/data/box_shaped_heart/box_heart.node", "tetgen with tabs, a box", "annotate {}"),
    File(
        *_SVFSI, "05-struct/02-LV-Guccione-passive/mesh/P2/mesh-complete.mesh.vtu", "ten-node tetrahedra", "annotate {}"
    ),
    File(*_SVFSI, "05-struct/02-LV-Guccione-passive/mesh/Q1/mesh-complete.mesh.vtu", "hexahedra", "annotate {}"),
    File(*_SVFSI, "06-ustruct/03-LV-Guccione-active/mesh/P1/mesh-complete.mesh.vtu", "tetrahedra", "annotate {}"),
    File(*_SVFSI, "06-ustruct/03-LV-Guccione-active/mesh/P1/mesh-complete.mesh.vtu", "folder of it", "check {folder}"),
    File(
        *_SVFSI,
        "05-struct/02-LV-Guccione-passive/mesh/P2/mesh-surfaces/epi.vtp",
        "faces of a mesh as surfaces",
        _OWN % "endo.vtp",
    ),
    File(
        *_GLASGOW, "LV-MechanicsModel/PCAReconstruction/LVMeshAba.inp", "Abaqus deck, mean of subjects", "annotate {}"
    ),
    File(
        *_GLASGOW,
        "image-processing/manual-segmentation/Results/HV01/early_diastole/LVMeshHex_update.inp",
        "Abaqus deck of hexahedra",
        "annotate {}",
    ),
    File(*_CISTIB, "data/LV_4396_vertices_with_epi_endo.vtk", "left ventricle, unstructured grid", _MESH),
    File(*_CISTIB, "tests/sample_data/legacy_biventricular_model/output.001.vtk", "both ventricles, two pieces", _MESH),
    File(
        "HaoGao/ToFBiVentricle",
        "MIT",
        "research_codes/model_generation/meshRelated/biven_surface.vtk",
        "closed boundary of both ventricles, unstructured grid",
        "mesh --surface {} --edge-length 6",
    ),
    File(
        "chia-seed-111/MADLab_DICOM_Workshop_2025",
        "none named",
        "STL_files/file4_print ready.stl",
        "heart for a 3-D printer",
        _MESH,
    ),
)
#: What a result is told by, of all that a command prints.
_TOLD = re.compile(r"femprep: error: .*|every check passed|failed: .*|\d+ points, [^:]*")
_LONGEST = 420


def main() -> None:
    """Run all commands, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--table", type=Path, help="Markdown file for the table")
    parser.add_argument("--only", default="", help="a part of the repository or path")
    parser.add_argument("--keep", type=Path, help="folder for what the commands write")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for a command")
    given = parser.parse_args()
    rows = ["| repository (licence) | path | what it is | command | result |", "|---|---|---|---|---|"]
    for number, file in enumerate(FILES):
        path = given.folder / file.repository.replace("/", "+") / file.path
        if given.only not in f"{file.repository}/{file.path}":
            continue
        if not path.exists():
            print(f"not there: {path}", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as folder:
            out = (given.keep or Path(folder)) / f"{number:02d}"
            out.mkdir(parents=True, exist_ok=True)
            result = _run(file, path, out, given.limit)
        shown = file.command.format(path.name, folder="FOLDER", out="OUT").replace("FOLDER/", "")
        source = f"[{file.repository}](https://github.com/{file.repository}) ({file.licence})"
        rows.append(f"| {source} | `{file.path}` | {file.what} | `femprep {shown}` | {result} |")
        print(rows[-1], flush=True)
    if given.table:
        given.table.write_text("\n".join([_PAGE, *rows, ""]), encoding="utf-8")


def _run(file: File, path: Path, out: Path, limit: float) -> str:
    words = shlex.split(file.command)
    words = [word.format(path, folder=path.parent, out=out) for word in words]
    if words[0] in ("mesh", "annotate"):
        words += ["-o", str(out / "run")]
    code = "import sys; from femprep.cli import main; sys.exit(main(sys.argv[1:]))"
    try:
        done = subprocess.run(
            [sys.executable, "-c", code, *words],
            capture_output=True,
            text=True,
            timeout=limit,
            check=False,
            env={**os.environ, "COLUMNS": "500"},
            cwd=out,
        )
    except subprocess.TimeoutExpired:
        return f"not done after {limit:.0f} s"
    (out / "screen.txt").write_text(done.stdout + done.stderr, encoding="utf-8")
    told = [line for line in (done.stdout + done.stderr).splitlines() if _TOLD.fullmatch(line.rstrip())]
    text = "; ".join(told).replace(f"{path.parent}/", "").replace("femprep: error: ", "").replace("|", "/")
    text = f"{text[:_LONGEST]}..." if len(text) > _LONGEST else text
    names = ""
    if (mesh := out / "run" / "mesh.vtu").is_file():
        import femprep as fp

        found = fp.read_mesh(mesh)
        names = f"{found.n_cells:,} elements, facets {', '.join(found.facet_names)}; "
    return f"status {done.returncode}: {names}{text}"


_PAGE = """# Files of public repositories

What femprep makes of files that others publish, each with the command that a user would type. Written by
`tests/benchmarks/bench_public_files.py`, which names where each file is published; none of them is part of femprep.
Status 0 is done, 1 done with a failed check, 2 refused with what to do.
"""


if __name__ == "__main__":
    main()
