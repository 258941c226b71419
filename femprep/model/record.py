"""The base of all records of figures."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Record(BaseModel):
    """Base of all records: frozen, no unknown names."""

    model_config = ConfigDict(frozen=True, extra="forbid")
