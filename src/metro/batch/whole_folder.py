"""Folders that are there whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from metro.batch.writing import writing


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Give a folder to fill that gets its place once it is full.

    It has its final name, since what is in it may hold that, inside a hidden folder beside its place: a
    process that is killed meanwhile leaves ``.<name>.<8 letters>``, which no command takes for a batch.

    Raises
    ------
    ContractError
        The disk is full, read-only, or something is in the way.
    """
    with writing(folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
        hidden = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        try:
            filled = hidden / folder.name
            filled.mkdir()
            yield filled
            filled.rename(folder)
        finally:
            shutil.rmtree(hidden, ignore_errors=True)
