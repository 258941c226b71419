"""A volume mesh in, what was said of it when it was made out: limits it was judged by, parts that could not be made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from femprep.model.volume_mesh import VolumeMesh

#: Key of ``VolumeMesh.info`` for it: ``mesher`` (a key of ``MESHER_LIMITS``), ``limits`` (of ``CheckOptions`` by name)
#: and ``failures`` (lines by the part that failed), which a later check of the mesh alone could not find.
VERDICT: Final = "verdict"


def verdict_of(mesh: VolumeMesh) -> dict[str, Any]:
    """What travels with a mesh; of one that was swept and not judged yet the mesher, of others' nothing."""
    if VERDICT in mesh.info:
        return dict(mesh.info[VERDICT])
    return {"mesher": "sweep"} if mesh.info.get("mesher") == "sweep" else {}


def with_verdict(mesh: VolumeMesh, **more: Any) -> VolumeMesh:
    """Copy of a mesh that carries more of its verdict: ``mesher``, ``limits``, ``failures``."""
    return replace(mesh, info={**mesh.info, VERDICT: {**verdict_of(mesh), **more}})


def with_failure(mesh: VolumeMesh, part: str, line: str) -> VolumeMesh:
    """Copy of a mesh that goes without a part that could not be made, and says why."""
    return with_verdict(mesh, failures={**verdict_of(mesh).get("failures", {}), part: [line]})


def without_failure(info: Mapping[str, Any], part: str) -> dict[str, Any]:
    """``info`` of a mesh to which a part was added that could not be made before."""
    found = dict(info)
    if part in found.get(VERDICT, {}).get("failures", {}):
        failures = {name: line for name, line in found[VERDICT]["failures"].items() if name != part}
        found[VERDICT] = {**found[VERDICT], "failures": failures}
    return found
