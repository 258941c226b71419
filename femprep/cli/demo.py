"""``femprep demo``: the main job on a built-in phantom heart, no data needed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def demo(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to make.")] = Path("demo"),
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print run and quality records as JSON.")] = False,
) -> int:
    """Mesh a phantom left ventricle, the whole way, in about a minute.

    The phantom is a label map with voxels of 1.4 x 1.4 x 8 mm. Makes the same folder as ``femprep mesh``.
    """
    import tempfile

    from femprep.cli._mesh_runs import mesh_file
    from femprep.image import write_segmentation
    from femprep.options import Options
    from femprep.phantoms import lv_ellipsoid

    options = Options(preset="acdc", formats=("abaqus", "dolfinx", "gmsh"))
    with tempfile.TemporaryDirectory(prefix="femprep-demo-") as folder:
        path = Path(folder) / "phantom.nii.gz"
        write_segmentation(lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0)), path)
        return mesh_file(path, out, options, quiet=quiet, json=json)
