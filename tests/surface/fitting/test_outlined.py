"""A template on the outline of an object: where it folds, the line says what to do."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from femprep.errors import StageError
from femprep.phantoms import lv_ellipsoid
from femprep.surface.fitting import outlined


def test_a_folded_template_is_told_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outlined, "placed_or_flipped", lambda *_: SimpleNamespace(folded=3))
    obj = lv_ellipsoid().segmentation((2.5, 2.5, 8.0)).object("lv")
    with pytest.raises(StageError, match=r"folds on the outline of 'lv'; give more"):
        outlined.outline_surface(obj, 100)
