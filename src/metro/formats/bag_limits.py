"""What a bag of somebody else may make its reader do: unpack within limits, and run nothing of the file.

The reader of rosbags unpacks whatever chunks a file's index names, as often as it names them, and makes
Python classes of the message definitions in the file. SQLite runs the views and computed columns of a file.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import quote

from metro.formats.errors import FormatError
from metro.formats.limits import LARGEST

LARGEST_CHUNK = 1 << 28
_TYPE = re.compile(r"[a-z][a-z0-9_]*/(msg|action)/[A-Z][A-Za-z0-9]*")
_FIELD = re.compile(r"[a-z][a-z0-9_]*")
# Of a table's definition: what makes SQLite compute instead of read.
_COMPUTES = re.compile(r"\bvirtual\b|\bgenerated\b|\bas\s*\(", re.IGNORECASE)


@contextmanager
def limited_chunks(path: Path, most: int = LARGEST, chunk: int = LARGEST_CHUNK) -> Iterator[None]:
    """Let the MCAP reader unpack so many bytes in all, and in one chunk, inside this block.

    Raises
    ------
    FormatError
        At the chunk that goes beyond, before it is unpacked.
    """
    from rosbags.rosbag2 import storage_mcap

    left = most

    def unpack(compression: str, data: bytes, size: int) -> bytes:
        nonlocal left
        if size > min(chunk, left):
            raise FormatError(path, f"unpacks to more than {chunk} bytes in a chunk, or {most} in all")
        left -= size
        return _unpacked(compression, data, size)

    own = dict(storage_mcap.DECOMPRESSORS)
    bounded = {name: lambda data, size, name=name: unpack(name, data, size) for name in own}
    storage_mcap.DECOMPRESSORS.update(bounded)
    try:
        yield
    finally:
        storage_mcap.DECOMPRESSORS.update(own)


def _unpacked(compression: str, data: bytes, size: int) -> bytes:
    """Unpack a chunk to at most a byte more than it should have, whatever it holds."""
    if not compression:
        return data
    from rosbags.rosbag2 import storage_mcap

    packages: Any = storage_mcap  # it imports both, from where this version of Python has them
    made = import_module("lz4.frame").LZ4FrameDecompressor if compression == "lz4" else None
    unpacked: bytes = (made or packages.zstd.ZstdDecompressor)().decompress(data, max_length=size + 1)
    return unpacked


def check_tables(path: Path) -> None:
    """Check that a SQLite file has tables and indices alone, which hold data and compute nothing.

    Raises
    ------
    FormatError
        Where it has views, triggers, virtual tables or computed columns, or a name that SQLite takes for more
        than a name.
    """
    if set(path.name) & set("?#%"):
        raise FormatError(path, "has one of ? # % in its name, which SQLite cannot open: rename it")
    with closing(sqlite3.connect(f"file:{quote(str(path))}?mode=ro&immutable=1", uri=True)) as database:
        for kind, name, text in database.execute("SELECT type, name, sql FROM sqlite_master"):
            if kind not in ("table", "index") or _COMPUTES.search(text or ""):
                message = (
                    f"found the {kind} {str(name)[:40]!r} that computes, expected tables of recorded data"
                )
                raise FormatError(path, message)


def plain_types(path: Path, types: dict[str, Any]) -> dict[str, Any]:
    """Return parsed message definitions without their constants; their names become names of Python classes.

    Raises
    ------
    FormatError
        Where a name is none that ROS 2 allows.
    """
    for kind, (_, fields) in types.items():
        names = [name for name, _ in fields if not _FIELD.fullmatch(name)]
        if names or not _TYPE.fullmatch(kind):
            name_refused = (names or [kind])[0]
            raise FormatError(
                path, f"found the name {name_refused[:40]!r} in a message definition of {kind[:40]}"
            )
    return {kind: ([], fields) for kind, (_, fields) in types.items()}
