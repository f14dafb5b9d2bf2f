"""A case of the corpus: what is broken, how, and what must come of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import corpus_batches as batches


@dataclass(frozen=True)
class Case:
    """One fault of one kind of input.

    Attributes
    ----------
    kind, form : kind of input, and its file format ("" where there is one).
    fault : in words.
    apply : breaks the sound batch in a folder.
    how : what must come of it: refused, flagged (analysis goes on; the report's first page says so), or read
        (as it was meant: the same canonical tables as of the sound batch).
    says : what one message must hold, besides the file's name: place, value, expectation.
    file : the file that messages name, where it is not the one that is broken.
    """

    kind: str
    form: str
    fault: str
    apply: Callable[[Path], object]
    how: str
    says: tuple[str, ...] = ()
    file: str = ""

    @property
    def name(self) -> str:
        """Name of the case, for people."""
        return f"{self.kind}{f' ({self.form})' if self.form else ''}: {self.fault}"

    def faults_of(self, how: str, said: tuple[str, ...]) -> str:
        """Say in what an outcome is not the expected one; "" where it is."""
        if how != self.how:
            return f"{how}, expected {self.how}: {' | '.join(said)[:300]}"
        if how == "read":
            return ""
        file = self.file or batches.victim(self.kind, self.form)
        wanted = (file, *self.says)
        if any(all(word in message for word in wanted) for message in said):
            return ""
        return f"no message has {wanted}: {' | '.join(said)[:400]}"


def replaced(file: str, old: str, new: str) -> Callable[[Path], object]:
    """Return a fault that replaces the first ``old``, which must be there, of a text file."""

    def apply(folder: Path) -> None:
        text = (folder / file).read_text()
        assert old in text, (file, old)
        (folder / file).write_text(text.replace(old, new, 1))

    return apply


def tabled(file: str, change: Callable) -> Callable[[Path], object]:
    """Return a fault that changes a CSV table, given as a data frame."""
    import pandas as pd

    def apply(folder: Path) -> None:
        table = pd.read_csv(folder / file)
        changed = change(table)
        (table if changed is None else changed).to_csv(folder / file, index=False)

    return apply


def channel(kind, file, change, fault, *told):
    """Return the case of a change of a CSV recording: how it must fare, then what must be said."""
    how, *says = told
    return Case(kind, "CSV", fault, tabled(file, change), how, tuple(says))


def clipped(column, share):
    """Return the change that cuts a channel off at a share of its largest value."""

    def change(table):
        most = share * table[column].abs().max()
        table[column] = table[column].clip(-most, most)

    return change
