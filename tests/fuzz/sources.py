"""Sound inputs, made once, that cases are damaged from: label maps, meshes in every format, surfaces, options."""

from __future__ import annotations

import contextlib
import io
import os
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from meshes import truncated_ellipsoid, with_fibres
from own_shapes import heart
from second_images import ventricle

import femprep as fp
from femprep.errors import OptionError
from femprep.export.table import FORMATS
from femprep.model import Surface
from femprep.phantoms import biventricular, four_chambers, lv_ellipsoid

#: Anatomy of each label map, and the preset that names its labels.
HEARTS = {"lv": "acdc", "biv": "acdc", "whole-heart": "rodero"}

CONFIGURATION = """\
anatomy = "lv"
preset = "acdc"
formats = ["abaqus", "gmsh"]
[image]
policy = "repair"
spacing = [2.5, 2.5, 8.0]
[surface]
vertices = 500
method = "smooth"
[wall]
apex = "closed"
base_offset = 0.0
[volume]
mesher = "sweep"
edge_length = 8.0
[sweep]
element = "tetra"
layers = 2
[check]
minimum_dihedral = 5.0
[export]
length_unit = "mm"
pressure = 1.0
"""


#: Files of meshes as meshio writes them, which others use: name, format, whether tags go along.
FOREIGN = (
    *(("mesh.vtk", "vtk", True), ("mesh.vtu", "vtu", True), ("mesh.xdmf", "xdmf", True), ("mesh.med", "med", True)),
    *(("mesh.mesh", "medit", True), ("mesh.meshb", "medit", True)),
    *(("mesh22.msh", "gmsh22", False), ("mesh.inp", "abaqus", False)),
    ("mesh.node", "tetgen", False),
)


class Sources:
    """Folder of the sound inputs, each made when it is first asked for.

    Parameters
    ----------
    folder : Path
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder

    @cached_property
    def maps(self) -> dict[str, fp.Segmentation]:
        """Label maps by anatomy."""
        return {
            "lv": lv_ellipsoid().segmentation((2.5, 2.5, 8.0)),
            "biv": biventricular().segmentation((2.5, 2.5, 8.0)),
            "whole-heart": four_chambers().segmentation((3.0, 3.0, 3.0)),
        }

    @cached_property
    def patients(self) -> list[Path]:
        """Label maps of the ACDC data, below the folder that the variable ``FEMPREP_DATA`` names."""
        return sorted(Path(os.environ["FEMPREP_DATA"]).glob("acdc/training/*/*_gt.nii.gz"))

    @cached_property
    def meshes(self) -> list[Path]:
        """A file, or folder, of each format of femprep, of three kinds of elements."""
        written = []
        for kind in ("tetra", "hexahedron", "tetra10"):
            mesh = with_fibres(truncated_ellipsoid(kind, heights=3, around=8, layers=1))
            for name in sorted(FORMATS):
                place = self._place("meshes", kind, name)
                try:
                    path = place / Path(FORMATS[name].filename).name
                    fp.write_mesh(mesh, path, format=name)
                except OptionError:  # this format has no such elements
                    continue
                written.append(path)
        return written

    @cached_property
    def hearts(self) -> list[Path]:
        """Ventricles with coordinates, segments and fibres, with names and without, in the formats that hold them."""
        written = []
        for kind in ("tetra", "hexahedron"):
            mesh = ventricle(kind, 3, 2)
            bare = replace(mesh, facets={}, facet_tag=np.empty(0, dtype=np.int32), facet_data={}, planes={}, info={})
            for name, own in (("heart.vtu", mesh), ("heart.med", mesh), ("heart.msh", mesh), ("bare.vtu", bare)):
                path = self._place("hearts", kind, name.replace(".", "-")) / name
                fp.write_mesh(own, path)
                written.append(path)
        return written

    @cached_property
    def foreign(self) -> list[Path]:
        """The same mesh as other programs' formats have it, written by meshio."""
        import meshio

        mesh = truncated_ellipsoid("tetra", heights=3, around=8, layers=1)
        whole = mesh.to_meshio()
        plain = meshio.Mesh(np.round(mesh.points, 3), list(mesh.cells.items()))
        written = []
        for name, format, tags in FOREIGN:
            path = self._place("foreign", name.replace(".", "-")) / name
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                meshio.write(path, whole if tags else plain, format)
            written.append(path)
        return written

    @cached_property
    def swept(self) -> Path:
        """A mesh that says that it was swept."""
        mesh = truncated_ellipsoid("tetra", heights=3, around=8, layers=1)
        info = {"mesher": "sweep", "template": "triangle", "columns": 10, "rows": 6, "layers": 2}
        path = self._place("swept") / "mesh.vtu"
        fp.write_mesh(replace(mesh, info=info), path)
        return path

    @cached_property
    def sizing(self) -> list[Path]:
        """Fields of edge lengths."""
        import pyvista

        image = pyvista.ImageData(dimensions=(5, 5, 5), spacing=(40.0, 40.0, 40.0), origin=(-80.0, -80.0, -80.0))
        image.point_data["edge_length"] = np.full(image.n_points, 8.0)
        grid = image.cast_to_unstructured_grid()
        written = []
        for name, data in (("field.vtk", grid), ("field.vtu", grid), ("field.vti", image)):
            path = self._place("sizing", name.replace(".", "-")) / name
            data.save(path)
            written.append(path)
        return written

    @cached_property
    def walls(self) -> dict[str, Surface]:
        """Endocardium and epicardium of the phantom, closed."""
        return heart(200)

    @cached_property
    def surfaces(self) -> list[Path]:
        """A ball in each format of surfaces."""
        import pyvista

        folder = self._place("surfaces")
        ball = pyvista.Icosphere(radius=30.0, nsub=2)
        written = []
        for ending in (".vtp", ".stl", ".ply", ".vtk"):
            path = folder / f"ball{ending}"
            ball.save(path)
            written.append(path)
        faces = ball.faces.reshape(-1, 4)[:, 1:]
        rows = [f"v {x} {y} {z}" for x, y, z in ball.points] + [f"f {a} {b} {c}" for a, b, c in faces + 1]
        (folder / "ball.obj").write_text("\n".join(rows))
        rows = [f"{x} {y} {z}" for x, y, z in ball.points] + [f"3 {a} {b} {c}" for a, b, c in faces]
        (folder / "ball.off").write_text("\n".join([f"OFF\n{ball.n_points} {len(faces)} 0", *rows]))
        return [*written, folder / "ball.obj", folder / "ball.off"]

    def _place(self, *parts: str) -> Path:
        folder = self.folder.joinpath(*parts)
        folder.mkdir(parents=True, exist_ok=True)
        return folder
