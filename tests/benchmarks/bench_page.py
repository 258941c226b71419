"""The page of a mesh of many elements: its size, how long it takes to write, and what a browser shows of it.

    python tests/benchmarks/bench_page.py                          100,000, 200,000 and a million tetrahedra
    python tests/benchmarks/bench_page.py --elements 1000000 --kind hexahedron --keep pages

The heart is a small swept phantom; its mesh is replaced by a wall of as many elements, with AHA segments and fibres.
For each page: elements, size in MB, seconds to make the view and to write the folder, seconds until the browser shows
the view, non-white pixels of it (whole, and cut along the long axis), entries of "Colour by", and errors on the
console. Needs Chromium and Playwright.
"""

from __future__ import annotations

import argparse
import io
import shutil
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import browser
from meshes import truncated_ellipsoid, with_fibres
from rows import shown as line

import femprep as fp
from femprep.phantoms import lv_ellipsoid
from femprep.report import output

#: Elements of the wall through its thickness, and how many come of one brick, by kind.
_LAYERS, _PARTS = 8, {"tetra": 6, "wedge": 2, "hexahedron": 1}


def wall(kind: str, elements: int) -> fp.VolumeMesh:
    """A wall of about so many elements, with segments and fibres."""
    around = round((elements / (0.4 * _LAYERS * _PARTS[kind])) ** 0.5)
    mesh = truncated_ellipsoid(kind, heights=round(0.4 * around), around=around, layers=_LAYERS)
    block = mesh.cells[kind]
    centre = mesh.points[block].mean(axis=1)
    turn = np.floor((np.arctan2(centre[:, 1], centre[:, 0]) / (2.0 * np.pi) + 0.5) * 6.0).clip(0, 5)
    level = np.searchsorted([-24.0, -6.0], centre[:, 2])
    return with_fibres(mesh).with_data(cell={"aha": (1 + turn + 6 * (2 - level)).clip(1, 17).astype(np.int64)})


def coloured(picture: bytes) -> int:
    """Pixels of a picture that are not white."""
    from PIL import Image

    return int((np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")) < 250).any(axis=2).sum())


def looked_at(page: Path, keep: Path | None) -> dict[str, object]:
    """What a browser shows of a page."""
    found: dict[str, object] = {}
    start = time.perf_counter()
    with browser.watched(page) as (tab, wrong):
        try:
            tab.wait_for_function("window.femprepView && window.femprepView.state.shown > 0", timeout=60_000)
        except Exception:
            found["shown"] = "nothing"
        found["seconds"] = time.perf_counter() - start
        for cut in ("-1", "0"):
            start = time.perf_counter()
            tab.select_option("#cut", cut)
            picture = tab.locator("#viewer").screenshot()
            name = "whole" if cut == "-1" else "cut"
            found |= {name: coloured(picture), f"{name}_s": time.perf_counter() - start}
            if keep:
                (keep / f"{page.parent.name}-{name}.png").write_bytes(picture)
        found["colour_by"] = tab.locator("#colour option").count()
        found["errors"] = len(wrong)
    for error in wrong:
        print(f"  {error}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elements", nargs="+", type=int, default=[100_000, 200_000, 1_000_000])
    parser.add_argument("--kind", choices=_PARTS, default="tetra")
    parser.add_argument("--keep", type=Path, help="keep pages and pictures in this folder")
    given = parser.parse_args()
    seg = lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0))
    options = {"surface": {"vertices": 300}, "volume": {"mesher": "sweep", "edge_length": 6.0}, "fibres": {}}
    run = fp.mesh_segmentation(seg, **options)
    for elements in given.elements:
        mesh = wall(given.kind, elements)
        run = replace(run, mesh=mesh, quality=fp.check(mesh))
        start = time.perf_counter()
        output.scene(output.shown(mesh), run.quality)
        view = time.perf_counter() - start
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            out = Path(folder) / f"{given.kind}-{mesh.n_cells}"
            fp.write_run(run, out)
            whole = time.perf_counter() - start
            size = (out / "report.html").stat().st_size / 1e6
            if given.keep:
                given.keep.mkdir(exist_ok=True)
                shutil.copy(out / "report.html", given.keep / f"{out.name}.html")
            row = {"elements": mesh.n_cells, "page_MB": size, "view_s": view, "folder_s": whole}
            print(line(row | looked_at(out / "report.html", given.keep)), flush=True)


if __name__ == "__main__":
    main()
