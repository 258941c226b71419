"""The record of an annotated mesh in, its methods paragraph out: where names come from, elements, quality, fibres."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femprep.report.manifest import AnnotationManifest
from femprep.report.methods import Words
from femprep.report.methods.fill import fibres
from femprep.report.methods.result import boundary, elements, solver
from femprep.report.methods.surfaces import listed

if TYPE_CHECKING:
    from femprep.volume import QualityReport


def annotation_methods(manifest: AnnotationManifest, quality: QualityReport) -> Words:
    """The paragraph of one annotated mesh."""
    way = next((one.way for one in manifest.attempts if one.taken), "geometry")
    how = "by the names in the file or given for it"
    if way != "names":
        how = f"from its geometry (method: {way}), where neither the file nor the user names them"
    areas = [f"{boundary(one.name)} ({one.amount / 100.0:.1f} cm2)" for one in manifest.facets]
    volumes = [f"{one.name} ({one.amount / 1000.0:.1f} mL)" for one in manifest.regions]
    text = (
        f"The mesh {manifest.source or 'given'} (lengths in {manifest.source_unit}) was annotated by femprep "
        f"{manifest.femprep}. The facets of its boundary were named {how}: {listed(areas)}. Its elements belong to the "
        f"region{'s' if len(volumes) > 1 else ''} {listed(volumes)}."
    )
    named = [*manifest.facets, *manifest.regions]
    unsure = [f"{one.name} ({100.0 * one.sure:.0f} %)" for one in named if one.sure < 0.9]
    if manifest.openings:
        found = [f"{one.name} (of {one.cavity}, {one.area_mm2 / 100.0:.1f} cm2)" for one in manifest.openings]
        text += f" Openings of its cavities are {listed(found)}."
    if unsure:
        text += f" Names that are less than 90 % certain: {listed(unsure)}."
    several = any(one.name == "endo_rv" for one in manifest.facets)
    anatomy = fibres(manifest.options.fibres, manifest.details["mesh"], several=several)
    return Words(" ".join([text, *elements(quality), *anatomy, *solver(manifest)]))
