"""Structures of known data sets."""

from __future__ import annotations

from collections.abc import Collection

#: Label numbers by structure name, by the name of a data set.
PRESETS: dict[str, dict[str, tuple[int, ...]]] = {
    "acdc": {"rv": (1,), "myo": (2,), "lv": (3,)},
    # UK Biobank short axis, as ukbb_cardiac labels it (Bai et al. 2018, doi:10.1186/s12968-018-0471-x).
    "ukb": {"lv": (1,), "myo": (2,), "rv": (3,)},
    # M&Ms challenge (Campello et al. 2021, doi:10.1109/TMI.2021.3090082).
    "mnms": {"lv": (1,), "myo": (2,), "rv": (3,)},
    # M&Ms-2, short and long axis (Martin-Isla et al. 2023, doi:10.1109/JBHI.2023.3267857).
    "mnms2": {"lv": (1,), "myo": (2,), "rv": (3,)},
    # EMIDEC: infarct and no-reflow are parts of the myocardium (Lalande et al. 2020, doi:10.3390/data5040089).
    "emidec": {"lv": (1,), "myo": (2, 3, 4), "scar": (3,), "no_reflow": (4,)},
    # MyoPS 2020: so are oedema and scar (Li et al. 2023, doi:10.1016/j.media.2023.102808).
    "myops": {"lv": (500,), "myo": (200, 1220, 2221), "rv": (600,), "edema": (1220,), "scar": (2221,)},
    # High-resolution maps of the Digital Heart project (Bai et al. 2015, doi:10.1016/j.media.2015.08.009).
    "digital-heart": {"lv": (1,), "myo": (2,), "rv": (4,)},
    # NIfTI that Segment exports of its contours (Heiberg et al. 2010, doi:10.1186/1471-2342-10-1).
    "segment": {"lv": (85,), "rv": (170,), "myo": (255,)},
    # Short-axis maps of biv-me (github.com/UOA-Heart-Mechanics-Research/biv-me).
    "biv-me": {"lv": (1,), "myo": (2,), "rv": (3,), "rv_wall": (4,)},
    # Task heartchambers_highres of TotalSegmentator, one label map (Wasserthal et al. 2023, doi:10.1148/ryai.230024).
    "totalsegmentator": {
        "myo": (1,),
        "la": (2,),
        "lv": (3,),
        "ra": (4,),
        "rv": (5,),
        "aorta": (6,),
        "pulmonary_artery": (7,),
    },
    # MM-WHS challenge (Zhuang et al. 2019, doi:10.1016/j.media.2019.101537).
    "mmwhs": {"lv": (500,), "myo": (205,), "rv": (600,), "la": (420,), "ra": (550,)},
    # Segments of a .seg.nrrd by their usual names: femprep/image/reading/segments.py.
    "slicer": {},
    "rodero": {
        "lv": (1,),
        "myo": (2,),
        "rv": (3,),
        "rv_wall": (4,),
        "la": (5,),
        "la_wall": (6,),
        "ra": (7,),
        "ra_wall": (8,),
        "aorta_wall": (9,),
        "pulmonary_artery_wall": (10,),
    },
}


def likely_preset(present: Collection[int]) -> str:
    """The presets whose labels explain a map best, as ``"; did you mean --preset acdc?"``; empty where none does."""
    more: dict[str, int] = {}
    for name, own in PRESETS.items():
        known = {number for numbers in own.values() for number in numbers}
        if known >= set(present) >= {*own.get("lv", (0,)), *own.get("myo", ())[:1]}:
            more[name] = len(known) - len(present)
    fits = [name for name, number in more.items() if number == min(more.values())]
    return f"; did you mean --preset {' or '.join(fits)}?" if fits else ""
