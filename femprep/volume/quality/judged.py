"""A mesh and limits given by hand in, the limits it is judged by out, and where they come from: one verdict anywhere.

The limits a mesh was judged by when it was made travel with it (:mod:`femprep.model.verdict`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

from femprep.errors import InputError, OptionError
from femprep.mesh.length_unit import is_external
from femprep.model import VolumeMesh, verdict_of, with_verdict
from femprep.options import CheckOptions, choose
from femprep.options.check import MESHER_LIMITS

#: Options of the check that are no limits.
_NO_LIMITS = {"worst"}
#: Limits that can be left out.
_LIMITS = [name for name, field in CheckOptions.model_fields.items() if type(None) in get_args(field.annotation)]


def limits_for(mesh: VolumeMesh, given: CheckOptions) -> tuple[CheckOptions, str]:
    """Limits for a mesh, and where they come from.

    Those given by hand win. For the others: those the mesh carries, unless a purpose is given; else those of the
    purpose, of the mesher that made the mesh, the defaults. A mesh of another program has none without a purpose.

    Raises
    ------
    InputError
        What the mesh carries are no limits.
    """
    own = verdict_of(mesh)
    mesher = own.get("mesher") if own.get("mesher") in MESHER_LIMITS else None
    by_hand = sorted(given.model_fields_set - {"purpose"} - _NO_LIMITS)
    made = f", mesher {mesher}" if mesher else ""
    hand = f"; given by hand: {', '.join(by_hand)}" if by_hand else ""
    if "limits" in own and "purpose" not in given.model_fields_set:
        limits = _with(own["limits"], given)
        source = "the mesh's own, by which it was judged when it was made"
    elif mesher is None and is_external(mesh) and "purpose" not in given.model_fields_set:
        limits = CheckOptions(**{**dict.fromkeys(_LIMITS), **_given(given)})
        return limits, f"none for a mesh of another program{hand}"
    else:
        limits = given.resolved(mesher or "tetwild")
        source = "the defaults"
    return limits, f"{source} (purpose {limits.purpose}{made}){hand}"


def _with(carried: Mapping[str, Any], given: CheckOptions) -> CheckOptions:
    """Limits a mesh carries with those given by hand in their place; names of another version are left out."""
    known = {name: value for name, value in carried.items() if name in CheckOptions.model_fields}
    try:
        return choose(CheckOptions, choose(CheckOptions, None, known), _given(given))
    except OptionError as error:
        raise InputError(f"the limits that the mesh carries are wrong: {error}; give it a purpose") from None


def _given(options: CheckOptions) -> dict[str, Any]:
    return {name: getattr(options, name) for name in options.model_fields_set}


def carry(mesh: VolumeMesh, limits: CheckOptions, mesher: str, labels: Sequence[str] = ()) -> VolumeMesh:
    """The mesh with the limits it was judged by, as any later check, and any file that can hold them, has them.

    ``labels`` are failures against the labels it was made from, which a check of the mesh alone cannot find.
    """
    failures = {**verdict_of(mesh).get("failures", {}), **({"labels": list(labels)} if labels else {})}
    more: dict[str, Any] = {"failures": failures} if failures else {}
    return with_verdict(mesh, mesher=mesher, limits=limits.model_dump(mode="json", exclude=_NO_LIMITS), **more)


def carried_failures(mesh: VolumeMesh) -> tuple[str, ...]:
    """Lines of what failed when the mesh was made, and is not to be found by judging it alone."""
    return tuple(line for lines in verdict_of(mesh).get("failures", {}).values() for line in lines)
