"""Structures of known data sets."""

from __future__ import annotations

#: Label numbers by structure name, by the name of a data set.
PRESETS: dict[str, dict[str, tuple[int, ...]]] = {
    "acdc": {"rv": (1,), "myo": (2,), "lv": (3,)},
    # UK Biobank short axis, as ukbb_cardiac labels it (Bai et al. 2018, doi:10.1186/s12968-018-0471-x).
    "ukb": {"lv": (1,), "myo": (2,), "rv": (3,)},
    # M&Ms challenge (Campello et al. 2021, doi:10.1109/TMI.2021.3090082).
    "mnms": {"lv": (1,), "myo": (2,), "rv": (3,)},
    # Task heartchambers_highres of TotalSegmentator, one label map (Wasserthal et al. 2023, doi:10.1148/ryai.230024).
    "totalsegmentator": {"myo": (1,), "la": (2,), "lv": (3,), "ra": (4,), "rv": (5,)},
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
