"""All options of one run: the groups of its stages, and what does not go together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal

from pydantic import Field, field_validator, model_validator

from femprep.model.tags import TISSUES
from femprep.options.activation import ActivationOptions, PurkinjeOptions
from femprep.options.base import StageOptions
from femprep.options.check import CheckOptions
from femprep.options.export import ExportOptions
from femprep.options.fibres import FibreOptions
from femprep.options.image import ImageOptions
from femprep.options.pericardium import PericardiumOptions
from femprep.options.presets import PRESETS
from femprep.options.surface import SurfaceOptions
from femprep.options.sweep import SweepOptions
from femprep.options.volume import VolumeOptions
from femprep.options.wall import WallOptions

#: Structures that are no ball-like object on their own: a wall is fitted together with its cavity.
WALLS = frozenset({"myo", "rv_wall", "la_wall", "ra_wall"})

#: Options of a group that one mesher alone reads. Limits of time and memory the sweep never reaches.
_READ_BY_ONE: Final = {
    "sweep": ("element", "template", "edge_length", "layers", "columns", "rows", "grading", "order", "toward"),
    "volume": (
        *("quality", "refinement", "gradation", "envelope", "stop_energy", "optimise"),
        *("minimum_dihedral", "mean_ratio", "retries"),
    ),
}

#: Anatomies that have the walls whose thickness is assumed.
_WALLS_OF: Final = {"rv_wall_thickness": ("biv", "whole-heart"), "atrial_wall_thickness": ("whole-heart",)}


class Options(StageOptions):
    """All options of one run.

    Examples
    --------
    >>> fp.Options(preset="acdc", volume={"edge_length": 2.0})
    Options(preset='acdc', volume=VolumeOptions(edge_length=2.0))
    """

    anatomy: Literal["lv", "biv", "whole-heart"] = Field(
        "lv", description="Which part of the heart is meshed: left ventricle, both ventricles, or all four chambers."
    )
    preset: str | None = Field(None, description=f"Structures of a known data set: {', '.join(PRESETS)}.")
    structures: dict[str, tuple[int | str, ...]] = Field(
        default_factory=dict,
        description="Label numbers by structure name (lv, myo, rv, ...); of a .seg.nrrd also names of its segments.",
    )
    unit: Literal["auto", "mm", "cm", "m", "um"] = Field(
        "auto", description="Unit of length of given surfaces: guessed from the size of the heart, which is said."
    )
    blood_pool: bool = Field(
        False,
        description="Mesh the blood in the cavities together with the wall: regions blood_lv, blood_rv..., facets "
        "cap_lv, cap_rv... over their openings.",
    )
    conforming: bool = Field(
        False,
        description="Cut tetrahedra along the outlines of the tissue of a second image, so that its regions end "
        "there and not at the nearest faces.",
    )
    flip: bool = Field(False, description="Mirror the label map first, for a heart that was stored mirrored.")
    formats: tuple[str, ...] = Field((), description="Further file formats of the mesh beside mesh.vtu.")
    image: ImageOptions = ImageOptions()
    surface: SurfaceOptions = SurfaceOptions()
    wall: WallOptions = WallOptions()
    volume: VolumeOptions = VolumeOptions()
    sweep: SweepOptions = SweepOptions()
    check: CheckOptions = CheckOptions()
    fibres: FibreOptions | None = Field(
        None, description="Ventricular coordinates, AHA segments and fibres on the mesh; none where left out."
    )
    pericardium: PericardiumOptions | None = Field(
        None,
        description="Springs of the pericardium on the epicardium; none where left out. They need the fibres' "
        "coordinates.",
    )
    purkinje: PurkinjeOptions | None = Field(
        None, description="Purkinje fibres on the endocardia of the ventricles; none where left out."
    )
    activation: ActivationOptions | None = Field(
        None,
        description="Times at which a beat activates each point, from the Purkinje fibres or, without them, the whole "
        "endocardium; none where left out. They need fibres.",
    )
    export: ExportOptions = ExportOptions()
    solve: Literal["none", "ccx"] = Field(
        "none",
        description="Solver that inflates the finished mesh, to show that it solves: none, or CalculiX (ccx), by the "
        "deck, material and pressure of the export's inflation step.",
    )

    @field_validator("preset")
    @classmethod
    def _known_preset(cls, value: str | None) -> str | None:
        if value is not None and value not in PRESETS:
            raise ValueError(f"expected one of {', '.join(sorted(PRESETS))}")
        return value

    @field_validator("structures", mode="before")
    @classmethod
    def _one_or_many(cls, value: Any) -> Any:
        if not isinstance(value, Mapping):
            return value
        return {name: (labels,) if isinstance(labels, int | str) else labels for name, labels in value.items()}

    @model_validator(mode="after")
    def _one_cavity_is_swept(self) -> Options:
        if self.volume.mesher == "sweep" and self.anatomy != "lv":
            raise ValueError(
                f"mesher 'sweep' fills the wall between two surfaces: anatomy lv; {self.anatomy} needs --mesher tetwild"
            )
        return self

    @model_validator(mode="after")
    def _what_the_mesher_does_not_read(self) -> Options:
        """An option that would be taken and ignored is refused."""
        mesher = self.volume.mesher
        group, own = ("sweep", self.sweep) if mesher == "tetwild" else ("volume", self.volume)
        for name in _READ_BY_ONE[group]:
            if getattr(own, name) != type(own).model_fields[name].default:
                other = "sweep" if mesher == "tetwild" else "tetwild"
                raise ValueError(
                    f"{group}.{name} is for mesher {other!r}, and this one is {mesher!r}, which has no such option; "
                    f"leave it out, or add --mesher {other}"
                )
        return self

    @model_validator(mode="after")
    def _walls_are_those_of_chambers(self) -> Options:
        for name, anatomies in _WALLS_OF.items():
            if self.anatomy not in anatomies and getattr(self.wall, name) != WallOptions.model_fields[name].default:
                own = " or ".join(anatomies)
                raise ValueError(f"wall.{name} is for anatomy {own}; {self.anatomy} has no such wall: leave it out")
        return self

    @model_validator(mode="after")
    def _whole_hearts_have_valves(self) -> Options:
        if self.anatomy != "whole-heart" and (self.wall.openings != "closed" or self.wall.valves):
            raise ValueError(
                f"openings and valves are those of anatomy whole-heart; anatomy {self.anatomy} is cut at its base plane"
            )
        return self

    @model_validator(mode="after")
    def _atria_are_open(self) -> Options:
        if self.fibres is not None and self.fibres.atria != "none":
            if self.anatomy != "whole-heart":
                raise ValueError(f"fibres of the atria are those of anatomy whole-heart, not {self.anatomy}")
            if self.wall.openings == "closed" and not self.wall.valves:
                raise ValueError(
                    "fibres of the atria begin at open valves and veins; give openings = labels, or valves"
                )
        return self

    @model_validator(mode="after")
    def _blood_is_for_tetwild(self) -> Options:
        if self.blood_pool and self.volume.mesher == "sweep":
            raise ValueError("mesher 'sweep' fills the wall alone; blood_pool needs --mesher tetwild")
        if self.blood_pool and (self.wall.openings != "closed" or self.wall.valves):
            raise ValueError("blood_pool needs closed cavities; leave openings and valves of the wall out")
        if self.blood_pool and self.export.step != "none":
            raise ValueError(
                f"step {self.export.step!r} is for a wall alone: the deck has one material, which blood has not; leave "
                "blood_pool or the step out"
            )
        return self

    @model_validator(mode="after")
    def _tetrahedra_are_cut(self) -> Options:
        element, order = self.elements
        if self.conforming and (element != "tetra" or order != 1):
            raise ValueError(
                f"conforming cuts tetrahedra of order 1, not elements of type {element} and order {order}; leave "
                "conforming out, or take those"
            )
        return self

    @model_validator(mode="after")
    def _the_pericardium_needs_coordinates(self) -> Options:
        if self.pericardium is not None and self.fibres is None:
            raise ValueError("the pericardium's stiffness depends on the coordinates that come with fibres; add fibres")
        return self

    @model_validator(mode="after")
    def _activation_needs_fibres(self) -> Options:
        if self.activation is not None and self.fibres is None:
            raise ValueError("activation runs along fibres; add fibres")
        return self

    @property
    def limits(self) -> CheckOptions:
        """Limits of the check: those given, else those of the purpose, of the mesher, the defaults.

        Examples
        --------
        >>> fp.Options(check={"purpose": "explicit"}).limits.purpose
        'explicit'
        """
        return self.check.resolved(self.volume.mesher)

    @property
    def elements(self) -> tuple[str, int]:
        """Type and order of the elements asked for.

        Examples
        --------
        >>> fp.Options(volume={"mesher": "sweep"}, sweep={"element": "wedge"}).elements
        ('wedge', 1)
        """
        if self.volume.mesher == "sweep":
            return self.layers.element, self.layers.order
        return "tetra", self.volume.order

    @property
    def layers(self) -> SweepOptions:
        """Options of the sweep, with what it was not given itself from the volume mesh's and the wall's.

        Examples
        --------
        >>> fp.Options(volume={"edge_length": 3.0}).layers.edge_length
        3.0
        """
        asked = {
            "edge_length": self.volume.edge_length,
            "order": self.volume.order,
            "layers": self.volume.elements_through_wall,
            "minimum_thickness": self.wall.minimum_thickness,
            "maximum_push": self.wall.maximum_push,
        }
        own = self.sweep.model_fields_set
        return self.sweep.model_copy(update={name: value for name, value in asked.items() if name not in own})

    @property
    def objects(self) -> dict[str, tuple[str, ...]]:
        """What surfaces alone are fitted to: each structure that is no wall, and the left ventricle with its wall.

        Examples
        --------
        >>> fp.Options(preset="acdc").objects
        {'rv': ('rv',), 'lv': ('lv',), 'epi': ('lv', 'myo')}
        """
        inner = {*WALLS, *((*TISSUES, "aorta", "pulmonary_artery") if self.preset else ())} - set(self.structures)
        found = {name: (name,) for name in self.labels if name not in inner | WALLS}
        return {**found, "epi": ("lv", "myo")} if {"lv", "myo"} <= set(self.labels) else dict(found)

    @property
    def labels(self) -> dict[str, tuple[int | str, ...]]:
        """Label numbers by structure: the preset's, with those given by hand in their place.

        Examples
        --------
        >>> fp.Options(preset="acdc", structures={"myo": 9}).labels["myo"]
        (9,)
        """
        return {**(PRESETS[self.preset] if self.preset else {}), **self.structures}
