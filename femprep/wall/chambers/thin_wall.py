"""The wall of a cavity within an envelope of bodies in, where it is thinner than allowed out: a record or a refusal."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

from femprep.errors import Advice, InputError
from femprep.model import Notice, Surface, noted
from femprep.model.notice import spot
from femprep.options import WallOptions
from femprep.options.advice import MEND
from femprep.wall.chambers.envelope import Envelope, Part

logger = logging.getLogger(__name__)


def thin_wall(bodies: Sequence[Part], name: str, cavity: Surface, options: WallOptions) -> dict[str, Any] | None:
    """Where the wall of a cavity is thinner than ``minimum_thickness`` within some bodies; None where nowhere.

    Returns
    -------
    dict or None
        JSON-ready: ``thickened`` (the cavity), the share of its vertices, the least thickness and where.

    Raises
    ------
    InputError
        With ``policy="strict"``, where it is.
    """
    depth = -Envelope(bodies).values(cavity.points)
    thin = depth < options.minimum_thickness
    if not thin.any():
        return None
    worst = int(depth.argmin())
    if options.policy == "strict":
        raise InputError(
            f"the wall of {name!r} is {depth[worst]:.2f} mm thick near {spot(cavity.points[worst])}, below "
            f"minimum_thickness = {options.minimum_thickness:g} mm",
            advice=[MEND, Advice("--policy repair", "wall.policy", "repair")],
        )
    logger.warning("the wall of %s is thickened at %.0f %% of its vertices", name, 100 * thin.mean())
    share = float(thin.mean())
    much = "less than 1" if share < 0.005 else f"{100 * share:.0f}"
    lacking = f"is {depth[worst]:.1f} mm thick" if depth[worst] >= 0.0 else "is missing"
    words = (
        f"the wall of cavity {name} is thinner than {options.minimum_thickness:g} mm over {much} % of the cavity "
        f"({lacking} near {{place}}): it was thickened outwards by up to {{amount}}"
    )
    amount = options.minimum_thickness - float(depth[worst])
    record = {
        "thickened": name,
        "share_of_vertices": float(thin.mean()),
        "thickness_before_mm": float(depth[worst]),
        "thickness_after_mm": options.minimum_thickness,
        "worst_at_mm": [round(float(x), 3) for x in cavity.points[worst]],
    }
    return noted(record, Notice.of("repaired", words, amount=amount, unit="mm", place=cavity.points[worst]))
