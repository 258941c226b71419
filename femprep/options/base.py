"""What all option groups share, and how a stage takes them: the options given, with changes by name."""

from __future__ import annotations

from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from femprep.errors import OptionError

#: What is done with input that has to be mended: mend and report, or refuse.
Policy = Literal["repair", "strict"]


class StageOptions(BaseModel):
    """Base of all option groups: frozen, no unknown names, no NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)


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
        elif item["type"] == "value_error" and not name:  # options that do not go together
            parts.append(str(item["ctx"]["error"]))
        else:
            parts.append(f"option {name!r} is {item['input']!r}: {item['msg'][:1].lower()}{item['msg'][1:]}")
    return "; ".join(parts)
