"""E57, written here from the standard (ASTM E2807): pages with CRC-32C, XML, packets of bytestreams."""

import struct

import numpy as np
import pytest
from cloud_files import POINTS, failure, written

from metro.formats.registry import read, read_pieces, sniff

PAGE, HELD = 1024, 1020
HEADER = struct.Struct("<8sIIQQQQ")
QUARTER = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))  # a quarter of a turn about z: x → y


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def physical(logical):
    return logical // HELD * PAGE + logical % HELD


def bits(values, width):
    """Pack whole numbers, the first in the lowest bits."""
    number = sum(int(value) << (index * width) for index, value in enumerate(values))
    return number.to_bytes((len(values) * width + 7) // 8, "little")


def section(streams, at, packet_type=1):
    """A compressed vector: section header and one data packet, its bytestreams one after the other."""
    lengths = b"".join(struct.pack("<H", len(stream)) for stream in streams)
    body = lengths + b"".join(streams)
    body += b"\0" * (-(6 + len(body)) % 4)
    packet = struct.pack("<BBHH", packet_type, 0, 6 + len(body) - 1, len(streams)) + body
    return struct.pack("<B7xQQQ", 1, 32 + len(packet), physical(at + 32), 0) + packet


def pose(rotation, shift):
    names = [f'<{n} type="Float">{v!r}</{n}>' for n, v in zip("wxyz", map(float, rotation), strict=True)]
    moved = [f'<{n} type="Float">{v!r}</{n}>' for n, v in zip("xyz", map(float, shift), strict=True)]
    return (
        f'<pose type="Structure"><rotation type="Structure">{"".join(names)}</rotation>'
        f'<translation type="Structure">{"".join(moved)}</translation></pose>'
    )


def e57(scans, doctype="", packet_type=1):
    """``scans``: (prototype, streams, number of points, pose) each."""
    logical, children = bytes(HEADER.size), []
    for prototype, streams, count, placed in scans:
        logical += b"\0" * (-len(logical) % 4)
        children.append(
            f'<vectorChild type="Structure"><guid type="String">s{len(children)}</guid>{placed}'
            f'<points type="CompressedVector" fileOffset="{physical(len(logical))}" recordCount="{count}">'
            f'<prototype type="Structure">{prototype}</prototype>'
            '<codecs type="Vector" allowHeterogeneousChildren="1"/></points></vectorChild>'
        )
        logical += section(streams, len(logical), packet_type)
    xml = (
        f'<?xml version="1.0" encoding="UTF-8"?>{doctype}'
        '<e57Root type="Structure" xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0">'
        '<formatName type="String"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>'
        '<guid type="String">f</guid><versionMajor type="Integer">1</versionMajor>'
        '<versionMinor type="Integer">0</versionMinor>'
        f'<data3D type="Vector" allowHeterogeneousChildren="1">{"".join(children)}</data3D></e57Root>'
    ).encode()
    logical += b"\0" * (-len(logical) % 4)
    start = len(logical)
    logical += xml
    logical += b"\0" * (-len(logical) % HELD)
    length = len(logical) // HELD * PAGE
    head = HEADER.pack(b"ASTM-E57", 1, 0, length, physical(start), len(xml), PAGE)
    logical = head + logical[HEADER.size :]
    pages = [logical[k : k + HELD] for k in range(0, len(logical), HELD)]
    return b"".join(page + struct.pack(">I", crc32c(page)) for page in pages)


def doubles(points, placed=""):
    prototype = "".join(f'<cartesian{axis} type="Float"/>' for axis in "XYZ")
    streams = [column.astype("<f8").tobytes() for column in (points / 1000.0).T]
    return prototype, streams, len(points), placed


def scan(tmp_path, content):
    return written(tmp_path, content, "scan.e57")


def test_a_scan_in_double_precision_is_read_in_millimetres(tmp_path):
    path = scan(tmp_path, e57([doubles(POINTS)]))
    sniff(path, "cloud")
    table = read(path, "cloud")
    np.testing.assert_allclose(table.to_numpy(), POINTS, rtol=1e-14)
    assert (table.dtypes == np.float64).all()
    assert table.attrs["notes"][0].message == "1 scans were joined, 0 by their poses"


def test_scaled_integers_intensity_and_points_marked_invalid(tmp_path):
    steps = np.array([[100, 200, 300], [4000, 5, 6], [7, 8, 9], [10, 4095, 12]])  # of 10 µm, from −20 mm
    prototype = "".join(
        f'<cartesian{axis} type="ScaledInteger" minimum="0" maximum="4095" scale="1e-5" offset="-0.02"/>'
        for axis in "XYZ"
    )
    prototype += '<intensity type="Float" precision="single"/>'
    prototype += '<cartesianInvalidState type="Integer" minimum="0" maximum="2"/>'
    streams = [bits(column, 12) for column in steps.T]
    streams += [np.ones(4, "<f4").tobytes(), bits([0, 2, 0, 0], 2)]
    table = read(scan(tmp_path, e57([(prototype, streams, 4, "")])), "cloud")
    np.testing.assert_allclose(table.to_numpy(), steps[[0, 2, 3]] * 0.01 - 20.0, atol=1e-12)
    assert table.attrs["dropped"] == 1


@pytest.mark.parametrize("rows", [None, 3, 100])
def test_scans_are_joined_by_their_poses(tmp_path, rows):
    placed = pose(QUARTER, (1.0, 2.0, 3.0))
    path = scan(tmp_path, e57([doubles(POINTS), doubles(POINTS[:3], placed)]))
    pieces = list(read_pieces(path, "cloud", rows)) if rows else [read(path, "cloud")]
    shift = np.array([1000.0, 2000.0, 3000.0])
    turned = np.column_stack([-POINTS[:3, 1], POINTS[:3, 0], POINTS[:3, 2]]) + shift
    found = np.concatenate([piece.to_numpy() for piece in pieces])
    np.testing.assert_allclose(found, np.vstack([POINTS, turned]), atol=1e-12)
    assert pieces[0].attrs["notes"][0].message == "2 scans were joined, 1 by their poses"
    assert not any("notes" in piece.attrs for piece in pieces[1:])


def test_spherical_coordinates(tmp_path):
    distance, azimuth, elevation = (
        np.array([1.0, 2.0, 2.0]),
        np.array([0, np.pi / 2, 0]),
        np.array([0, 0, np.pi / 6]),
    )
    names = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
    prototype = "".join(f'<{name} type="Float"/>' for name in names)
    streams = [np.asarray(column, "<f8").tobytes() for column in (distance, azimuth, elevation)]
    table = read(scan(tmp_path, e57([(prototype, streams, 3, "")])), "cloud")
    expected = [[1000, 0, 0], [0, 2000, 0], [2000 * np.cos(np.pi / 6), 0, 1000]]
    np.testing.assert_allclose(table.to_numpy(), expected, atol=1e-9)


def test_faults_of_an_e57_file_are_named(tmp_path):
    good = e57([doubles(POINTS)])
    flipped = bytearray(good)
    flipped[90] ^= 1
    assert "ends early: found 1000 bytes, expected" in failure(scan(tmp_path, good[:1000]))
    assert "ends early: found 20 bytes, expected a header" in failure(scan(tmp_path, good[:20]))
    assert "not a readable E57 file" in failure(scan(tmp_path, bytes(flipped)))
    colours = "".join(f'<color{name} type="Float"/>' for name in ("Red", "Green", "Blue"))
    assert "found a scan with colorRed" in failure(scan(tmp_path, e57([(colours, *doubles(POINTS)[1:])])))
    assert "found 0 rows" in failure(scan(tmp_path, e57([])))


def test_a_byte_that_is_no_text_in_what_the_library_says_is_no_crash(tmp_path):
    message = failure(scan(tmp_path, e57([doubles(POINTS)], packet_type=255)))
    assert "not a readable E57 file" in message
    assert "packetType" in message


def test_entities_are_not_unfolded(tmp_path):
    bomb = '<!DOCTYPE e57Root [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'
    assert "its XML declares a document type" in failure(scan(tmp_path, e57([doubles(POINTS)], bomb)))
