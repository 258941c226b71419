"""What a page shows of a refined mesh."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres

from femprep.mesh.measures.volume_elements import element_volumes
from femprep.report.pictures.scene import scene
from femprep.report.pictures.shown import shown
from femprep.volume import check
from femprep.volume.refine import Refinement


def test_a_small_mesh_and_one_from_nowhere_are_shown_as_they_are():
    mesh = truncated_ellipsoid("tetra")
    for most in (mesh.n_cells, 10):
        found = shown(mesh, most)
        assert found.mesh is mesh
        assert found.note == ""
        assert found.element(7) == 7


def test_of_a_refined_mesh_the_coarser_one_is_shown_with_its_fields():
    nested = Refinement.of(truncated_ellipsoid("tetra"), 1)
    fine = with_fibres(nested.fine)
    fine = fine.with_data(cell={"aha": np.where(np.arange(fine.n_cells) < 3, 1, 2)})
    found = shown(fine, nested.coarse.n_cells)
    assert found.mesh.n_cells == nested.coarse.n_cells
    assert str(fine.n_cells) in found.note
    assert found.element(17) == 2
    worst = found.whole["minimum_dihedral"].reshape(-1, 8).min(axis=1)
    assert np.array_equal(found.fields["minimum_dihedral"], worst)
    volume = element_volumes(fine.points, fine.cells["tetra"], "tetra").reshape(-1, 8)
    mean = (volume * found.whole["thickness"].reshape(-1, 8)).sum(axis=1) / volume.sum(axis=1)
    assert found.fields["thickness"] == pytest.approx(mean, rel=1e-12)
    assert found.mesh.cell_data["aha"].tolist() == [2] * found.mesh.n_cells  # three of eight parts are too few
    fibre = np.asarray(found.mesh.cell_data["fiber"])
    along = np.abs(np.einsum("ij,ij->i", np.repeat(fibre, 8, axis=0), fine.cell_data["fiber"]))
    assert np.linalg.norm(fibre, axis=1) == pytest.approx(1.0)
    assert np.median(along) > 0.95


def test_the_view_names_worst_elements_by_those_that_it_shows():
    nested = Refinement.of(truncated_ellipsoid("tetra"), 1)
    quality = check(nested.fine)
    found = scene(shown(nested.fine, nested.coarse.n_cells), quality)
    assert [one["element"] for one in found["worst"]] == [one.element // 8 for one in quality.worst]
    assert found["note"].startswith("Shown are")
