"""A run's record and its quality in, sentences on elements, quality, fidelity, volumes and a solver's step out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from femprep.report.manifest import AnnotationManifest, RunManifest
from femprep.report.methods.surfaces import CHAMBERS, listed

if TYPE_CHECKING:
    from femprep.volume import QualityReport

#: Elements by type: plain names, number of nodes, order.
ELEMENTS: Final = {
    "tetra": "four-node (linear) tetrahedra",
    "tetra10": "ten-node (quadratic) tetrahedra",
    "wedge": "six-node (linear) wedges",
    "wedge15": "15-node (quadratic) wedges",
    "hexahedron": "eight-node (linear) hexahedra",
    "hexahedron20": "20-node (quadratic) hexahedra",
}
_MATERIALS: Final = {
    "linear": "linear elastic",
    "neo-hookean": "neo-Hookean",
    "orthotropic": "linear elastic and {:g} times stiffer along the fibres",
}


def elements(quality: QualityReport | None) -> list[str]:
    """Type, order and number of the elements, and their quality."""
    if quality is None:
        return []
    kinds = listed([f"{count} {ELEMENTS[kind]}" for kind, count in quality.cells.items()])
    edge, through = quality.edge_length, quality.elements_through_wall
    text = (
        f"The mesh has {kinds} and {quality.n_points} nodes; edges are {edge.mean:.2g} mm long on average "
        f"({edge.min:.2g} to {edge.max:.2g} mm)"
    )
    text += f", and {through.median:g} elements (median) lie across the wall." if through is not None else "."
    found = quality.measures
    text += (
        f" The mean ratio of the elements [@knupp2001] is {found['mean_ratio'].mean:.2f} on average and at least "
        f"{found['mean_ratio'].min:.2f}, the scaled Jacobian is at least {found['scaled_jacobian'].min:.2f}, and "
        f"dihedral angles are between {found['minimum_dihedral'].min:.0f} and {found['maximum_dihedral'].max:.0f} "
        "degrees."
    )
    if quality.failures:
        failed = "; ".join(line.partition(";")[0] for line in quality.failures)
        text += f" The mesh does not pass all checks of quality: {failed}."
    return [text]


def fidelity(manifest: RunManifest) -> list[str]:
    """How far the surfaces of the mesh lie from labels or given surfaces, and what volumes both enclose."""
    given = bool(manifest.input.surfaces)
    other = "the surface given" if given else "the outlines of its labels in the slices"
    found: list[str] = []
    for one in manifest.given_fidelity or manifest.fidelity:
        where = f"{one.mean_mm:.2f} mm on average and {one.greatest_mm:.1f} mm at most"
        found.append(
            f"{boundary(one.surface)} {where}" if found else f"{boundary(one.surface)} lies {where} from {other}"
        )
    pairs = []
    for volume in manifest.volumes:
        if beside := volume.given_ml if given else volume.segmentation_ml:
            whole = f" (of {volume.whole_ml:.1f} mL in all)" if volume.whole_ml and volume.part != "in all" else ""
            pairs.append(f"{volume.name} {volume.mesh_ml:.1f} and {beside:.1f} mL{whole}")
    sentences = [f"{text[0].upper()}{text[1:]}." for text in [", ".join(found)] if text]
    if pairs:
        part = "" if manifest.volumes[0].part == "in all" else f" {manifest.volumes[0].part}"
        other = "the surfaces given" if given else "the labels"
        sentences.append(f"Volumes of the mesh and of {other}{part} are: {'; '.join(pairs)}.")
    return sentences


def boundary(name: str) -> str:
    """Facets or a closed surface, in words."""
    if name.startswith("endo"):
        return f"the endocardium of the {CHAMBERS.get(name.removeprefix('endo').removeprefix('_') or 'lv', name)}"
    return {"epi": "the epicardium", "base": "the base", "apex": "the apex"}.get(name, f"surface {name}")


def solver(manifest: RunManifest | AnnotationManifest) -> list[str]:
    """The step in the input files of solvers, and what a solver made of it."""
    export, solution = manifest.options.export, getattr(manifest, "solution", None)
    done = ["written into the input files"] if export.step != "none" and manifest.options.formats else []
    done += ["computed by CalculiX"] if solution is not None else []
    if not done:
        return []
    pressures = export.pressure
    load = (
        listed([f"{value:g} kPa ({name})" for name, value in pressures.items()])
        if isinstance(pressures, dict)
        else f"{pressures:g} kPa"
    )
    text = (
        f"A passive inflation was {listed(done)}: the nodes of the base are fixed, a pressure of {load} acts on the "
        f"endocardium, and the material is {_MATERIALS[export.material].format(export.fibre_stiffness)}, with a "
        f"Young's modulus of {export.young_modulus:g} kPa and a Poisson's ratio of {export.poisson_ratio:g}."
    )
    if solution is not None and solution.failure:
        text += " CalculiX did not solve it."
    elif solution is not None:
        text += f" The largest displacement of a node is {solution.greatest_displacement_mm:.2f} mm."
    return [text]
