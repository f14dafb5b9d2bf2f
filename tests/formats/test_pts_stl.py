"""PTS and STL, written here by hand."""

import struct

import numpy as np
import pytest
from cloud_files import POINTS, array, failure, written

from metro.formats import FormatError
from metro.formats.registry import read_pieces

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]])
TETRAHEDRON = CORNERS[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]


def block(points, after=""):
    return f"{len(points)}\n" + "".join(f"{x} {y} {z}{after}\n" for x, y, z in points.tolist())


@pytest.mark.parametrize("after", ["", " -1024", " 7 255 0 12", " 255 0 12"])
@pytest.mark.parametrize("parts", [1, 2, 4])
def test_pts_of_several_blocks(tmp_path, after, parts):
    text = "".join(block(part, after) for part in np.split(POINTS, parts))
    np.testing.assert_array_equal(array(written(tmp_path, text, "scan.pts")), POINTS)
    crlf = written(tmp_path, text.replace("\n", "\r\n"), "crlf.pts")
    np.testing.assert_array_equal(array(crlf), POINTS)


@pytest.mark.parametrize("rows", [1, 2, 3, 7])
def test_pts_pieces_cut_anywhere_are_the_whole(tmp_path, rows):
    many = np.random.default_rng(0).normal(size=(12, 3))
    text = block(many[:5]) + block(many[5:5]) + block(many[5:11], " 9 1 2 3") + block(many[11:])
    path = written(tmp_path, text, "scan.pts")
    np.testing.assert_array_equal(
        np.vstack([piece.to_numpy() for piece in read_pieces(path, "cloud", rows)]), many
    )


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (block(POINTS)[:-13], ["ends early", "lacks 1 of its points"]),
        (block(POINTS) + "3\n1 2 3\n", ["ends early", "lacks 2 of its points"]),
        (block(POINTS) + "1.5\n1 2 3\n", ["line 6", "found 1.5", "number of points"]),
        (block(POINTS)[2:], ["line 1", "found 0.1 0.2 0.3", "number of points", ".xyz"]),
        (
            block(POINTS).replace("100.25 60.5 30.0", "100.25 60.5"),
            ["line 4", "fewer than three", "2 points"],
        ),
        (block(POINTS).replace("100.25 60.5 30.0", "100.25 x 30.0"), ["line 4, column y", "'x'"]),
        (block(POINTS).replace("100.25", "100,25"), ["line 4, column x", "'100,25'", "decimal point"]),
        (block(POINTS[:2]), ["found 2 rows", "at least 3"]),
    ],
)
def test_faults_of_a_pts_file_are_named(tmp_path, text, parts):
    message = failure(written(tmp_path, text, "scan.pts"))
    assert [part for part in parts if part not in message] == []


def binary_stl(facets, header=b"made by hand", count=None):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *facet.ravel(), 0) for facet in facets)
    return header.ljust(80) + struct.pack("<I", len(facets) if count is None else count) + body


def ascii_stl(facets):
    text = "solid part 1\n"
    for facet in facets:
        text += "  facet normal 0 0 1\n    outer loop\n"
        text += "".join(f"      vertex {x:.6e} {y:.6e} {z:.6e}\n" for x, y, z in facet)
        text += "    endloop\n  endfacet\n"
    return text + "endsolid part 1\n"


@pytest.mark.parametrize(
    "content",
    [
        *(binary_stl(TETRAHEDRON), binary_stl(TETRAHEDRON, b"solid\0part")),
        *(ascii_stl(TETRAHEDRON), ascii_stl(TETRAHEDRON[:2]) + ascii_stl(TETRAHEDRON[2:])),
    ],
)
def test_a_vertex_of_several_facets_is_one_point(tmp_path, content):
    found = array(written(tmp_path, content, "scan.stl"))
    np.testing.assert_array_equal(found, sorted(CORNERS.tolist()))


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        (binary_stl(TETRAHEDRON)[:-1], ["ends early", "found 3 facets", "expected 4"]),
        (binary_stl(TETRAHEDRON)[:83], ["ends early", "found 83 bytes"]),
        (binary_stl(TETRAHEDRON, count=3), ["284 bytes", "3 facets"]),
        (ascii_stl(TETRAHEDRON)[:-16], ["ends early", "'endfacet'", "endsolid"]),
        (ascii_stl(TETRAHEDRON).replace("1.500000e+00", "1,5", 1), ["line 13", "vertex x y z"]),
        (
            ascii_stl(TETRAHEDRON).replace("      vertex 0.000000e+00 1", "      axle 0 1", 1),
            ["line 7", "three"],
        ),
        (binary_stl(TETRAHEDRON[:0]), ["found 0 rows"]),
    ],
)
def test_faults_of_an_stl_file_are_named(tmp_path, content, parts):
    message = failure(written(tmp_path, content, "scan.stl"))
    assert [part for part in parts if part not in message] == []


def test_a_short_line_in_a_later_piece_is_named_by_its_line_in_the_file(tmp_path):
    text = block(POINTS).replace("7.0 -8.0 9.0", "7.0 -8.0")
    with pytest.raises(FormatError, match="line 5: found fewer than three"):
        list(read_pieces(written(tmp_path, text, "scan.pts"), "cloud", 2))
