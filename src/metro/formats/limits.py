"""What a file may unpack to: a few kilobytes of an archive can unpack to more than any memory."""

from __future__ import annotations

import zipfile
from pathlib import Path

from metro.formats.errors import FormatError

LARGEST = 1 << 31  # bytes of a recording unpacked: 80 million samples of three axes
LARGEST_ARCHIVE = 1 << 28  # bytes unpacked of an archive of one FRF or one profile
LARGEST_XML = 1 << 26  # bytes of an XML part: a tree of it takes ten times as many


def check_unpacked(path: Path, size: int, title: str, most: int = LARGEST) -> None:
    """Raise a FormatError where a file unpacks to more than so many bytes, by the sizes that it states."""
    if size > most:
        raise FormatError(path, f"unpacks to {size} bytes, expected at most {most} in {title}")


def check_archive(path: Path, title: str) -> None:
    """Check the sizes that a ZIP archive states; its members cannot unpack to more, which `zipfile` sees to.

    Raises
    ------
    FormatError
        As :func:`check_unpacked`. zipfile.BadZipFile, where it is none.
    """
    with zipfile.ZipFile(path) as archive:
        entries = archive.infolist()
    check_unpacked(path, sum(entry.file_size for entry in entries), title, LARGEST_ARCHIVE)
    texts = [entry.file_size for entry in entries if entry.filename.lower().endswith(".xml")]
    check_unpacked(path, max(texts, default=0), f"the XML of {title}", LARGEST_XML)
