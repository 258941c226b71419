"""Two surfaces in, the vertices of one cup on both out: on a coarse cup first and on finer ones from there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from femprep.mesh.patches import PatchSurface, plane_table
from femprep.model import Plane
from femprep.options import SweepOptions
from femprep.sweeping.cup.cup import Cup
from femprep.sweeping.matching.axial import Axial
from femprep.sweeping.matching.interpolation import carry_over, scatter
from femprep.sweeping.matching.relax import Relaxation
from femprep.sweeping.matching.resolution import HEIGHT

#: Sweeps: on the coarsest cup, between, and on the finest.
_SWEEPS: Final = (40, 12, 6)


@dataclass(frozen=True)
class Cups:
    """What vertices are put on two surfaces with.

    Attributes
    ----------
    axial : Axial
        How the surfaces are seen from the long axis.
    planes : mapping of str to Plane
        Where the wall ends.
    levels : list of Cup
        From the coarsest to the finest.
    layers : int
        Layers of elements between the surfaces.
    options : SweepOptions
    """

    axial: Axial
    planes: Mapping[str, Plane]
    levels: list[Cup]
    layers: int
    options: SweepOptions

    def match(
        self, surfaces: tuple[PatchSurface, PatchSurface], tell: Callable[[float], None]
    ) -> tuple[Relaxation, list[int]]:
        """Vertices of the finest cup on both surfaces, and the sweeps that were made on each cup."""
        table = plane_table(self.planes.values())
        clouds = [self.axial.cloud(s.points, s.triangles) for s in surfaces]
        positions = [scatter(disk, points, self.levels[0].disk) for disk, points in clouds]
        finest = self.levels[-1]
        sweeps: list[int] = []
        for number, cup in enumerate(self.levels):
            if number:
                positions = [carry_over(self.levels[number - 1], p, cup) for p in positions]
            last = cup is finest
            wider = finest.columns / cup.columns
            thin = self.layers if last else max(round(self.layers / wider), 1)
            state = Relaxation(
                cup,
                surfaces,
                table,
                height=HEIGHT[cup.cells.shape[1]] * self.layers / wider / thin,
                split=last and self.options.element == "tetra",
                layers=thin,
                edge=self.options.edge_length * wider,
                grading=self.options.grading,
                places=positions,
            )
            sweeps.append(state.run(_SWEEPS[0] if number == 0 else _SWEEPS[2] if last else _SWEEPS[1]))
            positions = state.places
            tell((number + 1) / len(self.levels))
        return state, sweeps
