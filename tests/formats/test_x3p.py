"""X3P profiles, written here from ISO 25178-72 (and its forerunner ISO 5436-2)."""

import hashlib
import struct
import zipfile

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.registry import read, sniff

HEIGHTS = np.array([0.0, 1e-6, -2e-6, 3.5e-6, 0, 1e-6, 2e-6, 3e-6, 4e-6, 5e-6])  # m
NAMESPACE = "http://www.opengps.eu/2008/ISO5436_2"


def x3p(path, heights=HEIGHTS, feature="PRF", shape=(10, 1, 1), digest=None):
    data = struct.pack(f"<{len(heights)}d", *heights)
    found = digest or hashlib.md5(data).hexdigest()
    x = "<AxisType>I</AxisType><DataType>D</DataType><Increment>5e-7</Increment><Offset>0</Offset>"
    z = "<AxisType>A</AxisType><DataType>D</DataType><Increment>1</Increment><Offset>0</Offset>"
    sizes = "".join(f"<Size{n}>{v}</Size{n}>" for n, v in zip("XYZ", shape, strict=True))
    text = (
        f'<?xml version="1.0" encoding="UTF-8"?><p:ISO5436_2 xmlns:p="{NAMESPACE}"><Record1>'
        f"<Revision>ISO5436 - 2000</Revision><FeatureType>{feature}</FeatureType>"
        f"<Axes><CX>{x}</CX><CY>{x}</CY><CZ>{z}</CZ></Axes></Record1>"
        f"<Record3><MatrixDimension>{sizes}</MatrixDimension>"
        f"<DataLink><PointDataLink>bindata/data.bin</PointDataLink><MD5ChecksumPointData>{found}"
        "</MD5ChecksumPointData></DataLink></Record3>"
        "<Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4></p:ISO5436_2>"
    ).encode()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", text)
        archive.writestr("bindata/data.bin", data)
        archive.writestr("md5checksum.hex", f"{hashlib.md5(text).hexdigest()} *main.xml\n")
    return path


def failure(path, kind="profile"):
    with pytest.raises(FormatError) as caught:
        read(path, kind)
    return caught.value.message


def test_a_profile_is_read_in_millimetres(tmp_path):
    path = x3p(tmp_path / "trace.x3p")
    sniff(path, "profile")
    table = read(path, "profile")
    assert list(table) == ["x_mm", "z_mm"]
    np.testing.assert_allclose(table["x_mm"], np.arange(10) * 5e-4, rtol=1e-12)
    np.testing.assert_allclose(table["z_mm"], HEIGHTS * 1e3, rtol=1e-15)


def test_points_not_measured_at_the_ends_are_left_out_and_elsewhere_an_error(tmp_path):
    ends = np.where(np.arange(10) % 9 == 0, np.nan, HEIGHTS)
    assert len(read(x3p(tmp_path / "ends.x3p", ends), "profile")) == 8
    inside = np.where(np.arange(10) == 4, np.nan, HEIGHTS)
    message = failure(x3p(tmp_path / "inside.x3p", inside))
    assert message == "point 5, column z_mm: found nothing or NaN, expected a finite number"


def test_faults_of_an_x3p_file_are_named(tmp_path):
    good = x3p(tmp_path / "good.x3p").read_bytes()
    torn = tmp_path / "torn.x3p"
    torn.write_bytes(good[: len(good) // 2])
    assert "is not a readable X3P file" in failure(torn)
    newer = bytearray(good)
    newer[good.index(b"PK\x01\x02") + 6] = 84  # the version that unpacks the first member
    torn.write_bytes(newer)
    assert "zip file version 8.4" in failure(torn)
    longer = bytearray(good)
    place = good.index(b"PK\x01\x02")
    longer[place + 10] = 0  # not packed
    for at in (20, 24):  # and of a size, packed and unpacked, that is past the end of the file
        longer[place + at : place + at + 4] = (1 << 20).to_bytes(4, "little")
    torn.write_bytes(longer)
    assert "is not a readable X3P file" in failure(torn)
    assert "is not a readable X3P file" in failure(x3p(tmp_path / "sum.x3p", digest="0" * 32))
    assert "found a surface" in failure(x3p(tmp_path / "map.x3p", feature="SUR", shape=(5, 2, 1)))
    assert "2 layers, expected one" in failure(x3p(tmp_path / "two.x3p", shape=(5, 1, 2)))
    assert "found a profile of ISO 25178-72, expected a point cloud" in failure(
        tmp_path / "good.x3p", "cloud"
    )


def test_an_archive_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("metro.formats.limits.LARGEST_ARCHIVE", 100)
    assert "expected at most 100" in failure(x3p(tmp_path / "bomb.x3p"))


def test_a_surface_is_a_cloud_in_millimetres_without_the_points_that_were_not_measured(tmp_path):
    heights = np.where(np.arange(10) == 3, np.nan, HEIGHTS)
    path = x3p(tmp_path / "face.x3p", heights, feature="SUR", shape=(5, 2, 1))
    sniff(path, "cloud")
    table = read(path, "cloud")
    assert len(table) == 9
    assert table.attrs["dropped"] == 1
    np.testing.assert_allclose(table["x_mm"][:4], np.array([0, 1, 2, 4]) * 5e-4, rtol=1e-12)
    np.testing.assert_allclose(table["y_mm"].iloc[-1], 5e-4, rtol=1e-12)
    np.testing.assert_allclose(table["z_mm"].iloc[-1], HEIGHTS[9] * 1e3, rtol=1e-15)
