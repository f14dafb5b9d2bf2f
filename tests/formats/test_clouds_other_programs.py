"""Point clouds as other programs write them: Open3D (PLY, PCD, PTS, XYZ, STL) and libE57Format (E57)."""

import numpy as np
import open3d
import pye57
import pytest
from cloud_files import POINTS, array

OPTIONS = {"binary": {}, "ascii": {"write_ascii": True}, "compressed": {"compressed": True}}


@pytest.mark.parametrize(
    ("name", "form"),
    [
        *(("a.ply", form) for form in ("binary", "ascii")),
        *(("a.pcd", form) for form in OPTIONS),
        *(("a" + ending, "ascii") for ending in (".pts", ".xyz")),
    ],
)
def test_a_cloud_that_open3d_writes_is_read(tmp_path, name, form):
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(POINTS))
    cloud.colors = open3d.utility.Vector3dVector(np.full_like(POINTS, 0.5))
    assert open3d.io.write_point_cloud(str(tmp_path / name), cloud, **OPTIONS[form])
    np.testing.assert_allclose(array(tmp_path / name), POINTS, rtol=1e-6, atol=1e-9)


def test_a_mesh_that_open3d_writes_is_read_as_its_corners(tmp_path):
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(POINTS), open3d.utility.Vector3iVector([[0, 1, 2], [0, 2, 3]])
    )
    mesh.compute_triangle_normals()
    assert open3d.io.write_triangle_mesh(str(tmp_path / "a.stl"), mesh)
    found = array(tmp_path / "a.stl")
    assert len(np.unique(found, axis=0)) == len(POINTS)
    np.testing.assert_allclose(
        np.sort(np.unique(found, axis=0), axis=0), np.sort(POINTS, axis=0), rtol=1e-6, atol=1e-9
    )


def test_a_scan_that_lib_e57_format_writes_is_read(tmp_path):
    with pye57.E57(str(tmp_path / "a.e57"), mode="w") as file:
        metres = {f"cartesian{axis}": POINTS[:, i] * 1e-3 for i, axis in enumerate("XYZ")}
        file.write_scan_raw(metres, name="face")
    np.testing.assert_allclose(array(tmp_path / "a.e57"), POINTS, rtol=1e-6, atol=1e-9)  # single precision
