"""A Segmentation in, the same with its heart's own axes out, by which templates are turned."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Final

import numpy as np

from femprep.anatomy.axes.landmarks import axes_from_labels, require_end
from femprep.errors import InputError
from femprep.image import Segmentation
from femprep.model import Notice, noted
from femprep.model.products import inverse, nearest_orthogonal, product

_log = logging.getLogger(__name__)

#: Decimals of the axes that are kept.
_DECIMALS: Final = 12


def orient(seg: Segmentation, *, basal_end: str = "auto") -> Segmentation:
    """Give a segmentation its heart's own axes, so that vertex i of a surface lies at the same place in every heart.

    The template's z axis then points along the long axis to the base, its x axis across it to the right ventricle (to
    where that usually lies, where the labels have none): end-diastole and end-systole, and other patients, share the
    place of each vertex as far as their shapes do. The hearts' hand is not told: the template of a mirrored heart is
    turned, not mirrored.

    Parameters
    ----------
    seg : Segmentation
        With ``lv``, ``myo`` and, where it has one, ``rv``.
    basal_end : {"auto", "first", "last"}
        Which end of a stack of slices is basal.

    Returns
    -------
    Segmentation
        With ``frame``, which its objects take over; as it was where the axes cannot be told (another structure, one
        slice only). ``info["orientation"]`` says which.

    Raises
    ------
    InputError
        ``basal_end`` is none of these words.

    Examples
    --------
    >>> fp.orient(seg).frame.shape
    (3, 3)
    """
    require_end(basal_end)
    try:
        axes = axes_from_labels(seg, basal_end=basal_end)
    except InputError as error:
        _log.info("templates follow the image's axes: %s", error)
        words = f"vertices are numbered along the image's axes, not the heart's own, which cannot be told: {error}"
        record = noted({"source": "image", "reason": str(error)}, Notice.of("assumed", words))
        return replace(seg, frame=None, info={**seg.info, "orientation": record})
    up, side = axes.long_axis, axes.septal
    # Digits that differ between processors' linear algebra are not of the heart, nor is how its image lies.
    found, image = np.column_stack([side, np.cross(up, side), up]), np.asarray(seg.grid.direction)
    frame = nearest_orthogonal(product(image, np.round(product(inverse(image), found), _DECIMALS)))
    assert frame is not None, "axes at right angles are not flat"
    record = {"source": "labels", "assumed": list(axes.info.get("assumed", ())), "frame": frame.tolist()}
    if "septal" in record["assumed"]:
        words = (
            "the labels have no right ventricle: vertices are numbered as if it lay where it usually does in a patient"
        )
        record = noted(record, Notice.of("assumed", words))
    return replace(seg, frame=frame, info={**seg.info, "orientation": record})
