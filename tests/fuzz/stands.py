"""The output folder of a run that passed and its label map in; whether it stands for them, by readers not femprep's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista
import SimpleITK as sitk

#: Number of the left cavity in maps of ACDC, which most label maps here have.
_CAVITY = 3
#: Least share of the labelled cavity in that of the mesh: half of it may lie in slices beyond the base, half a slice
#: is cut there, and specks are left out.
_LEAST = 0.4


def little_of_the_labels(arguments: list[str], out: Path) -> str:
    """Words where the left ventricle of a run that passed is a part of the one labelled; empty where it is whole."""
    if arguments[0] != "mesh" or "acdc" not in arguments or "--frame" in arguments:
        return ""
    image = sitk.ReadImage(arguments[1])
    labelled = np.count_nonzero(sitk.GetArrayViewFromImage(image) == _CAVITY) * np.prod(image.GetSpacing())
    share = abs(pyvista.read(out / "cavities" / "lv.vtp").volume) / labelled
    return f"passed with {100.0 * share:.0f} % of the labelled cavity" if share < _LEAST else ""
