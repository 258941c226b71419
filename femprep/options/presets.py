"""Structures of known data sets."""

from __future__ import annotations

#: Label numbers by structure name, by the name of a data set.
PRESETS: dict[str, dict[str, tuple[int, ...]]] = {
    "acdc": {"rv": (1,), "myo": (2,), "lv": (3,)},
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
