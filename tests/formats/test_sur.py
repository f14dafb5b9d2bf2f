"""SUR files, written here byte by byte from the layout of their header."""

import contextlib
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.formats import FormatError
from metro.formats.registry import read, sniff

NUMBERS = np.array([[0, 1200, -50000], [7, 8, 9], [1, 2, 3]])


def sur(path, numbers=NUMBERS, *, kind=2, packed=False, gaps=False, unit=b"\xb5m", bits=32):
    """Steps of 2 by 3 µm, heights in units of 0.5 nm."""
    comment = b"a note"
    head = bytearray(512)
    head[0:12] = b"DSCOMPRESSED" if packed else b"DIGITAL SURF"
    struct.pack_into("<4h", head, 12, 0, 1, 1, kind)
    struct.pack_into("<h", head, 86, gaps)
    lines, columns = numbers.shape
    struct.pack_into("<h5i", head, 98, bits, -50000, int(numbers.max()), columns, lines, numbers.size)
    struct.pack_into("<3f", head, 120, 2.0, 3.0, 0.5)
    for at, name in ((180, unit), (196, unit), (212, b"nm")):
        head[at : at + len(name)] = name
    struct.pack_into("<2H", head, 334, len(comment), 3)
    data = numbers.astype(f"<i{bits // 8}").tobytes()
    if packed:
        stream = zlib.compress(data)
        data = struct.pack("<3I", 1, len(data), len(stream)) + stream
    path.write_bytes(bytes(head) + comment + b"xyz" + data)
    return path


def refused(path, kind="cloud"):
    with pytest.raises(FormatError) as caught:
        read(path, kind)
    return caught.value.message


@pytest.mark.parametrize(("packed", "unit"), [(False, b"\xb5m"), (True, "µm".encode())])
def test_a_surface_is_read_in_millimetres_line_by_line(tmp_path, packed, unit):
    path = sur(tmp_path / "face.sur", packed=packed, unit=unit)
    sniff(path, "cloud")
    table = read(path, "cloud")
    np.testing.assert_allclose(table["x_mm"], np.tile([0.0, 2e-3, 4e-3], 3), rtol=1e-6)
    np.testing.assert_allclose(table["y_mm"], np.repeat([0.0, 3e-3, 6e-3], 3), rtol=1e-6)
    np.testing.assert_allclose(table["z_mm"], NUMBERS.ravel() * 0.5e-6, rtol=1e-6, atol=0)


def test_points_that_were_not_measured_are_left_out(tmp_path):
    numbers = NUMBERS.copy()
    numbers[1, 1] = -50002
    assert len(read(sur(tmp_path / "gaps.sur", numbers, gaps=True), "cloud")) == 8
    assert len(read(sur(tmp_path / "none.sur", numbers), "cloud")) == 9


def test_a_profile_is_one_line(tmp_path):
    trace = np.arange(10)[None] ** 2
    table = read(sur(tmp_path / "wall.pro", trace, kind=1, bits=16), "profile")
    np.testing.assert_allclose(table["x_mm"], 2e-3 * np.arange(10), rtol=1e-6)
    np.testing.assert_allclose(table["z_mm"], 0.5e-6 * trace[0], rtol=1e-6)


def test_what_is_not_as_it_should_be_is_refused_by_name(tmp_path):
    whole = sur(tmp_path / "a.sur")
    assert refused(whole, "profile") == "found a surface, expected a profile"
    assert refused(whole, "force") == "found a SUR file, expected a force record"
    assert "found the unit 'furlong' along x" in refused(sur(tmp_path / "b.sur", unit=b"furlong"))
    assert "type 12" in refused(sur(tmp_path / "c.sur", kind=12))
    short = tmp_path / "d.sur"
    short.write_bytes(whole.read_bytes()[:-5])
    assert refused(short) == "ends within its heights, after 31 of 36 bytes"
    short.write_bytes(whole.read_bytes()[:300])
    assert refused(short) == "ends within its header, after 300 of 512 bytes"
    damaged = sur(tmp_path / "e.sur", packed=True)
    damaged.write_bytes(damaged.read_bytes()[:-4] + b"0000")
    assert "heights" in refused(damaged) or "unpacked" in refused(damaged)
    head = bytearray(whole.read_bytes())
    struct.pack_into("<i", head, 108, 2_000_000_000)
    short.write_bytes(bytes(head))
    assert "which do not agree" in refused(short)


@settings(max_examples=200, deadline=None)
@given(st.booleans(), st.lists(st.tuples(st.integers(0, 560), st.integers(0, 255)), min_size=1, max_size=4))
def test_damage_is_refused_or_makes_other_numbers(tmp_path_factory, packed, changes):
    path = sur(tmp_path_factory.mktemp("damaged") / "a.sur", packed=packed, gaps=True)
    content = bytearray(path.read_bytes())
    for at, byte in changes:
        content[at % len(content)] = byte
    path.write_bytes(bytes(content))
    with contextlib.suppress(FormatError):
        read(path, "cloud")
