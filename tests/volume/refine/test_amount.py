"""More levels than fit into memory are refused before the first, with how many do."""

from __future__ import annotations

import pytest
from meshes import truncated_ellipsoid

from femprep.errors import ResourceError
from femprep.volume.refine import amount, refine


@pytest.mark.parametrize(("levels", "times", "words"), [(6, 70, "at most 2 levels"), (1, 7, "of fewer elements")])
def test_levels_beyond_memory(levels: int, times: int, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = truncated_ellipsoid("wedge")
    monkeypatch.setattr(amount, "memory", lambda: times * 90 * 6 * mesh.n_cells)
    monkeypatch.setattr("femprep.volume.refine.refinement.step", None)  # nothing is begun
    with pytest.raises(ResourceError, match=rf"^{mesh.n_cells} elements refined {levels} times are .* {words}$"):
        refine(mesh, levels)


def test_levels_that_fit_and_machines_that_do_not_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = truncated_ellipsoid("wedge")
    monkeypatch.setattr(amount, "memory", lambda: 64 * 90 * 6 * mesh.n_cells)
    amount.check_levels(mesh, 2)
    monkeypatch.setattr(amount, "memory", lambda: None)
    amount.check_levels(mesh, 6)
