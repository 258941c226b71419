"""A run's record in, sentences on how its wall was filled and on the fibres in it out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from femprep.anatomy.rules import DOSTE_RV
from femprep.options import FibreOptions
from femprep.report.manifest import RunManifest

_SHAPES: Final = {"tetra": "tetrahedra", "wedge": "wedges", "hexahedron": "hexahedra"}


def filling(manifest: RunManifest) -> list[str]:
    """How the wall was filled, by which mesher."""
    if "sweep" in (manifest.options.volume.mesher, manifest.details.get("volume", {}).get("mesher")):
        return [_swept(manifest)]
    return _tetrahedra(manifest)


def _swept(manifest: RunManifest) -> str:
    volume, layers = manifest.details.get("volume", {}), manifest.options.layers
    kind = _SHAPES.get(volume.get("element", layers.element), "elements")
    count = volume.get("layers", layers.layers)
    cells = "quadrilaterals" if volume.get("template") == "quad" else "triangles"
    text = (
        f"Endocardium and epicardium were matched on one cup of {cells} about the long axis, their vertices slid along "
        "the surfaces to where the elements between them are best by their mean ratio [@knupp2001], folded ones being "
        f"untangled on the way [@escobar2003], and the wall between was filled with {count or 'several'} layers of "
        f"{kind} of about {layers.edge_length:g} mm."
    )
    if volume.get("mended", {}).get("moved"):
        text += " Nodes around poor elements were moved within the wall and along its surfaces."
    return text


def _tetrahedra(manifest: RunManifest) -> list[str]:
    options, versions = manifest.options.volume, manifest.libraries
    if options.sizing is not None:
        size = "of a given edge length from place to place"
    elif options.elements_through_wall is not None:
        most = "" if options.largest_edge is None else f", of at most {options.largest_edge:g} mm"
        through = options.elements_through_wall
        size = f"whose edge length follows the wall's thickness, for {through} of them through it{most}"
    else:
        size = f"of {options.edge_length:g} mm"
    levels = manifest.details.get("volume", {}).get("refinement", {}).get("levels", 0)
    if levels:
        size = f"of {options.edge_length * 2**levels:g} mm"
    text = (
        "The surfaces were joined to a closed wall by Boolean operations (manifold3d "
        f"{versions.get('manifold3d', '')}), which was filled with tetrahedra {size} by fTetWild [@hu2020] through "
        f"pytetwild {versions.get('pytetwild', '')}"
    )
    if levels:
        text += (
            f"; each was cut into eight {'once' if levels == 1 else f'{levels} times'}, along the shortest diagonal "
            f"[@bey1995], to edges of {options.edge_length:g} mm, with new boundary nodes on smooth surfaces "
            "through the wall's vertices"
        )
    text += "; nodes were then moved to improve the worst ones [@freitag1997]." if options.optimise else "."
    found = [text]
    if options.order == 2:
        found.append("Mid-side nodes of ten-node tetrahedra lie on smooth surfaces through the wall's vertices.")
    if manifest.options.blood_pool:
        found.append(
            "The blood in the cavities, closed by flat caps where planes cut them, was meshed together with the wall, "
            "so that both share their nodes."
        )
    return found


def fibres(options: FibreOptions | None, info: Mapping[str, Any], *, several: bool) -> list[str]:
    """Coordinates, segments and fibres of a mesh, from what its ``info`` holds; ``several``: of several chambers."""
    if options is None or "fibres" in info.get("verdict", {}).get("failures", {}):
        return []
    record: dict[str, Any] = info.get("fibres", {})
    angles = f"{options.endo_angle:+g} degrees at the endocardium to {options.epi_angle:+g} at the epicardium"
    right = (options.rv_endo_angle, options.rv_epi_angle)
    if several and (right != (None, None) or options.rule == "doste"):
        usual = DOSTE_RV if options.rule == "doste" else (options.endo_angle, options.epi_angle)
        endo = usual[0] if right[0] is None else right[0]
        epi = usual[1] if right[1] is None else right[1]
        angles += f" (in the right ventricle from {endo:+g} to {epi:+g})"
    if options.rule == "doste":
        rule = (
            "after Doste et al. [@doste2019], in which fibres turn towards the open outflow valves, to "
            f"{options.outflow_endo_angle:+g} degrees at the endocardium of the outflow tracts and "
            f"{options.outflow_epi_angle:+g} at the epicardium, in frames from Laplace fields [@bayer2012]"
        )
    elif options.rule == "bayer":
        rule = "by the rule of Bayer et al. as printed [@bayer2012]"
    else:
        rule = (
            "by a rule after Bayer et al. [@bayer2012]: local frames from Laplace fields are interpolated first, and "
            "then rotated by one angle that is linear in depth"
        )
    depth = "a ratio of distances [@schuler2021]" if options.depth == "distance" else "the harmonic field itself"
    text = (
        "Ventricular coordinates [@schuler2021] and the segments of the American Heart Association [@cerqueira2002] "
        f"were added to the wall. Fibre directions were assigned {rule}. The transmural depth is {depth}, and the "
        f"helix angle changes from {angles}; it is positive where fibres climb to the right, seen from outside with "
        "the base up [@streeter1969]"
    )
    if options.endo_sheet_angle or options.epi_sheet_angle:
        text += (
            f". The sheet angle, measured from the transmural direction, changes from {options.endo_sheet_angle:+g} to "
            f"{options.epi_sheet_angle:+g} degrees"
        )
    found = [text + "."]
    if options.atria == "piersanti" and "atria" in info:
        found.append(
            "Fibres of the atria run across Laplace fields between the openings of their valves and veins "
            "[@piersanti2021], without the bundles whose landmarks no opening gives."
        )
    assumed = info.get("axes", {}).get("info", {}).get("assumed", ())
    if record.get("mirrored"):
        told = "given as" if options.mirrored == "yes" else "recognised as"
        found.append(f"The heart was {told} a mirror image, and its fibres are mirrored accordingly.")
    elif "hand" in assumed and options.mirrored == "auto":
        found.append("The input does not show whether the heart is a mirror image; it was assumed not to be one.")
    if "septal" in assumed:
        found.append("The input does not show the septum; it was assumed to lie to the right and in front.")
    return found


def held(manifest: RunManifest) -> list[str]:
    """The springs of the pericardium, where they were asked for."""
    options = manifest.options.pericardium
    if options is None or not _made(manifest, "fibres"):
        return []
    return [
        "The pericardium is represented by springs along the normal of the epicardium, of "
        f"{options.stiffness:g} kPa/mm at the apex and less towards the base, after Strocchi et al. [@strocchi2020]."
    ]


def activated(manifest: RunManifest) -> list[str]:
    """Purkinje fibres and activation times, where they were asked for."""
    purkinje, activation = manifest.options.purkinje, manifest.options.activation
    found = []
    if purkinje is not None and _made(manifest, "purkinje"):
        found.append(
            "Fractal trees of Purkinje fibres [@costabal2016] were grown on the endocardia of the ventricles, with "
            f"branches of {purkinje.branch_length:g} mm; each end is a node of the mesh."
        )
    if activation is not None and _made(manifest, "activation"):
        begin = (
            "the junctions of the Purkinje fibres" if purkinje is not None else "all nodes of the endocardia at once"
        )
        speeds = f"{activation.fibre_speed:g}, {activation.sheet_speed:g} and {activation.normal_speed:g} m/s"
        measured = " [@caldwell2009]" if not activation.model_fields_set else ""
        found.append(
            f"Activation times, from {begin}, solve the eikonal equation on the mesh [@fu2013] with conduction "
            f"velocities of {speeds} along fibres, across them and across sheets{measured}."
        )
    return found


def _made(manifest: RunManifest, part: str) -> bool:
    """Whether the mesh has a part that was asked for."""
    return part not in manifest.details.get("volume", {}).get("verdict", {}).get("failures", {})
