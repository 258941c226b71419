"""What long work tells of itself."""

from __future__ import annotations

from collections.abc import Callable

#: Told the stage and the fraction of it that is done.
Progress = Callable[[str, float], None]
