"""The error of a reader about a file that it cannot read."""

from __future__ import annotations

from pathlib import Path


class FormatError(Exception):
    """A data file is not what it should be: file, row and column, what was found, what was expected."""

    def __init__(self, path: Path, message: str) -> None:
        super().__init__(path, message)
        self.path = path
        self.message = message

    def __str__(self) -> str:
        return f"{self.path}: {self.message}"
