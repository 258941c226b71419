"""Options, label map and what is laid out from it in; an error within seconds where the run could not but fail.

The checks are those of the stages themselves, asked of what the labels say the stage will get.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Final

import numpy as np
from scipy.ndimage import distance_transform_edt

from femprep.activation.growth import require_growth
from femprep.anatomy import VentricularAxes, ventricular_axes
from femprep.anatomy.laplace.fields import require_ventricle
from femprep.anatomy.tissue.regions import own_tissue, require_tissues
from femprep.errors import Advice, InputError, MissingDependencyError, OptionError
from femprep.export.abaqus.calculix import require_calculix
from femprep.export.content import Content
from femprep.export.inflation import require as require_step
from femprep.export.table import refusals
from femprep.image import Grid, IntensityImage, Segmentation
from femprep.image.topology import used_box
from femprep.mesh.elements import QUADRATIC
from femprep.model import TISSUES, FloatArray
from femprep.options import Options
from femprep.options.advice import GIVE_BASE, MOVE_BASE
from femprep.report.volumes import voxel_extent
from femprep.surface.fit import check_fit
from femprep.sweeping.matching.resolution import check_columns, corners_of
from femprep.volume.refine.plan import levels_for
from femprep.volume.sizing import lengths_at
from femprep.volume.validate import ROUGH, check_roughly, check_sizing
from femprep.wall.anatomies import CHAMBERS, Layout

#: Voxels around the heart for walls that are assumed.
_ROOM: Final = 5
#: Voxels at which a sizing field is asked, at most.
_MOST_VOXELS: Final = 20_000
#: Volume of a left ventricle, with its wall, up to which it may be a rodent's, mm3; a newborn's is larger.
_SMALL: Final = 1e4


def check_options(options: Options) -> None:
    """Refuse options that contradict each other whatever the labels.

    Raises
    ------
    OptionError
        A format is unknown or cannot hold what will be made, fibres have nothing to begin from, the sweep's template
        does not fit, structures share a label.
    MissingDependencyError
        The mesher, or the solver, is not installed.
    """
    if options.volume.mesher == "sweep":
        check_columns(options.layers, corners_of(options.layers), options.wall.apex == "clipped")
    else:
        if options.surface.cells == "quad":
            raise OptionError("option 'surface.cells' is 'quad'; the mesher tetwild takes a wall of triangles alone")
        if find_spec("pytetwild") is None:
            raise MissingDependencyError("the mesher tetwild needs pytetwild; install it with pip install pytetwild")
    if options.purkinje is not None:
        require_growth()
    if options.solve == "ccx":
        require_calculix()
    if options.wall.openings != "labels":
        _check_content(options, [name.partition("_")[0] for name in options.wall.valves])
    check_apart(options.labels)


def check_apart(structures: Mapping[str, Sequence[int | str]]) -> None:
    """Refuse structures of a heart that share a label, as a voxel is part of one of them.

    Raises
    ------
    OptionError
    """
    owners: dict[int | str, str] = {}
    for name in (part for parts in CHAMBERS.values() for part in parts):
        for number in structures.get(name, ()):
            if (other := owners.setdefault(number, name)) != name:
                raise OptionError(
                    f"structures {other!r} and {name!r} both have label {number}, and a voxel is part of one of them; "
                    "give each its own, as in --structure lv=3 --structure myo=2"
                )


def check_second_images(
    heart: Segmentation | FloatArray,
    options: Options,
    tissue: Segmentation | None,
    images: Mapping[str, IntensityImage],
) -> None:
    """Refuse second images that cannot be laid along the wall, before the mesh is made.

    Parameters
    ----------
    heart : Segmentation or (n, 3) array
        The label map the mesh comes from, or points of its surfaces, mm.
    options : Options
    tissue : Segmentation or None
    images : mapping of str to IntensityImage

    Raises
    ------
    OptionError, InputError
    """
    if options.conforming and tissue is None and not (isinstance(heart, Segmentation) and own_tissue(heart)):
        raise OptionError(
            "conforming cuts elements along the tissue of a second image; give it by --regions FILE scar=1"
        )
    if tissue is None and not images:
        return
    if options.anatomy == "whole-heart":
        raise OptionError("second images go along the walls of ventricles: anatomy lv or biv, not whole-heart")
    if options.flip:
        raise OptionError("--flip mirrors the label map and not the second images; mirror all files first")
    if tissue is not None:
        require_tissues(tissue)
    if wrong := [name for name in images if name in TISSUES]:
        raise OptionError(f"a sampled field cannot be called {wrong[0]!r}, the name of a tissue; write NAME=FILE")
    grids = {name: image.grid for name, image in images.items()}
    if tissue is not None:
        grids["regions"] = tissue.grid
    if isinstance(heart, Segmentation):
        mask = heart.mask(*(name for name in ("lv", "myo") if name in heart.structures))
        centres = heart.grid.to_world(np.argwhere(mask).astype(float))
    else:
        centres = heart
    for name, grid in grids.items():
        index = grid.to_index(centres)
        if not ((index > -0.5) & (index < np.array(grid.shape) - 0.5)).all(axis=1).any():
            raise InputError(
                f"the image for {name!r} does not meet the heart: its middle is at {_middle(grid)}, the heart's at "
                f"{np.round(centres.mean(axis=0), 1).tolist()} mm; both have to be in the same world coordinates"
            )


def _middle(grid: Grid) -> list[float]:
    return [float(x) for x in np.round(grid.to_world([(np.array(grid.shape) - 1) / 2.0])[0], 1)]


def check_labels(seg: Segmentation, layout: Layout, options: Options) -> VentricularAxes | None:
    """Refuse a label map on which a later stage could not but fail.

    Parameters
    ----------
    seg : Segmentation
    layout : Layout
        Of this map.
    options : Options

    Returns
    -------
    VentricularAxes or None
        Of the heart, where fibres are asked for.

    Raises
    ------
    InputError
        A plane misses the heart, fibres find no axes, the openings shown are not those that fibres or a format need.
    OptionError, ResourceError
        The edge length is far longer than the wall is thick, or needs more memory than the limit.
    FileError
        The sizing field cannot be read.
    """
    _check_content(options, [opening.name for opening in layout.openings])
    for obj in layout.objects.values():
        check_fit(obj, options.surface)
    _check_planes(layout)
    _check_scale(layout, options)
    _check_amount(seg, layout, options)
    if options.fibres is None:
        return None
    try:
        return ventricular_axes(seg, basal_end=options.wall.basal_end, mirrored=options.fibres.mirrored)
    except InputError as error:
        error.args = (f"fibres need the axes of the heart: {error.args[0]}",)
        error.advice = error.advice or (Advice("leave fibres out"),)
        raise


def _check_content(options: Options, openings: list[str]) -> None:
    """What the mesh will hold against what fibres and formats need."""
    content = _forecast(options, openings)
    if content.fibres:
        try:
            require_ventricle(content.facets)
        except InputError as error:
            shown = ", ".join(openings) or "none"
            raise OptionError(
                f"fibres need a base or a valve to begin from; openings of this whole heart: {shown} ({error})",
                advice=[
                    Advice("cut valves open by --openings labels", "wall.openings", "labels"),
                    Advice("cut them at a given plane (--valve mitral=...)", "wall.valves"),
                    Advice("leave fibres out"),
                ],
            ) from None
    for name, reason in refusals(content, options.formats, options.export).items():
        raise OptionError(f"format {name!r}: {reason}")
    if options.solve != "none":
        try:
            require_step(content, options.export.model_copy(update={"step": "inflation"}))
        except InputError as error:
            raise OptionError(f"solve {options.solve!r}: {error}; or leave solve out") from None


def _forecast(options: Options, openings: list[str]) -> Content:
    """What the mesh will have, by the options and the openings to be cut."""
    element, order = options.elements
    cut = ("base", "apex") if options.wall.apex == "clipped" else ("base",)
    facets: tuple[str, ...] = {
        "lv": ("endo", "epi", *cut),
        "biv": ("endo_lv", "endo_rv", "epi", *cut),
        "whole-heart": ("endo_lv", "endo_rv", "endo_la", "endo_ra", "epi", *dict.fromkeys(openings)),
    }[options.anatomy]
    kind = QUADRATIC[element] if order == 2 else element
    return Content((kind,), facets, options.fibres is not None, options.blood_pool)


def _check_planes(layout: Layout) -> None:
    """Base and apex plane cut the heart, and leave some of the cavity between them."""
    planes = {name: plane for name, plane in (("base", layout.base), ("apex", layout.apex)) if plane is not None}
    if not planes:
        return
    cavity = layout.objects["lv"]
    points = cavity.grid.to_world(np.argwhere(cavity.mask))
    away = {name: plane.signed_distance(points) for name, plane in planes.items()}
    for name, distance in away.items():
        # Beyond the centres of its outermost voxels the cavity goes on for no more than a voxel.
        reach = voxel_extent(cavity, planes[name])
        if distance.min() >= 0.0 or distance.max() <= -reach:
            side = "cuts all of it away" if distance.min() >= 0.0 else "cuts nothing away"
            raise InputError(
                f"the {name} plane misses the cavity and {side} (its voxels lie {distance.min():.1f} to "
                f"{distance.max():.1f} mm from it along its normal)",
                advice=[GIVE_BASE if planes[name].source == "given" else MOVE_BASE],
            )
    if not np.all([distance < 0.0 for distance in away.values()], axis=0).any():
        raise InputError("nothing of the cavity lies between base and apex plane", advice=[MOVE_BASE])


def _check_scale(layout: Layout, options: Options) -> None:
    """Refuse lengths of a human heart, where nobody gave others, that the wall of a small one is too thin for."""
    cavity, body = layout.objects["lv"], layout.objects.get("lv_epi") or layout.objects["epi"]
    side = sum(_side(obj.mask, obj.grid.spacing, obj.stack_axis) for obj in (cavity, body))
    thick = 2.0 * (body.volume - cavity.volume) / side
    # By option: how thick the wall has to be for its default, over that, and the share of a wall that suits it.
    lengths = {"minimum_thickness": (2.0, 0.1)}
    for name, option, share in (("rv", "rv_wall_thickness", 0.3), ("la", "atrial_wall_thickness", 0.2)):
        if name in layout.objects and f"{name}_epi" not in layout.objects:
            lengths[option] = (1.0, share)
    wall = options.wall
    if body.volume > _SMALL or all(
        name in wall.model_fields_set or n * getattr(wall, name) < thick for name, (n, _) in lengths.items()
    ):
        return
    wanted = " ".join(f"--{name.replace('_', '-')} {share * thick:.1g}" for name, (_, share) in lengths.items())
    least = float(f"{lengths['minimum_thickness'][1] * thick:.1g}")
    alone = ("wall.minimum_thickness", least) if len(lengths) == 1 else ()
    raise OptionError(
        f"the wall of the left ventricle is about {thick:.2g} mm thick by the labels, too thin for lengths that suit a "
        "human heart (the voxel sizes of the file may also be wrong: --spacing)",
        advice=[
            # Of several lengths no single one makes the heart pass.
            Advice(f"give {wanted} --edge-length {thick / 3.0:.1g}", *alone),
        ],
    )


def _check_amount(seg: Segmentation, layout: Layout, options: Options) -> None:
    """Elements asked for against the wall and the memory, by voxels."""
    wall, spacing = options.wall, seg.grid.spacing
    chambers = {name: own for name, own in CHAMBERS.items() if name in layout.objects}
    parts = [part for own in chambers.values() for part in own if part in seg.structures]
    around = seg.mask(*parts)
    box = used_box(around)
    around = np.pad(around[box], _ROOM)
    cavities = {name: np.pad(seg.mask(name)[box], _ROOM) for name in chambers}
    blood = np.any(list(cavities.values()), axis=0)
    assumed = {"rv": wall.rv_wall_thickness, "la": wall.atrial_wall_thickness, "ra": wall.atrial_wall_thickness}
    for name, thickness in assumed.items():
        if name in chambers and CHAMBERS[name][1] not in parts:
            around |= distance_transform_edt(~cavities[name], sampling=spacing) <= thickness
    tissue = float(np.count_nonzero(around & ~blood)) * seg.grid.voxel_volume
    if tissue <= 0.0:
        return
    side = sum(_side(mask, spacing, seg.stack_axis) for mask in (around, *cavities.values()))
    filled = np.count_nonzero(blood) * seg.grid.voxel_volume if options.blood_pool else 0.0
    thickness = check_roughly(tissue, side, wall.minimum_thickness, options.volume, filled, seg.grid.pixel)
    if options.volume.sizing is None and (
        options.volume.elements_through_wall is None or options.volume.mesher == "sweep"
    ):
        return
    inside = np.argwhere(seg.mask("myo"))
    where = seg.grid.to_world(inside[:: max(1, len(inside) // _MOST_VOXELS)])
    field = lengths_at(where, thickness, options.volume, tissue + filled)
    levels = levels_for(options.volume, thickness, field.values)
    check_sizing(field, options.volume, slack=ROUGH, levels=levels)


def _side(mask: np.ndarray, spacing: FloatArray, stack: int) -> float:
    """Area of an object's sides, mm2: of its voxel faces along the stack, a quarter less for their steps."""
    area = 0.0
    for axis in set(range(3)) - {stack}:
        faces = np.count_nonzero(np.diff(mask.astype(np.int8), axis=axis))
        area += faces * float(np.prod(spacing) / spacing[axis])
    return area * np.pi / 4.0
