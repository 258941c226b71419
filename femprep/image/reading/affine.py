"""What a NIfTI header says about voxel sizes, in two places, in; which of the two to take, and what to report, out.

The sizes stand in ``pixdim`` and, as lengths of its columns, in the ``sform`` matrix. They should agree. In all files
of the ACDC challenge the matrix is diag(-1, -1, 1) and only ``pixdim`` has the sizes: nibabel's affine then says 1 mm,
ITK takes ``pixdim``. The reverse, sizes in the matrix only, occurs too. Here the place that carries a size is taken.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.model import FloatArray

#: Relative difference from which two voxel sizes disagree (headers hold single precision, some are rounded).
TOLERANCE = 1e-2
#: Cosine between axes from which they are taken for sheared, as ``Grid`` refuses them.
_SHEARED: Final = 1e-4
#: What is said of an affine that no option can stand in for.
FLAT = "the axes of its affine span no volume, as one is 0 or lies along the others; mend the header"


@dataclass(frozen=True)
class SpacingSource:
    """Voxel sizes and where they come from.

    Attributes
    ----------
    spacing : (3,) array
        mm.
    source : str
        ``"header"`` (both places agree, or the format has one only), ``"pixdim"`` (the affine carries none),
        ``"sform"`` (``pixdim`` carries none).
    note : str or None
        What was found, where it is out of the ordinary.
    doubtful : bool
        Whether the user should look at it.
    """

    spacing: FloatArray
    source: str
    note: str | None = None
    doubtful: bool = False


def choose_spacing(spacing: FloatArray, header: Mapping[str, str]) -> SpacingSource:
    """Decide between the sizes ITK read and those of the sform.

    Parameters
    ----------
    spacing : (3,) array
        What ITK says (from ``pixdim``), mm.
    header : mapping of str to str
        NIfTI fields as ITK gives them (``sform_code``, ``srow_x``, ...); empty for other formats.

    Returns
    -------
    SpacingSource
    """
    lengths = _sform_lengths(header)
    if lengths is None or np.allclose(lengths, spacing, rtol=TOLERANCE, atol=0.0):
        return SpacingSource(spacing, "header")
    found = f"sform says {sizes(lengths)} mm, pixdim {sizes(spacing)} mm"
    if np.allclose(spacing, 1.0, rtol=TOLERANCE):
        note = f"pixdim carries no voxel sizes ({found}); those of the sform were taken"
        return SpacingSource(lengths, "sform", note, doubtful=True)
    if np.allclose(lengths, 1.0, rtol=TOLERANCE):
        note = f"the affine carries no voxel sizes ({found}); those of pixdim were taken"
        return SpacingSource(spacing, "pixdim", note)
    note = f"the header contradicts itself ({found}); pixdim was taken: give spacing if that is wrong"
    return SpacingSource(spacing, "pixdim", note, doubtful=True)


def sform(header: Mapping[str, str]) -> FloatArray | None:
    """The sform ``(3, 4)``, mm LPS, steps along the axes and place of the first voxel; None where there is none."""
    if int(header.get("sform_code", "0") or 0) <= 0:
        return None
    try:
        rows = np.array([[float(x) for x in header[f"srow_{axis}"].split()[:4]] for axis in "xyz"]).reshape(3, 4)
    except (KeyError, ValueError):
        return None
    # Lengths in metres (1) and micrometres (3) as well as mm (2, 0); the low three bits of the field are space.
    unit = {1: 1e3, 3: 1e-3}.get(int(header.get("xyzt_units", "0") or 0) & 7, 1.0)
    return np.asarray(rows * np.array([[-1.0], [-1.0], [1.0]]) * unit, dtype=np.float64)


def sheared_angle(step: FloatArray) -> float | None:
    """Smallest angle between steps along the axes, columns ``(3, 3)``, degrees; None where they are at right angles."""
    if not np.isfinite(step).all() or not np.linalg.det(step):
        return None
    unit = step / np.linalg.norm(step, axis=0)
    cosine = np.abs(unit.T @ unit - np.eye(3)).max()
    return float(np.degrees(np.arccos(cosine))) if cosine >= _SHEARED else None


def _sform_lengths(header: Mapping[str, str]) -> FloatArray | None:
    """Column lengths of the sform in mm, or None where there is no usable one."""
    matrix = sform(header)
    if matrix is None:
        return None
    # ITK hands the matrix over in six digits: what lies beyond them is no voxel size.
    lengths = np.round(np.linalg.norm(matrix[:, :3], axis=0), 5)
    return lengths if np.all(np.isfinite(lengths)) and np.all(lengths > 0.0) else None


def spacing_warning(spacing: FloatArray, shape: tuple[int, ...]) -> str | None:
    """A warning where voxel sizes look absent or are in another unit; None where nothing speaks against them.

    A heart does not fit into 40 mm: a thinner stack at exactly 1 x 1 x 1 mm has lost its sizes.
    """
    if np.allclose(spacing, 1.0, rtol=1e-6) and min(shape) < 40:
        shown = " x ".join(map(str, shape))
        return f"voxel sizes are 1 x 1 x 1 mm for {shown} voxels: they look absent; give spacing if they are wrong"
    if spacing.max() > 50.0 or spacing.min() < 0.02:
        return f"voxel sizes are {sizes(spacing)} mm, unlike any heart image; give spacing if they are wrong"
    return None


def sizes(values: npt.ArrayLike) -> str:
    """Voxel sizes as words have them."""
    return " x ".join(f"{float(v):.4g}" for v in np.asarray(values).ravel())
