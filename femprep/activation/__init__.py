"""A mesh with fibres in; the same with Purkinje fibres on its endocardia and times of activation at its points out."""

from __future__ import annotations

from femprep.activation.purkinje import add_purkinje
from femprep.activation.times import add_activation

__all__ = ["add_activation", "add_purkinje"]
