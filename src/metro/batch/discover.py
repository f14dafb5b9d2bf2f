"""Find the batches under the raw roots, with every file that a batch is made of.

Called whenever the workflow is parsed: nothing heavier than a YAML parser is imported here.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from metro.batch.documents import read_yaml
from metro.batch.findings import BatchError, Finding

NAME = re.compile(r"[a-z0-9][a-z0-9-]*")
NAME_IN_WORDS = "lower-case letters, digits and hyphens, beginning with a letter or digit"


@dataclass(frozen=True)
class FoundBatch:
    """A folder that holds a batch.

    Attributes
    ----------
    name : the folder's name.
    folder : its path, as its root was given.
    files : every file in it, recursively and sorted; dotfiles left out.
    cell_file : the file of the cells folder that describes its cell; None where the batch brings its own, or
        where the cell is not known.
    stations_file : the table of stations that ``cell_file`` names; None where it names none.
    """

    name: str
    folder: Path
    files: tuple[Path, ...]
    cell_file: Path | None
    stations_file: Path | None

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Every file whose change changes what is read of the batch."""
        shared = (self.cell_file, self.stations_file)
        return (*self.files, *(path for path in shared if path is not None))


def discover(roots: Iterable[str | Path], cells: str | Path = "config/cells") -> list[FoundBatch]:
    """Return the batches under ``roots``, sorted by name.

    Parameters
    ----------
    roots : folders whose direct sub-folders with a ``batch.yaml`` are batches.
    cells : folder of the cells that batches share.

    Raises
    ------
    BatchError
        A root is not there, a batch's name is not allowed, or two roots hold batches of one name.
    """
    problems: list[Finding] = []
    folders: dict[str, Path] = {}
    for root in (Path(entry) for entry in roots):
        if not root.is_dir():
            problems.append(Finding("error", str(root), "is not a folder: every raw root must be there"))
            continue
        for folder in _batch_folders(root):
            other = folders.setdefault(folder.name, folder)
            if other.resolve() != folder.resolve():
                message = f'there is a batch of the same name in "{other}": rename one of them'
                problems.append(Finding("error", str(folder), message))
            if not NAME.fullmatch(folder.name):
                message = f"the name of a batch's folder is made of {NAME_IN_WORDS}: rename it"
                problems.append(Finding("error", str(folder), message))
    if problems:
        raise BatchError(problems)
    return [_described(folders[name], Path(cells)) for name in sorted(folders)]


def batch_files(folder: Path) -> tuple[Path, ...]:
    """Return every file under ``folder``, recursively and sorted; dotfiles and dangling links left out."""
    files = []
    for parent, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        files += [Path(parent, name) for name in names if not name.startswith(".")]
    return tuple(sorted(path for path in files if path.exists()))


def _batch_folders(root: Path) -> list[Path]:
    """Return the sub-folders of ``root`` that hold a batch, sorted."""
    visible = (entry for entry in root.iterdir() if not entry.name.startswith("."))
    return sorted(entry for entry in visible if (entry / "batch.yaml").is_file())


def _described(folder: Path, cells: Path) -> FoundBatch:
    """List a batch's files and the shared files that describe its cell."""
    cell_file = None
    if not (folder / "cell.yaml").is_file():
        cell_file = _existing(cells, f"{_entry(folder / 'batch.yaml', 'cell')}.yaml")
    stations = cell_file and _entry(cell_file, "stations")
    stations_file = _existing(cells, stations) if stations else None
    return FoundBatch(folder.name, folder, batch_files(folder), cell_file, stations_file)


def _existing(folder: Path, name: str) -> Path | None:
    """Return the file ``name`` of a folder if it is there, and in it."""
    if Path(name).is_absolute() or ".." in Path(name).parts or "\0" in name:
        return None  # `check` reports why; the name comes from a file that somebody else wrote
    path = folder / name
    return path if path.is_file() else None


def _entry(path: Path, key: str) -> str | None:
    """Return a text entry of a YAML file; None where it has none or cannot be read (`check` reports why)."""
    value = read_yaml(path, path.name)[0].get(key)
    return value if isinstance(value, str) else None
