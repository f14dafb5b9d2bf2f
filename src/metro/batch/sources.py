"""What the tables of a batch name as files: the file, its record, and the mapping that it is read by."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

from metro.batch.entries import FILE
from metro.batch.findings import Finding
from metro.spelling import suggestion

if TYPE_CHECKING:
    from metro.formats.mapping import Source

SECTION = "files"
SHARP = "#"  # between a file and its record
Files = Mapping[str, Any]  # the section of batch.yaml: pattern → mapping


def parted(folder: Path, name: str) -> tuple[str, str]:
    """Part what a table names into the file and its record; a file with such a name has none."""
    file, sharp, record = name.rpartition(SHARP)
    return (file, record) if sharp and not (folder / name).exists() else (name, "")


def source(folder: Path, name: str, files: Files) -> Source:
    """Return how a file that a table names is read: by the first mapping whose pattern fits, or as ever."""
    from metro.formats.mapping import Source, mapping_of

    file, record = parted(folder, name)
    for pattern, mapping in files.items():
        if fnmatchcase(file, pattern):
            return Source(folder / file, record, mapping_of(_key(pattern), mapping or {}))
    return Source(folder / file, record)


def files_of(folder: Path, name: str, files: Files) -> list[str]:
    """Return the files, relative to the folder, that the data under a name are read from."""
    one = source(folder, name, files)
    file, record = parted(folder, name)
    beside = one.mapping.beside(record) if one.mapping else []
    return [file, *((Path(file).parent / other).as_posix() for other in beside)]


def mapping_findings(files: Files) -> Iterator[Finding]:
    """Check what a schema cannot express of the mappings: names of columns, units, sensitivities."""
    from metro.formats.kinds import KINDS
    from metro.formats.mapping import STEPS, factor_to, mapping_of
    from metro.formats.measures import MeasureError

    known = sorted({column for kind in KINDS.values() for column in kind.columns})
    for pattern, given in files.items():
        mapping = mapping_of(_key(pattern), given or {})
        for name, one in mapping.columns.items():
            place = f"{mapping.key}.columns.{name}"
            if name not in known:
                message = f"is no column of the contract{suggestion(name, known)}"
                yield Finding("error", FILE, message, column=place)
                continue
            try:
                factor_to(name, one)
            except MeasureError as error:
                if one.unit or (one.sensitivity and "no unit" not in str(error)):
                    yield Finding("error", FILE, str(error), column=place)
        for step, (column, _) in STEPS.items():
            if step in mapping.steps and column in mapping.columns:
                message = f"makes {column}, which columns names too: leave one of them out"
                yield Finding("error", FILE, message, column=f"{mapping.key}.{step}")


def _key(pattern: str) -> str:
    return f'{SECTION}."{pattern}"'
