"""A contradiction between the data and what the batch declares, and the mistake that explains it."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from metro.units import JSON


@dataclass(frozen=True)
class Slip:
    """One contradiction.

    Attributes
    ----------
    observables : those whose results it spoils: nothing is attributed in them. None where it may be a slip,
        and is to be checked.
    found : what contradicts, with its numbers; a sentence without its full stop.
    remedy : which mistake explains it and which line or cell to change; "" where none of the list does.
    file, column, run : where the line to change is, as far as it is one.
    """

    observables: tuple[str, ...]
    found: str
    remedy: str
    file: str = "batch.yaml"
    column: str = ""
    run: str = ""

    @property
    def text(self) -> str:
        """Both sentences."""
        return ". ".join(filter(None, [self.found, self.remedy]))

    @property
    def row(self) -> JSON:
        """Fields as JSON."""
        return {**asdict(self), "observables": list(self.observables)}
