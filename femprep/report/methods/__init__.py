"""A run's record in, its methods paragraph out: what was done to this heart and how good the mesh is, with references.

The text follows from the options and from what the stages report, so that it holds what this run did and nothing else.
References are written as pandoc reads them, ``[@key]``; their entries are in a BibTeX file beside the text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from femprep.report.manifest import RunManifest, SequenceManifest
from femprep.report.methods.bibliography import REFERENCES, bibtex
from femprep.report.methods.fill import activated, fibres, filling, held
from femprep.report.methods.result import elements, fidelity, solver
from femprep.report.methods.surfaces import epicardium, fitting, image
from femprep.report.methods.wall import cuts, thickness

if TYPE_CHECKING:
    from femprep.volume import QualityReport

#: Files of an output folder that hold the words and their references.
FILES: Final = ("methods.md", "methods.bib")

_CITED: Final = re.compile(r"\[@([^\]]+)\]")
_MESHED: Final = {
    "lv": "The wall of the left ventricle was meshed",
    "biv": "The wall of both ventricles was meshed",
    "whole-heart": "The walls of the four chambers of the heart were meshed",
}


@dataclass(frozen=True)
class Words:
    """A paragraph with its references.

    Attributes
    ----------
    text : str
        With references as ``[@key; @key]``.
    """

    text: str

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of what is cited, in order, once each."""
        found = (key.strip().lstrip("@") for group in _CITED.findall(self.text) for key in group.split(";"))
        return tuple(dict.fromkeys(found))

    @property
    def plain(self) -> str:
        """The same for reading: authors, years and DOIs in brackets."""
        return _CITED.sub(lambda found: f"({'; '.join(map(_shown, found[1].split(';')))})", self.text)

    @property
    def markdown(self) -> str:
        """The file of the paragraph."""
        return self.text + "\n"

    @property
    def bibtex(self) -> str:
        """The file of its references."""
        return bibtex(self.keys)


def _shown(key: str) -> str:
    reference = REFERENCES[key.strip().lstrip("@")]
    return f"{reference.short}, doi {reference.fields['doi']}" if "doi" in reference.fields else reference.short


def methods(manifest: RunManifest, quality: QualityReport | None = None) -> Words:
    """The paragraph of one run: of ``femprep mesh``, or of ``femprep surface``, which has no wall and no mesh.

    Parameters
    ----------
    manifest : RunManifest
    quality : QualityReport, optional
        Of its mesh.
    """
    meshed = "volume" in manifest.details
    spacing = " x ".join(f"{s:.4g}" for s in manifest.input.spacing_mm or ())
    what = _MESHED[manifest.options.anatomy] if meshed else "Closed surfaces were made"
    source = f"a segmented image with voxels of {spacing} mm" if spacing else "triangulated surfaces"
    parts = [
        f"{what} from {source} by femprep {manifest.femprep}.",
        *image(manifest),
        *fitting(manifest),
    ]
    if meshed:
        parts += [*epicardium(manifest), *cuts(manifest), *thickness(manifest), *filling(manifest)]
    parts += [*elements(quality), *fidelity(manifest)]
    if meshed:
        several, info = manifest.options.anatomy != "lv", manifest.details["volume"]
        parts += [
            *fibres(manifest.options.fibres, info, several=several),
            *held(manifest),
            *activated(manifest),
            *solver(manifest),
        ]
    return Words(" ".join(parts))


def sequence_methods(reference: RunManifest, sequence: SequenceManifest, quality: QualityReport | None = None) -> Words:
    """The paragraph of phases of one heart.

    Parameters
    ----------
    reference : RunManifest
        Of the phase that displacements are from.
    sequence : SequenceManifest
    quality : QualityReport, optional
        Of the reference phase.
    """
    count, name = len(sequence.phases), sequence.phases[sequence.reference].name
    moved = [phase.base_offset_mm for phase in sequence.phases]
    base = (
        f", {min(moved):.1f} to {max(moved):.1f} mm below the centre of that slice" if max(moved) > min(moved) else ""
    )
    more = (
        f"All {count} phases of this heart were meshed in this way, with the same number of elements around, along and "
        "through the wall, so that nodes and elements of the same number correspond. The figures above are those of "
        f"phase {name}, which displacements refer to. The base planes leave out the same share of the labelled "
        f"cavity in all phases{base}. The ejection fraction of the meshes is "
        f"{sequence.ejection_fraction_percent:.1f} %, that of the labels "
        f"{sequence.label_ejection_fraction_percent:.1f} %."
    )
    return Words(f"{methods(reference, quality).text} {more}")
