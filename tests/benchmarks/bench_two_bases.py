"""Both ventricles whose right one ends below the left one's base: cavity volumes against the labels, and the checks.

    python tests/benchmarks/bench_two_bases.py --list            which of ACDC's 200 maps they are (FEMPREP_DATA)
    python tests/benchmarks/bench_two_bases.py --every 8 --edge-length 3
    python tests/benchmarks/bench_two_bases.py --walls              cavities of the wall, not meshed: 10 s a map

Printed for each map are how far the right base lies below the left one, the volumes of both cavities of the mesh and of
their labels below each base, the left cavity that a common base would leave, and what the checks said.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import femprep as fp
from femprep.mesh.topology import enclosed_volume
from femprep.model import FACET_TAGS
from femprep.model.stages import Stages
from femprep.pipeline import begin
from femprep.report.volumes import labelled_volume
from femprep.stages.fill import joined_wall
from femprep.wall.anatomies import ANATOMIES
from femprep.wall.planes.common_base import separate_bases


def maps() -> list[Path]:
    """The maps of which the right ventricle has a base of its own."""
    found = []
    for path in sorted(Path(os.environ["FEMPREP_DATA"]).glob("acdc/training/*/*_gt.nii.gz")):
        seg = fp.orient(fp.read_segmentation(path, preset="acdc"))
        try:
            if separate_bases(seg, fp.WallOptions())[1] is not None:
                found.append(path)
        except fp.FemprepError:
            continue
    return found


def row(path: Path, edge_length: float) -> str:
    """What becomes of one map."""
    seg = fp.orient(fp.read_segmentation(path, preset="acdc"))
    name = path.name.removesuffix("_gt.nii.gz")
    left, common = fp.find_base(seg), fp.find_common_base(seg)
    whole, less = (labelled_volume(seg, "lv", [plane]) / 1000.0 for plane in (left, common))
    head = f"{name}: right base {-left.signed_distance(common.point[None])[0]:.0f} mm lower"
    head += f", a common one leaves {less:.1f} of {whole:.1f} mL"
    try:
        run = fp.mesh_segmentation(seg, anatomy="biv", volume={"edge_length": edge_length})
    except fp.FemprepError as error:
        return f"{head}; refused: {error}"
    volumes = "; ".join(
        f"{item.name} {item.mesh_ml:.1f} of {item.segmentation_ml:.1f} mL ({item.difference_percent:+.2f} %)"
        for item in run.volumes
        if "cavity" in item.name
    )
    return f"{head}; {volumes}; {'passed' if run.quality.passed else 'failed: ' + '; '.join(run.quality.failures)}"


def wall_row(path: Path) -> str:
    """Cavity volumes of the wall of one map against its labels."""
    options = fp.Options(anatomy="biv")
    seg, layout, _ = begin(fp.read_segmentation(path, preset="acdc"), options, Stages(None))
    head = path.name.removesuffix("_gt.nii.gz")
    try:
        wall = joined_wall(ANATOMIES["biv"](seg, layout, options, Stages(None)), options, Stages(None))
    except fp.FemprepError as error:
        return f"{head}: no wall: {error}"
    found = []
    for name, base in (("lv", "base"), ("rv", "base_rv")):
        facets = wall.triangles[wall.facet_tag == FACET_TAGS[f"endo_{name}"]]
        made = enclosed_volume(wall.points, facets[:, ::-1])
        labels = labelled_volume(seg, name, [wall.planes[base]])
        found.append(f"{name} {made / 1e3:.1f} of {labels / 1e3:.1f} mL ({100.0 * (made / labels - 1.0):+.2f} %)")
    return f"{head}: {'; '.join(found)}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--maps", nargs="*", default=[], help="only these, as patient001_frame12")
    parser.add_argument("--walls", action="store_true", help="build the walls, do not mesh them")
    parser.add_argument("--every", type=int, default=1, help="take one in so many")
    parser.add_argument("--from", dest="first", type=int, default=0, help="leave out so many of them")
    parser.add_argument("--edge-length", type=float, default=3.0)
    given = parser.parse_args()
    found = [path for path in maps() if not given.maps or path.name.removesuffix("_gt.nii.gz") in given.maps]
    print(f"{len(found)} maps", flush=True)
    for path in found[given.first :: given.every]:
        line = path.name if given.list else wall_row(path) if given.walls else row(path, given.edge_length)
        print(line, flush=True)


if __name__ == "__main__":
    main()
