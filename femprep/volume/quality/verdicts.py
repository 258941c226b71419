"""Values and their limits in, a record of each and the words for those that are missed out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from femprep.volume.quality.report import LimitRecord, QualityReport


@dataclass
class Verdicts:
    """Limits that values were held to.

    Attributes
    ----------
    limits : list of LimitRecord
    failures : list of str
        What is said of those that are missed.
    """

    limits: list[LimitRecord] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def misses(
        self, name: str, kind: Literal["at least", "at most", "exactly"], limit: float | None, value: float | None
    ) -> bool:
        """Hold a value to a limit, where there are both; whether it misses it."""
        if limit is None or value is None:
            return False
        passed = {"at least": value >= limit, "at most": value <= limit, "exactly": value == limit}[kind]
        self.limits.append(LimitRecord(name=name, kind=kind, limit=limit, value=value, passed=passed))
        return not passed

    def compare(
        self,
        name: str,
        kind: Literal["at least", "at most"],
        limit: float | None,
        value: float | None,
        what: str,
        place: str = "",
    ) -> None:
        """Hold a value to a limit, where there are both, and say what misses it by how much, and where."""
        if self.misses(name, kind, limit, value):
            self.failures.append(f"{what} is {value:.4g}{place}, asked for is {kind} {limit:g}")

    def on(self, report: QualityReport, **more: Any) -> QualityReport:
        """A report with these, and other fields in place of its own."""
        limits, failures = (*report.limits, *self.limits), (*report.failures, *self.failures)
        return report.model_copy(update={"limits": limits, "failures": failures, **more})
