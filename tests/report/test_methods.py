"""The words for a paper say what was done to this heart, no more and no less, and cite what they rest on."""

from __future__ import annotations

import re
from typing import Any

import pytest
from meshes import truncated_ellipsoid

from femprep.model.shared_records.surface_fidelity import SurfaceFidelity
from femprep.options import Options
from femprep.report.manifest import (
    InputRecord,
    PhaseRecord,
    RunManifest,
    SequenceManifest,
    SurfaceInput,
    VolumeRecord,
)
from femprep.report.methods import Words, methods, sequence_methods
from femprep.report.methods.bibliography import REFERENCES, bibtex
from femprep.volume import check

OPEN_APEX = {"mode": "closed", "extrapolated": True, "extrapolated_mm": 8.4, "uncapped_share": 1.0}
#: Objects that surfaces were fitted to, by anatomy.
OBJECTS = {
    "lv": ("lv", "epi"),
    "biv": ("lv", "rv", "lv_epi"),
    "whole-heart": ("lv", "rv", "la", "ra", "lv_epi", "rv_epi", "la_epi"),
}


def manifest(options: dict[str, Any], wall: dict[str, Any] | None = None, **volume: Any) -> RunManifest:
    """The record of a run that was never made."""
    chosen = Options(**options)
    made = {"method": chosen.surface.method, "vertices": 1500, "cells": chosen.surface.cells}
    objects = OBJECTS[chosen.anatomy]
    return RunManifest(
        input=InputRecord(
            shape=(200, 200, 12),
            spacing_mm=(1.5, 1.5, 8.0),
            structures={"lv": [3]},
            notes={"slice_shifts": {"slices": [{"shift": [3.0, 4.0]}]}} if chosen.image.correct_shifts else {},
        ),
        options=chosen,
        stages=[],
        details={
            "objects": {name: {} for name in objects},
            "surfaces": dict.fromkeys(objects, made),
            "wall": wall or {},
            "volume": volume,
        },
        deterministic=True,
    )


def text(options: dict[str, Any], wall: dict[str, Any] | None = None, **volume: Any) -> str:
    return methods(manifest(options, wall, **volume)).plain


SWEPT = {"volume": {"mesher": "sweep"}}
FIBRES = {"fibres": {}}
HAND = {"axes": {"mirrored": None, "info": {"assumed": ["septal", "hand"]}}, "fibres": {"mirrored": False}}
HOLE = {"name": "mitral", "between": ["lv", "la"], "radius_mm": 9.3, "source": "labels"}
BASE = {"planes": {"base": {"notices": [{"amount": 10.0}]}}}
RECORDS = [
    {"beside": "lv", "farthest_push_mm": 2.25},
    {"between": ["lv", "rv"], "farthest_push_mm": 1.5},
    {"thickened": "la"},
    {"filled": "grooves"},
    {"surface": "rv", "farthest_off_the_fit_mm": 0.75},
]
MATCHING = {"matching": {"pushed": {"vertices": 3, "maximum_mm": 1.25, "least_mm": 1.0}, "softened_mm": 0.6}}

BEAT = {"fibres": {}, "pericardium": {"stiffness": 2.0}, "purkinje": {}, "activation": {}}

#: Options, wall, volume; what is said, what is not.
CASES: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any], list[str], list[str]]] = {
    "pericardium, Purkinje fibres, activation": (
        *(BEAT, {"apex": OPEN_APEX}, {}),
        [
            "2 kPa/mm at the apex",
            "10.1016/j.jbiomech.2020.109645",
            "Sahli Costabal",
            "0.67, 0.3 and 0.17 m/s",
            "Caldwell",
        ],
        ["all nodes of the endocardia"],
    ),
    "activation alone, its own speeds, fibres failed": (
        *({"fibres": {}, "pericardium": {}, "activation": {"fibre_speed": 0.5}}, {"apex": OPEN_APEX}),
        {"verdict": {"failures": {"fibres": ["fibres: not made: x"]}}},
        ["all nodes of the endocardia at once", "0.5, 0.3 and 0.17 m/s"],
        ["Strocchi", "Caldwell", "Purkinje", "helix"],
    ),
    "outflow tracts": (
        *({"anatomy": "whole-heart", "fibres": {"rule": "doste"}}, {}, {}),
        ["Doste et al. 2019", "10.1002/cnm.3185", "from +90 to -25"],
        ["interpolated first"],
    ),
    "atria": (
        *({"anatomy": "whole-heart", "wall": {"openings": "labels"}, "fibres": {"atria": "piersanti"}}, {}),
        {"atria": {}},
        ["Piersanti et al. 2021", "Fibres of the atria"],
        ["Doste"],
    ),
    "lv, tetwild": (
        *({}, {"apex": OPEN_APEX}, {}),
        [
            "wall of the left ventricle",
            "cut at the base",
            "by a dome",
            "8.4 mm",
            "Hu et al. 2020",
            "manifold3d",
        ],
        [
            "layers",
            "right ventricle",
            "valves",
            "Fibres",
            "assumed",
            "mirror",
            "harmonic field",
            "pushed",
            "cut into eight",
        ],
    ),
    "lv, refined": (
        *({}, {"apex": OPEN_APEX}, {"refinement": {"levels": 1}}),
        ["tetrahedra of 5 mm by fTetWild", "cut into eight once", "Bey 1995", "to edges of 2.5 mm"],
        ["times"],
    ),
    "lv, closed by the labels": (
        {},
        {"apex": {"extrapolated_mm": 0.0}},
        {},
        ["closed as in the labels"],
        ["extrapolated"],
    ),
    "lv, clipped": (
        *({"wall": {"apex": "clipped"}}, {"apex": {"extrapolated_mm": 0.0}}, {}),
        ["and at the apex in the plane of the most apical slice", "Skrinjar and Bistoquet 2009"],
        ["extrapolated", "closed as"],
    ),
    "lv, sweep": (
        *(SWEPT, {"apex": OPEN_APEX}, {"element": "wedge", "layers": 3, "mended": {"moved": 4}}),
        ["3 layers of wedges", "Knupp 2001", "Escobar et al. 2003", "extrapolated", "moved within the wall"],
        ["fTetWild", "Boolean", "tetrahedra"],
    ),
    "sweep, mended": (
        SWEPT,
        MATCHING,
        {},
        ["pushed outwards, by up to 1.2 mm", "locally smoothed, by up to 0.6 mm"],
        ["folded."],
    ),
    "biv": (
        *({"anatomy": "biv"}, {"apex": OPEN_APEX, **BASE, "repaired": RECORDS}, {}),
        [
            *("wall of both ventricles", "and the right ventricle is open", "10.0 mm nearer to the apex"),
            *(
                "cavity of the right ventricle grown by 3 mm",
                "no wall of the right ventricle: its thickness was assumed",
            ),
            *("smooth minimum", "pushed outwards, by up to 2.2 mm", "pushed apart, by up to 1.5 mm", "(of la)"),
            *("grooves of the epicardium were filled", "smoothed, by up to 0.8 mm"),
        ],
        ["valves", "atrium", "layers"],
    ),
    "biv, blood": (
        {"anatomy": "biv", "blood_pool": True},
        {},
        {},
        ["The blood in the cavities", "share their nodes"],
        [],
    ),
    "whole heart": (
        *({"anatomy": "whole-heart"}, {}, {}),
        [
            *("walls of the four chambers", "not cut by a plane", "valves and openings of vessels by tissue"),
            *("right ventricle with its labelled wall", "cavity of the right atrium grown by 2 mm"),
        ],
        ["at the base", "at the apex", "closed ring", "wall of the right ventricle:"],
    ),
    "whole heart, open": (
        *({"anatomy": "whole-heart", "wall": {"openings": "labels"}}, {"openings": [HOLE]}, {}),
        ["cut as round holes where the labels show them: mitral (lv, radius 9.3 mm)"],
        ["at the base", "planes were given"],
    ),
    "fibres": (
        *({**FIBRES, "anatomy": "biv", "fibres": {"rv_endo_angle": 25.0}}, {}, {}),
        [
            *("Bayer et al. 2012", "Schuler et al. 2021", "Cerqueira et al. 2002", "Streeter et al. 1969"),
            *("+60 degrees at the endocardium to -60 at the epicardium", "from +25 to -60", "linear in depth"),
        ],
        ["as printed", "mirror", "sheet angle"],
    ),
    "fibres as printed": (
        *(
            {"fibres": {"rule": "bayer", "depth": "laplace", "endo_sheet_angle": -65.0, "epi_sheet_angle": 25.0}},
            {},
            {},
        ),
        ["as printed", "depth is the harmonic field itself", "from -65 to +25 degrees"],
        ["linear in depth"],
    ),
    "fibres of a mirrored heart": (
        *(FIBRES, {}, {"axes": {"mirrored": True, "info": {}}, "fibres": {"mirrored": True}}),
        ["recognised as a mirror image"],
        ["assumed not to be"],
    ),
    "fibres, nothing told": (FIBRES, {}, HAND, ["assumed not to be one", "does not show the septum"], ["recognised"]),
    "flipped": ({"flip": True}, {}, {}, ["The label map was mirrored first"], []),
    "shifts": (
        *({"image": {"correct_shifts": True}}, {}, {}),
        ["moved back in their planes by up to 5.0 mm", "Lange et al. 1989"],
        ["none were found"],
    ),
    "paper": (
        {"surface": {"method": "paper"}},
        {},
        {},
        ["along the gradient of a harmonic field"],
        ["MacKay", "conformal"],
    ),
    "even": ({"surface": {"method": "even"}}, {}, {}, ["until its cells are even", "Kazhdan et al. 2012"], ["MacKay"]),
    "by thickness": (
        *({"volume": {"elements_through_wall": 4}}, {}, {}),
        ["follows the wall's thickness, for 4 of them through it"],
        ["of 2.5 mm"],
    ),
    "quadratic": ({"volume": {"order": 2, "optimise": False}}, {}, {}, ["Mid-side nodes of ten-node"], ["Freitag"]),
    "given base": (
        {"wall": {"base": (0.0, 0.0, 9.0, 0.0, 0.0, 1.0)}},
        {"planes": {"base": {"source": "given"}}},
        {},
        ["cut at the base in a given plane"],
        ["most basal slice"],
    ),
    "inflation": (
        {"formats": ("abaqus",), "export": {"step": "inflation", "material": "neo-hookean", "pressure": 1.5}},
        {},
        {},
        ["written into the input files", "pressure of 1.5 kPa", "neo-Hookean", "modulus of 30 kPa"],
        ["CalculiX"],
    ),
    "offset": ({"wall": {"base_offset": 3.0}}, {}, {}, ["That plane was moved by 3.0 mm"], ["nearer to the apex than"]),
}


@pytest.mark.parametrize("case", CASES)
def test_what_is_said_and_what_is_not(case: str) -> None:
    options, wall, volume, said, unsaid = CASES[case]
    found = text(options, wall, **volume)
    for words in said:
        assert words in found, f"{words!r} is missing in: {found}"
    for words in unsaid:
        assert words not in found, f"{words!r} is in: {found}"
    assert "{" not in found
    assert "@" not in found


def entries(bib: str) -> dict[str, dict[str, str]]:
    """Entries of a BibTeX file, by key: a reader of the plain form we write, which fails where braces do not match."""
    found = {}
    for entry in re.split(r"\n(?=@)", bib.strip()):
        head, *lines, tail = entry.strip().splitlines()
        kind, key = re.fullmatch(r"@(\w+)\{(\w+),", head).groups()
        assert tail == "}"
        fields = dict(re.fullmatch(r"  (\w+) = \{(.*)\},", line).groups() for line in lines)
        assert all(value.count("{") == value.count("}") for value in fields.values())
        found[key] = {"kind": kind, **fields}
    return found


@pytest.mark.parametrize("case", CASES)
def test_every_reference_is_in_the_file_and_nothing_else(case: str) -> None:
    options, wall, volume, *_ = CASES[case]
    words = methods(manifest(options, wall, **volume))
    cited = set(re.findall(r"@(\w+)", words.markdown))
    assert cited == set(entries(words.bibtex)) == set(words.keys)
    assert cited <= set(REFERENCES)


def test_references_are_whole() -> None:
    found = entries(bibtex(REFERENCES))
    assert set(found) == set(REFERENCES)
    for key, fields in found.items():
        assert fields["author"], key
        assert fields["title"], key
        assert re.fullmatch(r"10\.\d{4,}/\S+", fields["doi"]) if "doi" in fields else fields["howpublished"], key
        year = re.search(r"\d{4}$", REFERENCES[key].short)
        assert (year[0] if year else None) == fields.get("year"), key
        assert not year or year[0] in key


def test_surfaces_of_both_ventricles_are_named_by_what_they_are() -> None:
    record = manifest({"anatomy": "biv"}, {"planes": {"base": {"source": "given"}}})
    far = {"method": "given", "vertices": 500, "distance_mean_mm": 0.125, "distance_greatest_mm": 1.5}
    names = ("lv", "rv", "epi")
    given = InputRecord(surfaces=[SurfaceInput(name=name, unit="mm", points=9, triangles=14) for name in names])
    lies = {"mean_mm": 0.11, "p95_mm": 0.2, "greatest_mm": 1.25, "at_mm": (0.0, 0.0, 0.0)}
    record = record.model_copy(
        update={
            "input": given,
            "details": {**record.details, "surfaces": dict.fromkeys(names, far), "objects": {}},
            "given_fidelity": [SurfaceFidelity(surface="endo_rv", given="rv", **lies)],
            "volumes": [VolumeRecord(name="rv cavity", part="below the base", mesh_ml=99.0, given_ml=101.0)],
        }
    )
    found = methods(record).plain
    for words in (
        "the endocardium of the left ventricle, the endocardium of the right ventricle and the common epicardium",
        "at most 1.5 mm from the triangles given",
        "The endocardium of the right ventricle lies 0.11 mm on average",
        "the surfaces given below the base are: rv cavity 99.0 and 101.0 mL",
    ):
        assert words in found
    assert "with its wall" not in found
    ready = {name: {"vertices": 400, "method": "smooth"} for name in names}
    found = methods(record.model_copy(update={"details": {**record.details, "surfaces": ready}})).plain
    assert "used without change" in found
    assert "labels" not in found


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron"])
def test_elements_are_named_counted_and_measured(kind: str) -> None:
    quality = check(truncated_ellipsoid(kind))
    found = methods(manifest({}), quality).plain
    assert f"{quality.cells[kind]} {'ten-node (quadratic)' if kind == 'tetra10' else 'eight-node (linear)'}" in found
    assert f"at least {quality.measures['mean_ratio'].min:.2f}" in found


def test_labels_count_below_the_base_and_in_all() -> None:
    volume = VolumeRecord(name="cavity", part="below the base", mesh_ml=137.0, segmentation_ml=138.0, whole_ml=173.9)
    found = methods(manifest({}).model_copy(update={"volumes": [volume]})).plain
    assert "cavity 137.0 and 138.0 mL (of 173.9 mL in all)" in found


def test_surfaces_alone_have_no_wall() -> None:
    record = manifest({})
    alone = record.model_copy(update={"details": {name: record.details[name] for name in ("objects", "surfaces")}})
    found = methods(alone).plain
    assert found.startswith("Closed surfaces were made")
    assert not re.search("fTetWild|at the base|apex|epicardium", found)


def test_a_sequence_adds_its_phases() -> None:
    def phase(name: str, offset: float) -> PhaseRecord:
        figures = dict.fromkeys(("cavity_ml", "label_cavity_ml", "label_total_ml", "displacement_mean_mm"), 1.0)
        return PhaseRecord(
            name=name, time=0.0, passed=True, base_offset_mm=offset, displacement_maximum_mm=2.0, **figures
        )

    sequence = SequenceManifest(
        reference=1,
        template={"columns": 12},
        phases=[phase("ed", 0.0), phase("es", 4.25)],
        ejection_fraction_percent=55.25,
        label_ejection_fraction_percent=54.0,
    )
    found = sequence_methods(manifest(SWEPT, {"apex": OPEN_APEX}), sequence)
    assert isinstance(found, Words)
    for words in ("All 2 phases", "of phase es", "0.0 to 4.2 mm", "is 55.2 %", "the same share of the labelled cavity"):
        assert words in found.plain
