"""Clouds read piece by piece: the same points, places and faults as read at once."""

import struct

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.registry import read, read_pieces

POINTS = np.random.default_rng(3).normal(size=(1000, 3)).astype(np.float32).astype(np.float64)
LINES = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in POINTS.tolist())


def ply(encoding, body):
    header = f"ply\nformat {encoding} 1.0\nelement vertex 1000\nproperty float x\nproperty float y\n"
    return (
        f"{header}property float z\nelement face 1\nproperty list uchar int i\nend_header\n".encode() + body
    )


def pcd(data, body):
    header = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1000\nHEIGHT 1\nPOINTS 1000\n"
    return f"{header}DATA {data}\n".encode() + body


def stl():
    facets = [struct.pack("<12fH", 0, 0, 0, *facet.ravel(), 0) for facet in POINTS[:999].reshape(-1, 3, 3)]
    return bytes(80) + struct.pack("<I", len(facets)) + b"".join(facets)


BINARY = POINTS.astype("<f4").tobytes()
FILES = {
    "binary.ply": ply("binary_little_endian", BINARY + b"\3" + bytes(12)),
    "ascii.ply": ply("ascii", LINES.encode() + b"3 0 1 2\n"),
    "binary.pcd": pcd("binary", BINARY),
    "ascii.pcd": pcd("ascii", LINES.encode()),
    "scan.xyz": b"x y z\n" + LINES.encode(),
    "scan.pts": b"1000\n" + LINES.encode(),
    "scan.stl": stl(),
}


@pytest.fixture(params=sorted(FILES))
def path(request, tmp_path):
    file = tmp_path / request.param
    file.write_bytes(FILES[request.param])
    return file


@pytest.mark.parametrize("rows", [1000, 999, 333, 64])
def test_the_pieces_are_the_whole(path, rows):
    pieces = list(read_pieces(path, "cloud", rows))
    whole = read(path, "cloud").to_numpy()
    np.testing.assert_array_equal(np.vstack([piece.to_numpy() for piece in pieces]), whole)
    assert max(map(len, pieces)) <= rows
    if path.suffix != ".stl":
        np.testing.assert_array_equal(whole, POINTS)


@pytest.mark.parametrize("name", ["ascii.ply", "ascii.pcd", "scan.xyz", "scan.pts"])
def test_a_fault_in_a_later_piece_is_named_by_its_line_in_the_file(tmp_path, name):
    lines = FILES[name].decode().split("\n")
    first = lines.index(LINES.split("\n")[0])
    lines[first + 700] = "1 2 x"
    path = tmp_path / name
    path.write_text("\n".join(lines))
    with pytest.raises(FormatError, match=rf"line {first + 701}, column z: found 'x'"):
        list(read_pieces(path, "cloud", 100))


@pytest.mark.parametrize("name", ["binary.ply", "ascii.ply", "binary.pcd", "ascii.pcd", "scan.pts"])
def test_a_file_that_ends_early_is_refused_by_pieces_too(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(FILES[name][: len(FILES[name]) * 3 // 4])
    with pytest.raises(FormatError, match=r"ends early|fewer than three"):
        list(read_pieces(path, "cloud", 100))


def test_dropped_points_are_counted_piece_by_piece(tmp_path):
    path = tmp_path / "scan.xyz"
    path.write_text("1 2 3\nnan nan nan\n4 5 6\n7 8 nan\n7 8 9\n")
    assert [piece.attrs["dropped"] for piece in read_pieces(path, "cloud", 2)] == [1, 1, 0]


def test_two_points_are_no_cloud(tmp_path):
    path = tmp_path / "scan.xyz"
    path.write_text("1 2 3\n4 5 6\n")
    with pytest.raises(FormatError, match="found 2 rows, expected at least 3"):
        list(read_pieces(path, "cloud", 1))
