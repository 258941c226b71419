"""Options of volume meshing, and what each quality asks of the mesh and of fTetWild."""

from __future__ import annotations

from typing import Literal, NamedTuple

from pydantic import Field

from femprep.options.base import StageOptions


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


#: Targets by the name of a quality; measured figures stand in docs/algorithms/tetwild.md.
QUALITY: dict[str, MeshTargets] = {
    "fast": MeshTargets(10.0, 0.80, 50.0, 0.1, 1, 20.0),
    "good": MeshTargets(15.0, 0.85, 10.0, 0.05, 2, 25.0),
    "best": MeshTargets(20.0, 0.87, 6.0, 0.05, 2, 30.0),
}


class VolumeOptions(StageOptions):
    """Filling the wall with elements.

    Examples
    --------
    >>> fp.VolumeOptions(quality="best").targets.minimum_dihedral
    20.0
    """

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
    refinement: Literal["auto", "none"] = Field(
        "auto",
        description="Whether fTetWild makes elements as large as the wall bears, which are then cut into eight until "
        "they are as small as asked for (auto), or makes the mesh itself (none).",
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
        description="How far the mesher may leave the wall's surface, mm. By run if not given, as run.json tells: a "
        "twentieth of the edge length (fast: a tenth), a tenth of the length before refinement, .15 where edges "
        "are longer than the wall is thick in the mean and its sheets farther apart than that everywhere, and after a "
        "run that missed the quality.",
    )
    stop_energy: float | None = Field(
        None,
        ge=4,
        le=1000,
        description="Shape energy at which the mesher stops improving elements: 3 is a regular tetrahedron, lower is "
        "better and slower; below 6 it may never be reached. By quality if not given: 50, 10 or 6; 35, 7 or 6 where "
        "the envelope is .15 edge lengths for edges longer than the wall is thick.",
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
    time_limit: float = Field(
        600.0,
        gt=0,
        description="Longest processor time of any run of the mesher, s; four times its estimate is enough for most.",
    )
    memory_limit: float = Field(8.0, gt=0, description="Largest memory the mesher may need, GB.")

    @property
    def targets(self) -> MeshTargets:
        """What is asked of the mesh and the mesher's parameters: those given, else those of the quality.

        Examples
        --------
        >>> fp.VolumeOptions(quality="best").targets.minimum_dihedral
        20.0
        """
        names = ("minimum_dihedral", "mean_ratio", "stop_energy", "retries")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return QUALITY[self.quality]._replace(**given)

    @property
    def largest_edge(self) -> float | None:
        """Largest edge length where the length varies, mm; None where nobody gave one.

        Examples
        --------
        >>> fp.VolumeOptions(edge_length=3.0).largest_edge
        3.0
        """
        return self.edge_length if "edge_length" in self.model_fields_set else None
