"""What all tests share: where the real segmentations are."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def _data() -> Path | None:
    name = os.environ.get("FEMPREP_DATA")
    return Path(name) if name and Path(name).is_dir() else None


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of the real segmentations; the test is skipped where FEMPREP_DATA is unset."""
    folder = _data()
    if folder is None:
        pytest.skip("FEMPREP_DATA is unset: no real segmentations")
    return folder
