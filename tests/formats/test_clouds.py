"""Point clouds: PLY, PCD, and plain text, written here byte by byte."""

import struct

import numpy as np
import pytest
from cloud_files import POINTS, array, failure, written

from metro.formats.errors import FormatError
from metro.formats.registry import read

ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}


def ply_header(encoding, properties, count=4, end="\n"):
    lines = ["ply", f"format {encoding} 1.0", "comment made by hand", f"element vertex {count}"]
    lines += [f"property {each}" for each in properties]
    lines += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    return (end.join(lines) + end).encode()


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(("kind", "code"), [("float", "f"), ("double", "d"), ("float64", "d")])
@pytest.mark.parametrize("encoding", ORDERS)
def test_binary_ply_of_either_byte_order_with_other_properties_and_faces(tmp_path, encoding, kind, code, end):
    properties = [f"{kind} x", "uchar red", f"{kind} y", f"{kind} z", "ushort quality"]
    record = struct.Struct(f"{ORDERS[encoding]}{code}B{code}{code}H")
    body = b"".join(record.pack(x, 200, y, z, 500) for x, y, z in POINTS)
    face = struct.pack(f"{ORDERS[encoding]}B3i", 3, 0, 1, 2)
    path = written(tmp_path, ply_header(encoding, properties, end=end) + body + face, "scan.ply")
    np.testing.assert_allclose(array(path), POINTS, rtol=1e-7 if code == "f" else 0)


def test_ascii_ply_with_other_properties_and_faces(tmp_path):
    body = "".join(f"{x} {y} 0 {z}\n" for x, y, z in POINTS) + "3 0 1 2\n"
    properties = ["double x", "double y", "float nx", "double z"]
    path = written(tmp_path, ply_header("ascii", properties) + body.encode(), "scan.ply")
    np.testing.assert_array_equal(array(path), POINTS)


XYZ = ("float x", "float y", "float z")
ASCII = "".join("1 2 3\n" for _ in POINTS).encode()


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (ply_header("binary_little_endian", XYZ) + b"\0" * 40, ["ends early", "found 3", "expected 4"]),
        (ply_header("binary_little_endian", XYZ), ["ends early", "found 0", "expected 4"]),
        (ply_header("ascii", XYZ) + b"1 2 3\n", ["ends early", "found 1", "expected 4"]),
        (ply_header("ascii", XYZ), ["ends early", "found 0", "expected 4"]),
        (ply_header("ascii", XYZ) + b"1 2 x\n" + ASCII, ["line 11, column z", "'x'"]),
        (ply_header("ascii", ["float x", "float y"]) + ASCII, ["lacks the column z_mm"]),
        (ply_header("ascii", []) + ASCII, ["vertex properties"]),
        (ply_header("ascii", [*XYZ, "float x"]) + ASCII, ["vertex properties", "each once"]),
        (ply_header("ascii", ["list uchar int x"]) + ASCII, ["line 5", "list uchar int x", "number type"]),
        (ply_header("ascii", ["real x"]) + ASCII, ["line 5", "real x"]),
        (ply_header("binary", XYZ) + ASCII, ["'binary'", "binary_big_endian"]),
        (ply_header("ascii", XYZ).replace(b"element vertex 4", b"element edge 4"), ["edge", "vertex before"]),
        (ply_header("ascii", XYZ).replace(b"comment made", b"made"), ["line 3", "'made by hand'"]),
        (ply_header("ascii", XYZ, count=2) + b"1 2 3\n" * 2 + b"3 0 1 2\n", ["found 2 rows", "at least 3"]),
    ],
)
def test_faults_of_a_ply_file_are_named(tmp_path, content, parts):
    message = failure(written(tmp_path, content, "scan.ply"))
    assert [part for part in parts if part not in message] == []


def pcd_header(data, fields="x y z", size="4 4 4", kind="F F F", count="1 1 1"):
    return (
        f"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {fields}\nSIZE {size}\n"
        f"TYPE {kind}\nCOUNT {count}\nWIDTH 4\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA {data}\n"
    ).encode()


def test_ascii_pcd(tmp_path):
    body = "".join(f"7 {x} {y} {z}\n" for x, y, z in POINTS).encode()
    header = pcd_header("ascii", "intensity x y z", "4 8 8 8", "F F F F", "1 1 1 1")
    np.testing.assert_array_equal(array(written(tmp_path, header + body, "scan.pcd")), POINTS)


def test_binary_pcd_with_padding_and_a_field_of_several_values(tmp_path):
    header = pcd_header("binary", "x y z _ normal rgb _", "8 8 8 1 4 4 1", "F F F U F U U", "1 1 1 4 3 1 2")
    record = struct.Struct("<ddd4B3fI2B")
    body = b"".join(record.pack(*point, 1, 2, 3, 4, 0.0, 0.0, 1.0, 255, 9, 9) for point in POINTS)
    np.testing.assert_array_equal(array(written(tmp_path, header + body, "scan.pcd")), POINTS)


def lzf_of_literals(data):
    return b"".join(bytes([len(data[k : k + 32]) - 1]) + data[k : k + 32] for k in range(0, len(data), 32))


def test_compressed_pcd(tmp_path):
    columns = POINTS.T.astype("<f4").tobytes()
    packed = lzf_of_literals(columns)
    body = struct.pack("<II", len(packed), len(columns)) + packed
    path = written(tmp_path, pcd_header("binary_compressed") + body, "scan.pcd")
    np.testing.assert_allclose(array(path), POINTS, rtol=1e-7)


def test_a_compressed_cloud_whose_columns_open3d_does_not_know_is_refused(tmp_path):
    columns = POINTS.T.astype("<f4").tobytes()
    packed = lzf_of_literals(columns)
    body = struct.pack("<II", len(packed), len(columns)) + packed
    path = written(tmp_path, pcd_header("binary_compressed", fields="x_mm y_mm z_mm") + body, "scan.pcd")
    with pytest.raises(FormatError, match="found the columns x_mm, y_mm, z_mm, expected x, y and z"):
        array(path)


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (pcd_header("binary") + b"\0" * 40, ["ends early", "found 3", "expected 4"]),
        (pcd_header("binary_compressed") + b"\1\0\0\0\1\0\0\0x", ["ends early", "expected 4"]),
        (pcd_header("ascii") + b"1 2 3\n", ["ends early", "found 1"]),
        (pcd_header("text"), ["DATA", "'text'", "binary_compressed"]),
        (pcd_header("binary", size="4 4"), ["disagree"]),
        (pcd_header("binary", kind="F F Q"), ["disagree"]),
        (pcd_header("binary", fields="x y t") + b"\0" * 48, ["lacks the column z_mm"]),
        (b"# .PCD v0.7\nVERSION 0.7\n", ["lacks FIELDS, SIZE, TYPE, POINTS, DATA"]),
    ],
)
def test_faults_of_a_pcd_file_are_named(tmp_path, content, parts):
    message = failure(written(tmp_path, content, "scan.pcd"))
    assert [part for part in parts if part not in message] == []


@pytest.mark.parametrize(
    ("before", "mark", "after", "suffix"),
    [
        ("", " ", "", "xyz"),
        ("", "   ", "", "asc"),
        ("", "\t", "", "txt"),
        ("", ",", "", "csv"),
        ("", ", ", "", "txt"),
        ("", ";", "", "txt"),
        ("# scan 3\n\n", " ", " 255 0 0", "xyz"),
        ("//X Y Z R G B\n4\n", " ", " 255 0 0", "asc"),
        ("X Y Z\n", " ", "", "txt"),
        ("x [mm],y [mm],z [mm]\n", ",", "", "csv"),
        ("\ufeffx_mm,y_mm,z_mm,quality\n", ",", ",good", "csv"),
    ],
)
def test_points_as_text(tmp_path, before, mark, after, suffix):
    body = "\r\n".join(mark.join(map(str, point.tolist())) + after for point in POINTS)
    np.testing.assert_array_equal(array(written(tmp_path, before + body, f"scan.{suffix}")), POINTS)


def test_a_header_says_which_columns_are_the_coordinates(tmp_path):
    body = "i,z,y,x\n" + "".join(f"{k},{z},{y},{x}\n" for k, (x, y, z) in enumerate(POINTS))
    np.testing.assert_array_equal(array(written(tmp_path, body, "scan.csv")), POINTS)


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        ("a b\nc d\n", ["no line of three numbers", "decimal points"]),
        ("1,5 2,5 3,5\n" * 5, ["no line of three numbers", "decimal points"]),
        ("1 2 3\n" * 5 + "1 2,5 3\n", ["line 6, column y", "'2,5'", "decimal point"]),
        ("1 2 3\n" * 5 + "1 2 3 4\n", ["line 6", "4 fields", "expected 3"]),
        ("x_m,y_m,z_m\n" + "1,2,3\n" * 5, ["column x_m", "coordinates in m", "expected mm"]),
        ("1 2 3\n1 2 3\n", ["found 2 rows", "at least 3"]),
    ],
)
def test_faults_of_points_as_text_are_named(tmp_path, content, parts):
    message = failure(written(tmp_path, content, "scan.txt"))
    assert [part for part in parts if part not in message] == []


def test_points_without_coordinates_are_dropped_and_counted(tmp_path):
    path = written(tmp_path, "1 2 3\nnan nan nan\n4 5 6\n7 8 nan\n7 8 9\n", "scan.xyz")
    table = read(path, "cloud")
    assert table["x_mm"].tolist() == [1.0, 4.0, 7.0]
    assert table.index.tolist() == [0, 1, 2]
    assert table.attrs["dropped"] == 2
