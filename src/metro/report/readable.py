"""Which texts of a batch the report cannot show as they are written, before it is made."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from metro.batch.columns import TABLES
from metro.batch.documents import read_yaml
from metro.batch.entries import FILE, entry
from metro.batch.findings import Finding, shown
from metro.batch.tables import read_table
from metro.report import glyphs

KEYS = ("title", "citation", "work.material")
SHOWN = ("runs", "published")  # tables whose texts the report shows
PLAIN = "\u024f"  # the last character of the Latin letters, which the report's fonts have


def readable_findings(folder: Path) -> list[Finding]:
    """Name the texts of a batch with characters that neither the report nor this machine has a font for."""
    texts = [*_of_manifest(folder), *_of_tables(folder)]
    unusual = frozenset("".join(text for _, _, text in texts))
    unusual = frozenset(character for character in unusual if character > PLAIN)
    if not unusual:
        return []
    from metro.report.document import found_for

    _, missing = found_for(unusual)
    return [_finding(file, column, text, missing) for file, column, text in texts if missing & set(text)]


def _finding(file: str, column: str, text: str, missing: frozenset[str]) -> Finding:
    lacked = "".join(character for character in dict.fromkeys(text) if character in missing)
    message = f"no font on this machine has the characters {shown(lacked)}: the report shows them as "
    more = f"{glyphs.without(lacked, missing)}; install a font that has them to show them as written"
    return Finding("note", file, message + more, column=column)


def _of_manifest(folder: Path) -> Iterator[tuple[str, str, str]]:
    """Yield file, key and text of what the report shows of batch.yaml."""
    manifest, _ = read_yaml(folder / FILE, FILE)
    for path in KEYS:
        value = entry(manifest, path)
        if isinstance(value, str):
            yield FILE, path, value


def _of_tables(folder: Path) -> Iterator[tuple[str, str, str]]:
    """Yield file, column and all text of each column of text."""
    for name in SHOWN:
        table, _ = read_table(folder, name)
        for column in TABLES[name]:
            if not column.numeric and len(table.frame):
                yield table.file, column.name, "".join(dict.fromkeys(table.frame[column.name]))
