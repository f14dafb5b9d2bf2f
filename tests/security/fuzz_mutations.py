"""Ways to damage a valid file, by accident or on purpose; every one is drawn from a seeded generator."""

import io
import re
import struct
import zipfile

EXTREMES = (
    0,
    1,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0x8000,
    0xFFFF,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**62,
    2**63,
    2**64 - 1,
)
TOKENS = (
    b"", b"nan", b"-inf", b"1e400", b"-0", b"1e-400", b"0x10", b"1_000", b"1,5", b"9" * 5000, b"1e99999999",
    "\u0661\u0662".encode(), b"\xff\xfe", b"\0", b"\"", b"'", b"#", b"\n", b"\r", b";", b"\t", b"*a", b"&a a",
    b"!!python/object:os.system", b"!!float abc", b"!!bool abc", b"!!set {a}", b"!!binary x", b"<<: {a: 1}",
    b"../../etc/passwd", b"{{{{{{{{", b"[" * 400, b"- " * 400, b"2020-13-45", b"-1", b"99999999999999999999",
)  # fmt: skip
WORD = re.compile(rb"[A-Za-z0-9_.+\-]+")
LONGEST = 200_000
CRC_PAGE = 1024


def damaged(data, other, rng):
    """Return ``data`` with one to four damages; ``other`` is a valid file to splice with."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        data = rng.choice(DAMAGES)(data, other, rng)[:LONGEST]
    return data


def _place(data, rng):
    """Draw a place, in half of the cases near an end, where headers and indices are."""
    size = max(len(data), 1)
    near = min(size, 300)
    return rng.choice(
        (rng.randrange(size), rng.randrange(near), size - 1 - rng.randrange(near), rng.randrange(size))
    )


def flip(data, _other, rng):
    """Turn some bits round."""
    found = bytearray(data)
    for _ in range(rng.choice((1, 2, 8, 64)) if data else 0):
        found[_place(data, rng)] ^= 1 << rng.randrange(8)
    return bytes(found)


def noise(data, _other, rng):
    """Overwrite a stretch with noise, or with one value."""
    at, size = _place(data, rng), rng.choice((1, 4, 32, 500))
    piece = rng.randbytes(size) if rng.random() < 0.5 else bytes([rng.choice((0, 0x20, 0x30, 0xFF))]) * size
    return data[:at] + piece + data[at + size :]


def cut(data, _other, rng):
    """Cut the end off."""
    return data[: _place(data, rng)]


def lose(data, _other, rng):
    """Lose a stretch."""
    at = _place(data, rng)
    return data[:at] + data[at + rng.choice((1, 2, 7, 64, 1024)) :]


def double(data, _other, rng):
    """Repeat a stretch, once or often."""
    at, size = _place(data, rng), rng.choice((1, 8, 100, 1000))
    return data[:at] + data[at : at + size] * rng.choice((2, 3, 50)) + data[at + size :]


def splice(data, other, rng):
    """Go on, or go on for a while, with another file."""
    at, there = _place(data, rng), _place(other, rng)
    end = len(other) if rng.random() < 0.5 else there + 200
    return data[:at] + other[there:end] + (b"" if rng.random() < 0.5 else data[at:])


def number(data, _other, rng):
    """Put an extreme value where a binary count, size or offset may be."""
    code = rng.choice(("B", "<H", "<I", ">I", "<Q", ">Q"))
    size = struct.calcsize(code)
    at = _place(data, rng)
    value = rng.choice(EXTREMES) % 256**size
    return data[:at] + struct.pack(code, value) + data[at + size :]


def word(data, _other, rng):
    """Put something else in place of a word or number of a text."""
    found = list(WORD.finditer(data[:20_000]))
    if not found:
        return noise(data, _other, rng)
    which = rng.choice(found)
    new = rng.choice(TOKENS) if rng.random() < 0.7 else rng.choice(found)[0]
    return data[: which.start()] + new + data[which.end() :]


def lines(data, _other, rng):
    """Swap, drop or repeat lines."""
    parts = data.split(b"\n")
    i, j = rng.randrange(len(parts)), rng.randrange(len(parts))
    parts[i : i + 1] = rng.choice(([], [parts[j]], [parts[i], parts[i]], [parts[i] + parts[j]]))
    return b"\n".join(parts)


DAMAGES = (flip, flip, noise, cut, lose, double, splice, number, number, word, word, word, lines)


def in_archive(data, other, rng):
    """Damage a member of a zip archive and pack it soundly again, or damage the archive itself."""
    if rng.random() < 0.3:
        return damaged(data, other, rng)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    which = rng.choice(sorted(members))
    members[which] = damaged(members[which], other, rng)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return stream.getvalue()


def in_pages(data, other, rng):
    """Damage an E57 file and sign its pages anew, so that the damage is not found by its checksums alone."""
    found = damaged(data, other, rng)
    if rng.random() < 0.2:
        return found
    pages = [found[at : at + CRC_PAGE] for at in range(0, len(found), CRC_PAGE)]
    old = [data[at : at + CRC_PAGE] for at in range(0, len(data), CRC_PAGE)]
    return b"".join(
        page if len(page) < CRC_PAGE or (i < len(old) and page == old[i]) else _signed(page)
        for i, page in enumerate(pages)
    )


def _signed(page):
    crc = 0xFFFFFFFF
    for byte in page[:-4]:
        crc = CRC32C[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return page[:-4] + struct.pack(">I", crc ^ 0xFFFFFFFF)


def _table():
    table = []
    for byte in range(256):
        crc = byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
        table.append(crc)
    return table


CRC32C = _table()
