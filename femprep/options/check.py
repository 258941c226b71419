"""Limits a mesh is judged by: the defaults, and those of a mesher and of a purpose."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from femprep.options.base import StageOptions

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

    Examples
    --------
    >>> fp.CheckOptions(purpose="implicit").resolved().minimum_mean_ratio
    0.2
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
    mean_label_distance: float | None = Field(
        0.35, gt=0, description="Largest mean distance of a surface from the labels' outlines in the slices, pixels."
    )
    maximum_label_distance: float | None = Field(
        2.0, gt=0, description="Largest distance of a surface from the labels' outline in any slice, pixels."
    )
    mean_surface_distance: float | None = Field(
        0.35, gt=0, description="Largest mean distance of facets from the surface that was given for them, mm."
    )
    maximum_surface_distance: float | None = Field(
        2.5, gt=0, description="Largest distance of facets from the surface that was given for them, mm."
    )
    maximum_wall_volume_difference: float | None = Field(
        10.0,
        gt=0,
        description="Largest difference between the volume of the left ventricle's wall and that of its labels, per "
        "cent; tissue extrapolated beyond the last slice at the apex does not count. Judged where the labels are.",
    )
    plane_tolerance: float = Field(
        1e-9, gt=0, description="How far points of base and apex facets may lie from their plane, mm."
    )
    worst: int = Field(10, ge=0, le=1000, description="How many of the worst elements are listed, per measure.")

    def resolved(self, mesher: str = "tetwild") -> CheckOptions:
        """Limits with those of the purpose, else of the mesher, for every one that was not given.

        Examples
        --------
        >>> fp.CheckOptions(purpose="explicit").resolved().purpose
        'explicit'
        """
        given = {name: getattr(self, name) for name in self.model_fields_set}
        return CheckOptions(**{**MESHER_LIMITS[mesher], **PURPOSE_LIMITS[self.purpose], **given})
