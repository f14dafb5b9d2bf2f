"""What a check finds in a batch or a configuration: where it is, what was found and what was expected."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any, Literal

Severity = Literal["error", "warning", "note"]
PAIR = 2  # letters that have changed places
UNITS = {"mm", "deg", "hz", "n", "nm", "ms", "s"}  # at the end of keys
SHORTEST_WORD = 4  # letters: of shorter ones, one letter makes another word


@dataclass(frozen=True)
class Finding:
    """One statement of a check.

    Attributes
    ----------
    severity : an error stops the batch, a warning asks for a look, a note states what was assumed.
    file : path relative to the batch folder, or as the user wrote it.
    message : what was found and what was expected.
    row : row of the table as a spreadsheet counts it (the header is row 1), or line of a YAML file.
    run : id of the run (or test, pose, …) that the row describes.
    column : column of the table, or key of the YAML file (``tool.teeth``).
    """

    severity: Severity
    file: str
    message: str
    row: int | None = None
    run: str = ""
    column: str = ""

    @property
    def place(self) -> str:
        """Where in the file it is, in words."""
        yaml = self.file.endswith((".yaml", ".yml"))
        row = "" if self.row is None else f"line {self.row}" if yaml else f"row {self.row}"
        label = f"{row} ({self.run})".lstrip() if self.run else row
        column = self.column if yaml or not self.column else f"column {self.column}"
        return ": ".join(part for part in (label, column) if part)

    def __str__(self) -> str:
        return ": ".join(part for part in (self.file, self.place, self.message) if part)


class ContractError(Exception):
    """Input that does not follow the contract; carries every problem that was found, not the first alone."""

    def __init__(self, problems: Iterable[Finding]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


class BatchError(ContractError):
    """A batch, or the folders that hold batches, break the contract."""


class ConfigError(ContractError):
    """The configuration breaks its schema."""


def linked_outside(folder: Path, path: Path, file: str) -> list[Finding]:
    """Report a file that is a link to a place outside its folder: it is not read, a message would show it."""
    if path.resolve().is_relative_to(folder.resolve()):
        return []
    return [Finding("error", file, "is a link that leads outside the folder, expected the file itself")]


def errors(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return the findings that stop a batch."""
    return tuple(finding for finding in findings if finding.severity == "error")


def shown(value: Any) -> str:
    """Return a value as it is shown in a message, shortened where it is long."""
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else f"{text[:56]} …"


def misspelt(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that ``name`` is a slip of the pen for: its unit left out, or one letter.

    One letter of four or more is wrong, missing, too many, or has changed places with the next.
    """
    for entry in known:
        stem, _, unit = entry.rpartition("_")
        without_unit = unit in UNITS and name.lower() == stem
        if without_unit or _one_slip(name.lower(), entry.lower()):
            return entry
    return None


def _one_slip(one: str, other: str) -> bool:
    """Return whether two words are the same but for a letter, or for two that have changed places."""
    if min(len(one), len(other)) < SHORTEST_WORD:
        return False
    head = _shared_length(one, other)
    one, other = one[head:], other[head:]
    tail = _shared_length(one[::-1], other[::-1])
    one, other = one[: len(one) - tail], other[: len(other) - tail]
    return max(len(one), len(other)) <= 1 or (len(one) == PAIR and one == other[::-1])


def _shared_length(one: str, other: str) -> int:
    """Count the letters with which two words begin alike."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))
