"""A writer of TDMS after its specification, which tests of the reader and the corpus share."""

import struct

import numpy as np

CODES = {"i1": 1, "i2": 2, "i4": 3, "i8": 4, "u1": 5, "u2": 6, "u4": 7, "u8": 8, "f4": 9, "f8": 10}
CODES |= {"V16": 0x44, "c16": 0x10000D}


def halves(count):
    """Return the slices of the first and the second half."""
    return slice(0, count // 2), slice(count // 2, count)


def text(value, order="<"):
    return struct.pack(order + "I", len(value.encode())) + value.encode()


def lead_in(flags, description, raw, order="<"):
    """Return a segment of a description and raw values."""
    head = struct.pack(order + "IQQ", 4713, len(description) + len(raw), len(description))
    return b"TDSm" + struct.pack("<I", flags) + head + description + raw


def index(array, order="<"):
    """Return the raw data index of a channel's values in a chunk."""
    code = CODES[np.asarray(array).dtype.str[1:]]
    return struct.pack(order + "IIIQ", 20, code, 1, len(array))


def _property(name, value, order):
    if isinstance(value, str):
        return text(name, order) + struct.pack(order + "I", 0x20) + text(value, order)
    code, form = (3, "i") if isinstance(value, int) else (10, "d")
    return text(name, order) + struct.pack(order + "I" + form, code, value)


def _described(path, content, properties, order):
    listed = b"".join(_property(name, value, order) for name, value in properties.items())
    return text(path, order) + content + struct.pack(order + "I", len(properties)) + listed


def values(channels, order, *, interleaved=False):
    """Return the raw values of channels: name → array, properties, and the bytes of texts."""
    arrays = [np.asarray(each[0]) for each in channels.values()]
    stored = [each.astype(each.dtype.newbyteorder(order)) for each in arrays]
    if interleaved:
        row = np.dtype([(f"f{i}", each.dtype) for i, each in enumerate(stored)])
        rows = np.empty(len(stored[0]), row)
        for name, each in zip(row.names, stored, strict=True):
            rows[name] = each
        return rows.tobytes()
    return b"".join(
        each[2] if len(each) > 2 else array.tobytes()
        for each, array in zip(channels.values(), stored, strict=True)
    )


def segment(channels, order="<", *, group="Cut", interleaved=False, new_list=True, raw=None, more=b""):
    """Return a segment; `raw` in place of the channels' own values, `more` chunks behind them."""
    group = group.replace("'", "''")
    parts = [
        _described("/", b"\xff" * 4, {"name": "trial"}, order),
        _described(f"/'{group}'", b"\xff" * 4, {}, order),
    ]
    for name, (array, properties, *texts) in channels.items():
        of_text = struct.pack(order + "IIIQQ", 28, 0x20, 1, len(array), sum(map(len, texts)))
        content = of_text if texts else index(array, order)
        parts.append(_described(f"/'{group}'/'{name}'", content, properties, order))
    description = struct.pack(order + "I", len(parts)) + b"".join(parts)
    flags = 2 | 8 | 4 * new_list | 32 * interleaved | 64 * (order == ">")
    stored = values(channels, order, interleaved=interleaved) if raw is None else raw
    return lead_in(flags, description, stored + more, order)
