"""A real LV the whole way: axes from its labels, then coordinates, segments and fibres on the mesh made from them."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.anatomy import WallFields, add_aha, add_coordinates, add_fibres, ventricular_axes
from femprep.anatomy.fibres import helix_angle
from femprep.anatomy.rules import node_fields


@pytest.mark.data
@pytest.mark.slow
def test_acdc_left_ventricle(data):
    from femprep import read_segmentation
    from femprep.pipeline import mesh_segmentation

    seg = read_segmentation(data / "acdc/training/patient007/patient007_frame01_gt.nii.gz", preset="acdc")
    mesh = mesh_segmentation(seg, volume={"edge_length": 4.0}).mesh
    axes = ventricular_axes(seg)
    assert axes.mirrored is True
    assert np.degrees(np.arccos(ventricular_axes(mesh).long_axis @ axes.long_axis)) < 5.0

    fields = WallFields(mesh, axes)
    mesh = add_fibres(add_aha(add_coordinates(mesh, fields=fields), fields=fields), fields=fields, nodes=True)
    assert mesh.info["aha"]["empty"] == []
    volumes = mesh.info["aha"]["volumes_mm3"]
    assert sum(volumes.values()) == pytest.approx(fields.space.volume.sum(), rel=1e-6)
    assert min(volumes.values()) > 0.02 * sum(volumes.values())

    for field, distance in ((fields.across, fields.across_distance), (fields.upward, fields.upward_distance)):
        along = np.sum(fields.space.gradient(field) * fields.space.gradient(distance), axis=1)
        assert np.mean(along <= 0) < 1e-3

    for table in (mesh.cell_data, mesh.point_data):
        triads = np.stack([table[name] for name in ("fiber", "sheet", "normal")], axis=2)
        assert np.abs(np.einsum("nij,nik->njk", triads, triads) - np.eye(3)).max() < 1e-10
    assert mesh.info["fibres"]["mirrored"] is True
    assert mesh.info["fibres"]["depth_angle_correlation"]["lv"] < -0.99
    sites = node_fields(fields).each(fields.space.to_cells)
    angle = -helix_angle(mesh.cell_data["fiber"], sites.to_base, -sites.to_across)  # the heart is mirrored
    assert angle == pytest.approx(60 - 120 * mesh.cell_data["transmural"], abs=1e-6)
