"""Runs the cases of the matrix, each on a copy of its batch, and counts what became of them."""

import shutil
from collections import Counter
from dataclasses import dataclass

import matrix_batches
import matrix_cases
import matrix_outcome


@dataclass(frozen=True)
class Result:
    """A case of a batch, and what became of it."""

    batch: str
    case: matrix_cases.Case
    outcome: matrix_outcome.Outcome


def cases(folder, pairs):
    """Return all cases of a batch."""
    cells = sorted(matrix_outcome.CELLS.glob("*.yaml"))
    return [
        *matrix_cases.singles(folder),
        *matrix_cases.alone(folder),
        *matrix_cases.messy(folder),
        *matrix_cases.crossed(folder, cells),
        *matrix_cases.pairs(folder, pairs),
    ]


def run(place, only="", kind="", pairs=20, thin=1, *, full=False):
    """Yield the result of every case, or every so many, of the batches and of the kind that are asked for."""
    (place / "batches").mkdir()
    seen = {}
    for source in matrix_batches.sources(place / "batches"):
        if only in source.name:
            asked = [case for case in cases(source.folder, pairs) if kind in case.kind]
            for case in asked[::thin]:
                copy = place / "case" / source.name
                shutil.rmtree(copy.parent, ignore_errors=True)
                shutil.copytree(source.folder, copy)
                case.edit(copy)
                yield Result(source.name, case, matrix_outcome.outcome(copy, place / "out", seen, full=full))


def table(results):
    """Return a table of counts by batch."""
    head = ("batch", "cases", "PDF", "refused", "tracebacks", "disagree", "odd words")
    rows = [head]
    for batch in [*dict.fromkeys(result.batch for result in results), "all"]:
        own = [result.outcome for result in results if batch in (result.batch, "all")]
        ends = Counter("crashed" if "crashed" in (one.check, one.end) else one.end for one in own)
        apart = sum(not one.agree and "crashed" not in (one.check, one.end) for one in own)
        odd = sum(bool(one.odd) for one in own)
        rows.append((batch, len(own), ends["PDF"], ends["refused"], ends["crashed"], apart, odd))
    widths = [max(len(str(row[column])) for row in rows) for column in range(len(head))]
    return "\n".join(
        "  ".join(str(cell).ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows
    )
