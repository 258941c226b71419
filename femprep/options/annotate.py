"""Options of annotating a mesh that is there already."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator

from femprep.model.tags import FACET_TAGS, REGION_TAGS
from femprep.options.base import StageOptions
from femprep.options.check import CheckOptions
from femprep.options.export import ExportOptions
from femprep.options.fibres import FibreOptions


class AnnotateOptions(StageOptions):
    """Naming the facets and regions of anyone's mesh.

    Examples
    --------
    >>> fp.AnnotateOptions(names={"4": "epi"}).unit
    'auto'
    """

    unit: Literal["auto", "mm", "cm", "m", "um"] = Field(
        "auto",
        description="Unit of length of the mesh file. By default the one that the file states, else the one in which "
        "the mesh is of a heart's size.",
    )
    anatomy: Literal["auto", "left-atrium", "right-atrium"] = Field(
        "auto",
        description="What the mesh is, where an atrium alone is not recognised; its valve is the widest opening.",
    )
    names: dict[str, str] = Field(
        default_factory=dict,
        description="Names of ours by the numbers or names the file has, of facets (endo, epi, base...) and of regions "
        "(lv, rv, septum...).",
    )
    at: dict[str, tuple[float, float, float]] = Field(
        default_factory=dict,
        description="Where two readings are possible: a point, in the file's own coordinates, on or near the facets of "
        "each name.",
    )
    base: tuple[float, float, float, float, float, float] | None = Field(
        None,
        description="Base plane, where the mesh has no flat base nor one with sharp rims: point x, y, z and normal "
        "x, y, z out of the ventricle, in the file's own coordinates.",
    )
    formats: tuple[str, ...] = Field((), description="Further file formats of the mesh beside mesh.vtu.")
    fibres: FibreOptions | None = Field(
        FibreOptions(), description="Ventricular coordinates, AHA segments and fibres; none where null."
    )
    check: CheckOptions = CheckOptions()
    export: ExportOptions = ExportOptions()

    @field_validator("names")
    @classmethod
    def _ours(cls, value: dict[str, str]) -> dict[str, str]:
        for name in value.values():
            if name not in FACET_TAGS and name not in REGION_TAGS:
                raise ValueError(f"{name!r} is none of {', '.join([*FACET_TAGS, *REGION_TAGS])}")
        return value

    @field_validator("at")
    @classmethod
    def _facets(cls, value: dict[str, tuple[float, float, float]]) -> dict[str, tuple[float, float, float]]:
        for name in value:
            if name not in FACET_TAGS:
                raise ValueError(f"{name!r} is no name of facets; choose from {', '.join(FACET_TAGS)}")
        return value
