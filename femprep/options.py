"""Every option and default of every stage, once. Schemas, command line and Python calls are all made from here.

A stage takes ``options=None, **changes``: :func:`choose` merges the changes into the stage's defaults and turns what
pydantic finds wrong into one line.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PositiveFloat,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from femprep.errors import OptionError

#: Limits of a mesher's elements, in place of the defaults where they are not given: swept layers follow the wall, so
#: their elements are flatter where it is thin.
MESHER_LIMITS: dict[str, dict[str, float]] = {
    "tetwild": {},
    "sweep": {"minimum_dihedral": 8.0, "mean_of_mean_ratio": 0.75},
}

#: Limits by what a mesh is for, in place of the defaults and the mesher's where they are not given; the reasons and
#: sources stand at :class:`CheckOptions`.
PURPOSE_LIMITS: dict[str, dict[str, float]] = {
    "general": {},
    "explicit": {
        "minimum_dihedral": 10.0,
        "maximum_dihedral": 165.0,
        "minimum_scaled_jacobian": 0.15,
        "minimum_size_ratio": 0.2,
    },
    "implicit": {
        "minimum_dihedral": 10.0,
        "maximum_dihedral": 165.0,
        "minimum_mean_ratio": 0.2,
        "minimum_scaled_jacobian": 0.2,
        "minimum_relative_jacobian": 0.2,
        "maximum_volume_ratio": 30.0,
    },
    "electrophysiology": {
        "maximum_dihedral": 150.0,
        "minimum_mean_ratio": 0.2,
        "maximum_edge_by_space_constant": 1.0,
    },
}


class MeshTargets(NamedTuple):
    """What is asked of a mesh of fTetWild, and the parameters that reach it.

    Attributes
    ----------
    minimum_dihedral : float
        Smallest dihedral angle, degrees.
    mean_ratio : float
        Mean of the mean ratio.
    stop_energy : float
        Shape energy at which fTetWild stops: 3 is a regular tetrahedron.
    envelope : float
        How far the mesh may leave the wall's surface, in edge lengths.
    retries : int
        Further runs where one fails or misses what was asked.
    poor_angle : float
        Elements with a dihedral angle below this one are improved afterwards, degrees.
    """

    minimum_dihedral: float
    mean_ratio: float
    stop_energy: float
    envelope: float
    retries: int
    poor_angle: float


#: Targets by the name of a quality; measured figures stand in the README.
QUALITY: dict[str, MeshTargets] = {
    "fast": MeshTargets(10.0, 0.80, 50.0, 0.1, 1, 20.0),
    "good": MeshTargets(15.0, 0.85, 10.0, 0.05, 2, 25.0),
    "best": MeshTargets(20.0, 0.87, 6.0, 0.05, 2, 30.0),
}

#: Structures of known data sets: label numbers by structure name.
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

Policy = Literal["repair", "strict"]


class StageOptions(BaseModel):
    """Base of all option groups: frozen, no unknown names, no NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)


class ImageOptions(StageOptions):
    """Reading a label map and choosing its structures."""

    policy: Policy = Field("repair", description="What to do with pieces, voids and holes: mend and report, or refuse.")
    spacing: tuple[PositiveFloat, PositiveFloat, PositiveFloat] | None = Field(
        None, description="Voxel sizes in mm that replace the file's, for a file that carries none."
    )
    minimum_voxels: int = Field(8, ge=1, description="Smallest number of voxels an object may have.")
    correct_shifts: bool = Field(
        False, description="Estimate breath-hold shifts of the slices from the labels and move the slices back."
    )


class SurfaceOptions(StageOptions):
    """Fitting a closed template surface to an object."""

    method: Literal["smooth", "even", "paper"] = Field(
        "smooth",
        description="smooth: the surface of least change of curvature that the labels allow, the most accurate one, "
        "with even triangles. paper: the harmonic surface as published, smoothed only where its triangles would cross. "
        "even: that surface, lightly smoothed, and its vertices moved along it until the triangles are even.",
    )
    vertices: int = Field(1500, ge=12, le=20000, description="Number of vertices V of the template sphere.")
    cells: Literal["triangle", "quad"] = Field(
        "triangle",
        description="Cells of the surface: triangles, or quadrilaterals of a cubed sphere, which has 6 n^2 + 2 "
        "vertices for a whole number n, the nearest number to the one asked for. A wall is made of triangles.",
    )
    connectivity: Literal["template", "auto", "free"] = Field(
        "auto",
        description="Which vertices are joined where vertices are moved. template: as in the template. auto: as in the "
        "template, but with edges flipped where a long or branched object leaves no even triangles otherwise. free: "
        "flipped wherever that makes triangles more even. Quadrilaterals stay.",
    )
    curvature_sizing: float = Field(
        0.0,
        ge=0.0,
        le=2.0,
        description="Where vertices are moved, the area of cells goes with the surface's curvature to minus this power "
        "where that is large: 0 the same everywhere, 1 finer where curved.",
    )
    singularities: int | None = Field(
        None,
        ge=4,
        description="Number of singularities M of the harmonic field; from the object where not given. The smooth "
        "surface needs none.",
    )
    control_points: int | None = Field(
        None,
        ge=4,
        description="Number of spline control points K of the harmonic surface; from the object where not given. The "
        "smooth surface needs none.",
    )
    spline_order: int = Field(4, ge=2, le=10, description="Order m of Wahba's spline.")
    sphere_ratio: float = Field(
        1.25,
        gt=1.0,
        le=4.0,
        description="Radius of the sphere over the object's greatest distance from its barycentre.",
    )
    steps: int | None = Field(
        None,
        ge=4,
        le=1000,
        description="Runge-Kutta steps from sphere to surface; as many as an error of 0.002 mm asks for where not "
        "given.",
    )
    memory_limit: float = Field(4.0, gt=0, description="Largest memory a solve may need, GB.")


class WallOptions(StageOptions):
    """Clipping the surfaces and joining them to a wall."""

    policy: Policy = Field(
        "repair", description="What to do with a wall that is too thin: push apart and report, or refuse."
    )
    basal_end: Literal["auto", "first", "last"] = Field(
        "auto", description="Which end of the stack is basal: found, or the first or last slice."
    )
    base_offset: float = Field(
        0.0, description="Move the base plane from where the labels put it, mm, positive towards the apex."
    )
    apex: Literal["closed", "clipped"] = Field(
        "closed", description="Whether the wall is closed at the apex or cut there by a plane."
    )
    minimum_thickness: float = Field(1.0, ge=0, description="Least wall thickness, mm.")
    maximum_push: float = Field(
        8.0, ge=0, description="Farthest the epicardium may be pushed outwards to reach the least thickness, mm."
    )
    rv_wall_thickness: float = Field(
        3.0, gt=0, description="Thickness of the right ventricle's free wall where the labels have none, mm."
    )
    atrial_wall_thickness: float = Field(
        2.0, gt=0, description="Thickness of the walls of the atria where the labels have none, mm."
    )
    openings: Literal["closed", "labels"] = Field(
        "closed",
        description="Valves and vessels of the whole heart: closed by tissue, or cut open where the labels show them, "
        "that is, where cavities touch each other or the background.",
    )
    valves: dict[str, tuple[float, ...]] = Field(
        default_factory=dict,
        description="Further openings of the whole heart, by name (mitral, tricuspid, aortic, pulmonary, veins_la, "
        "veins_ra): centre x, y, z, normal x, y, z out of the ventricle or atrium, radius; mm, LPS. They take the "
        "place of those of that name that the labels show.",
    )


class VolumeOptions(StageOptions):
    """Filling the wall with elements."""

    mesher: Literal["tetwild", "sweep"] = Field(
        "tetwild", description="Which mesher fills the wall: fTetWild, or layers swept from surface to surface."
    )
    quality: Literal["fast", "good", "best"] = Field(
        "good",
        description="What is asked of fTetWild's mesh: a smallest dihedral angle of 10, 15 or 20 degrees and a mean "
        "of the mean ratio of 0.80, 0.85 or 0.87. The options below override its parameters.",
    )
    edge_length: float = Field(
        2.5, gt=0, description="Edge length of the elements, mm; the largest one where it varies."
    )
    elements_through_wall: int | None = Field(
        None,
        ge=1,
        le=20,
        description="Elements asked for through the wall: the edge length follows its thickness from place to place, "
        "up to edge_length where that is given as well; layers of the sweep.",
    )
    sizing: str | None = Field(
        None, description="VTK file with the point data edge_length, mm: the edge length wanted from place to place."
    )
    gradation: float = Field(
        0.3, gt=0, le=2, description="How much the edge length may grow per mm of distance, where it varies."
    )
    order: Literal[1, 2] = Field(1, description="Order of the elements; 2 adds mid-side nodes on the smooth surfaces.")
    envelope: float | None = Field(
        None,
        gt=0,
        description="How far the mesher may leave the wall's surface, mm; a twentieth of the edge length (fast: a "
        "tenth) if not given.",
    )
    stop_energy: float | None = Field(
        None,
        ge=4,
        le=1000,
        description="Shape energy at which the mesher stops improving elements: 3 is a regular tetrahedron, lower is "
        "better and slower; below 6 it may never be reached. By quality if not given: 50, 10 or 6.",
    )
    optimise: bool = Field(
        True, description="Move points of the worst elements afterwards, surface points along their surface."
    )
    minimum_dihedral: float | None = Field(
        None,
        ge=0,
        lt=70,
        description="Smallest dihedral angle asked of the mesh, degrees; below it the mesher retries. By quality if "
        "not given.",
    )
    mean_ratio: float | None = Field(
        None,
        ge=0,
        lt=1,
        description="Mean of the mean ratio asked of the mesh; below it the mesher retries. By quality if not given.",
    )
    retries: int | None = Field(
        None,
        ge=0,
        le=10,
        description="Further runs of the mesher, with other parameters, where one fails; by quality if not given: "
        "1, 2 or 2.",
    )
    time_limit: float = Field(600.0, gt=0, description="Longest processor time of one run of the mesher, s.")
    memory_limit: float = Field(8.0, gt=0, description="Largest memory the mesher may need, GB.")

    @field_validator("sizing")
    @classmethod
    def _fields_are_for_tetwild(cls, value: str | None, info: ValidationInfo) -> str | None:
        if value is not None and info.data.get("mesher") == "sweep":
            raise ValueError("the sweep takes no sizing field; give it layers and an edge_length, or use tetwild")
        return value

    @property
    def targets(self) -> MeshTargets:
        """What is asked of the mesh and the mesher's parameters: those given, else those of the quality."""
        names = ("minimum_dihedral", "mean_ratio", "stop_energy", "retries")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return QUALITY[self.quality]._replace(**given)

    @property
    def largest_edge(self) -> float | None:
        """Largest edge length where the length varies, mm; None where nobody gave one."""
        return self.edge_length if "edge_length" in self.model_fields_set else None


class SweepOptions(StageOptions):
    """Matching both surfaces and sweeping the wall between them in layers."""

    element: Literal["tetra", "wedge", "hexahedron"] = Field(
        "tetra", description="Elements: tetrahedra, wedges of triangles, or hexahedra of quadrilaterals."
    )
    template: Literal["triangle", "quad"] | None = Field(
        None,
        description="What the surfaces are meshed with; tetrahedra may come from either, wedges need triangles and "
        "hexahedra quadrilaterals.",
    )
    edge_length: float = Field(2.5, gt=0, description="Edge length half-way through the wall, mm.")
    layers: int | None = Field(
        None, ge=1, le=200, description="Layers of elements through the wall; from the edge length where not given."
    )
    columns: int | None = Field(
        None, ge=4, le=4000, description="Elements around the base; from the edge length where not given."
    )
    rows: int | None = Field(
        None,
        ge=1,
        le=4000,
        description="Rows of elements of constant number around, that end at the base; from the edge length where not "
        "given. Equal columns, rows and layers give equal connectivity.",
    )
    grading: float | None = Field(
        None,
        gt=0.01,
        lt=100,
        description="Height of the outermost layer over that of the innermost; above 1 is finer inside. Where not "
        "given, layers grow with the width of the elements, from place to place.",
    )
    order: Literal[1, 2] = Field(1, description="Order of the elements; 2 adds mid-side nodes on the smooth surfaces.")
    minimum_thickness: float = Field(
        1.0,
        gt=0,
        description="Least distance of the epicardium from the endocardium, mm; nearer parts are pushed outwards. "
        "A fifth of an edge for each layer is the least in any case.",
    )
    maximum_push: float = Field(
        8.0, ge=0, description="Farthest the epicardium may be pushed outwards to reach the least thickness, mm."
    )
    toward: tuple[float, float, float] | None = Field(
        None,
        description="Direction (LPS) in which the first column of elements lies, seen from the long axis; to the right "
        "ventricle, as the labels show it, where not given.",
    )


class CheckOptions(StageOptions):
    """Limits a mesh is judged by; None leaves a limit out.

    A purpose sets those that matter to it; one given by hand wins.

    - ``explicit`` dynamics: the stable time step is the least characteristic length over the speed of sound [1]_, so
      that no few elements may be much smaller than the others; angles and Jacobians that survive large deformation.
    - ``implicit`` mechanics: mean ratio and scaled Jacobian at least 0.2, the lower end of what Cubit calls acceptable
      for tetrahedra [2]_ (they bound the condition of the stiffness matrix and the interpolation error [3]_); the
      Jacobian of curved elements at least a fifth of its mean; sizes of neighbours within a factor of about three.
    - ``electrophysiology``: edges no longer, on average, than the space constant across the fibres, from which
      conduction velocities depend on the mesh [4]_; no very blunt angles, with which diffusion overshoots [5]_.

    References
    ----------
    .. [1] Belytschko, Liu & Moran, Nonlinear Finite Elements for Continua and Structures, Wiley, 2000, chapter 6.
    .. [2] Cubit 16.04 User Documentation, Metrics for tetrahedral elements, Sandia National Laboratories.
    .. [3] Shewchuk, What is a good linear finite element?, Proc. 11th Int. Meshing Roundtable, 2002.
    .. [4] Niederer et al., Verification of cardiac tissue electrophysiology simulators using an N-version benchmark,
       Phil. Trans. R. Soc. A 369, 2011. doi:10.1098/rsta.2011.0139
    .. [5] Brandts et al., On nonobtuse simplicial partitions, SIAM Review 51(2), 2009. doi:10.1137/060669073
    """

    purpose: Literal["general", "explicit", "implicit", "electrophysiology"] = Field(
        "general", description="What the mesh is for; sets limits in place of the defaults."
    )
    minimum_dihedral: float | None = Field(
        10.0, gt=0, lt=90, description="Smallest dihedral angle of tetrahedra, degrees."
    )
    maximum_dihedral: float | None = Field(
        170.0, gt=60, lt=180, description="Largest dihedral angle of tetrahedra, degrees."
    )
    minimum_mean_ratio: float | None = Field(
        None, gt=0, lt=1, description="Smallest mean ratio an element may have; 1 is the ideal shape."
    )
    mean_of_mean_ratio: float | None = Field(
        0.82, gt=0, lt=1, description="Mean over all tetrahedra of the mean ratio; 1 is the ideal shape."
    )
    minimum_scaled_jacobian: float | None = Field(
        0.1, gt=0, lt=1, description="Smallest scaled Jacobian of any element; 1 is the ideal shape."
    )
    minimum_relative_jacobian: float | None = Field(
        None, gt=0, lt=1, description="Smallest ratio of an element's least Jacobian to its mean one."
    )
    minimum_size_ratio: float | None = Field(
        None, gt=0, lt=1, description="Smallest characteristic length of an element over the median one."
    )
    maximum_volume_ratio: float | None = Field(
        None, gt=1, description="Largest ratio of the volumes of two elements that share a face."
    )
    minimum_time_step: float | None = Field(
        None, gt=0, description="Smallest stable time step of explicit dynamics, microseconds."
    )
    wave_speed: float = Field(
        1540.0, gt=0, description="Speed of sound of the material, for the stable time step, m/s (soft tissue: 1540)."
    )
    maximum_edge_by_space_constant: float | None = Field(
        None, gt=0, description="Largest mean edge length over the space constant of the tissue."
    )
    space_constant: float = Field(
        0.35, gt=0, description="Space constant of the tissue across the fibres, mm, for electrophysiology."
    )
    plane_tolerance: float = Field(
        1e-9, gt=0, description="How far points of base and apex facets may lie from their plane, mm."
    )
    worst: int = Field(10, ge=0, le=1000, description="How many of the worst elements are listed, per measure.")

    def resolved(self, mesher: str = "tetwild") -> CheckOptions:
        """Limits with those of the purpose, else of the mesher, for every one that was not given."""
        given = {name: getattr(self, name) for name in self.model_fields_set}
        return CheckOptions(**{**MESHER_LIMITS[mesher], **PURPOSE_LIMITS[self.purpose], **given})


class ExportOptions(StageOptions):
    """Writing the mesh for a solver."""

    length_unit: Literal["mm", "cm", "m"] = Field(
        "mm",
        description="Unit of length in the files of solvers; femprep's own files stay in mm, openCARP's are in "
        "micrometres.",
    )
    step: Literal["none", "inflation"] = Field(
        "none",
        description="Analysis written into the deck where the format holds one: "
        "none, or passive inflation with the base fixed.",
    )
    material: Literal["linear", "neo-hookean", "orthotropic"] = Field(
        "linear",
        description="Material of the step: linear elastic, neo-Hookean (large deformations, pressure follows the "
        "wall), or linear elastic and stiffer along the fibres, which the mesh must have.",
    )
    young_modulus: float = Field(30.0, gt=0, description="Young's modulus of the material of the step, kPa.")
    poisson_ratio: float = Field(0.4, gt=-1, lt=0.5, description="Poisson's ratio of the material of the step.")
    fibre_stiffness: float = Field(
        3.0, ge=1, description="How many times stiffer the orthotropic material is along the fibres than across."
    )
    pressure: float = Field(1.0, description="Pressure on the endocardium in the step, kPa.")


class FibreOptions(StageOptions):
    """Fibre and sheet directions; all angles in degrees, their signs drawn in femprep/anatomy/fibres.py."""

    endo_angle: float = Field(60.0, ge=-90, le=90, description="Helix angle at the endocardium, degrees.")
    epi_angle: float = Field(-60.0, ge=-90, le=90, description="Helix angle at the epicardium, degrees.")
    rv_endo_angle: float | None = Field(
        None, ge=-90, le=90, description="Helix angle at the RV endocardium, degrees; as the LV's where not given."
    )
    rv_epi_angle: float | None = Field(
        None, ge=-90, le=90, description="Helix angle at the RV epicardium, degrees; as the LV's where not given."
    )
    endo_sheet_angle: float = Field(
        0.0, ge=-180, le=180, description="Sheet angle at the endocardium, degrees from the transmural direction."
    )
    epi_sheet_angle: float = Field(
        0.0, ge=-180, le=180, description="Sheet angle at the epicardium, degrees from the transmural direction."
    )
    rule: Literal["linear", "bayer"] = Field(
        "linear",
        description="Interpolate frames and then rotate them by an angle linear in depth, "
        "or rotate first and then interpolate, as Bayer et al. 2012 print it.",
    )
    depth: Literal["distance", "laplace"] = Field(
        "distance", description="Depth in the wall by distance, or the harmonic field itself as in Bayer et al. 2012."
    )
    mirrored: Literal["auto", "yes", "no"] = Field(
        "auto", description="Whether the heart is a mirror image, whose fibres are mirrored: found, or said."
    )
    nodes: bool = Field(False, description="Fibres at the nodes too, beside those of the elements.")


class Options(StageOptions):
    """All options of one run."""

    anatomy: Literal["lv", "biv", "whole-heart"] = Field(
        "lv", description="Which part of the heart is meshed: left ventricle, both ventricles, or all four chambers."
    )
    preset: str | None = Field(None, description="Structures of a known data set: acdc, rodero.")
    structures: dict[str, tuple[int, ...]] = Field(
        default_factory=dict, description="Label numbers by structure name (lv, myo, rv, ...)."
    )
    blood_pool: bool = Field(
        False,
        description="Mesh the blood in the cavities together with the wall: regions blood_lv, blood_rv..., facets "
        "cap_lv, cap_rv... over their openings.",
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
    export: ExportOptions = ExportOptions()

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
        return {name: (labels,) if isinstance(labels, int) else labels for name, labels in value.items()}

    @model_validator(mode="after")
    def _one_cavity_is_swept(self) -> Options:
        if self.volume.mesher == "sweep" and self.anatomy != "lv":
            raise ValueError(
                f"mesher 'sweep' fills the wall between two surfaces: anatomy lv, not {self.anatomy}; use tetwild"
            )
        return self

    @model_validator(mode="after")
    def _blood_is_for_tetwild(self) -> Options:
        if self.blood_pool and self.volume.mesher == "sweep":
            raise ValueError("mesher 'sweep' fills the wall alone; blood_pool needs tetwild")
        if self.blood_pool and (self.wall.openings != "closed" or self.wall.valves):
            raise ValueError("blood_pool needs closed cavities; leave openings and valves of the wall out")
        if self.blood_pool and self.export.step != "none":
            raise ValueError(
                f"step {self.export.step!r} is for a wall alone: the deck has one material, which blood has not; leave "
                "blood_pool or the step out"
            )
        return self

    @property
    def limits(self) -> CheckOptions:
        """Limits of the check: those given, else those of the purpose, of the mesher, the defaults."""
        return self.check.resolved(self.volume.mesher)

    @property
    def layers(self) -> SweepOptions:
        """Options of the sweep with edge length, order and layers of the volume mesh, unless they have their own."""
        asked = {
            "edge_length": self.volume.edge_length,
            "order": self.volume.order,
            "layers": self.volume.elements_through_wall,
        }
        own = self.sweep.model_fields_set
        return self.sweep.model_copy(update={name: value for name, value in asked.items() if name not in own})

    @property
    def labels(self) -> dict[str, tuple[int, ...]]:
        """Label numbers by structure: the preset's, with those given by hand in their place."""
        return {**(PRESETS[self.preset] if self.preset else {}), **self.structures}


T = TypeVar("T", bound=StageOptions)


def choose(kind: type[T], options: T | None, changes: dict[str, Any]) -> T:
    """Options of one stage: those given (or the defaults) with the changes made, all checked.

    Raises
    ------
    OptionError
        A name is unknown or a value out of range; one line naming the option, the value and what was expected.
    """
    # Those given alone, so that what was left to the defaults can still be told from what was asked for.
    values = {name: getattr(options, name) for name in options.model_fields_set} if options is not None else {}
    try:
        return kind(**{**values, **changes})
    except ValidationError as error:
        raise OptionError(describe(error)) from None


def describe(error: ValidationError) -> str:
    """One line for what pydantic found: each option with its value and what it should be."""
    parts = []
    for item in error.errors():
        name = ".".join(str(part) for part in item["loc"])
        if item["type"] == "extra_forbidden":
            parts.append(f"unknown option {name!r}")
        else:
            parts.append(f"option {name!r} is {item['input']!r}: {item['msg'][:1].lower()}{item['msg'][1:]}")
    return "; ".join(parts)
