"""Sound inputs, made once, that cases are damaged from: label maps, meshes in every format, surfaces, options."""

from __future__ import annotations

from pathlib import Path

from meshes import truncated_ellipsoid, with_fibres

import femprep as fp
from femprep.errors import OptionError
from femprep.export.table import FORMATS
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


class Sources:
    """Folder of the sound inputs.

    Attributes
    ----------
    maps : dict of str to Segmentation
        By anatomy.
    meshes, surfaces : list of Path
        A file, or folder, of each format.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.maps = {
            "lv": lv_ellipsoid().segmentation((2.5, 2.5, 8.0)),
            "biv": biventricular().segmentation((2.5, 2.5, 8.0)),
            "whole-heart": four_chambers().segmentation((3.0, 3.0, 3.0)),
        }
        self.meshes = self._write_meshes(folder / "meshes")
        self.surfaces = self._write_surfaces(folder / "surfaces")

    @staticmethod
    def _write_meshes(folder: Path) -> list[Path]:
        written = []
        for kind in ("tetra", "hexahedron", "tetra10"):
            mesh = with_fibres(truncated_ellipsoid(kind, heights=3, around=8, layers=1))
            for name in sorted(FORMATS):
                place = folder / kind / name
                place.mkdir(parents=True, exist_ok=True)
                try:
                    path = place / Path(FORMATS[name].filename).name
                    fp.write_mesh(mesh, path, format=name)
                except OptionError:  # this format has no such elements
                    continue
                written.append(path)
        return written

    @staticmethod
    def _write_surfaces(folder: Path) -> list[Path]:
        import pyvista

        folder.mkdir(exist_ok=True)
        ball = pyvista.Icosphere(radius=30.0, nsub=2)
        written = []
        for ending in (".vtp", ".stl", ".ply", ".vtk"):
            path = folder / f"ball{ending}"
            ball.save(path)
            written.append(path)
        faces = ball.faces.reshape(-1, 4)[:, 1:]
        rows = [f"v {x} {y} {z}" for x, y, z in ball.points] + [f"f {a} {b} {c}" for a, b, c in faces + 1]
        (folder / "ball.obj").write_text("\n".join(rows))
        return [*written, folder / "ball.obj"]
