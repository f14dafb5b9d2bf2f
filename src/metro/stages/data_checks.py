"""Checks of a batch's data as a whole: what no single file shows, found from the canonical tables as read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from metro.batch.batch import Batch
from metro.batch.findings import Finding
from metro.batch.processed import Tables
from metro.slips.copies import copies
from metro.slips.cut_short import cut_short

DataCheck = Callable[[Batch, Tables], Iterable[Finding]]

# Each looks at the whole of a batch; an error refuses it, a warning is shown.
DATA_CHECKS: tuple[DataCheck, ...] = (copies, cut_short)


def data_findings(batch: Batch, read: Tables) -> Iterator[Finding]:
    """Yield what the data of a batch say that is wrong with it; ``metro check`` and ingest both call this.

    It is called once every file was read without an error. A further check is a function that is added to
    :data:`DATA_CHECKS`.

    Parameters
    ----------
    batch : manifest, cell and run table, as though recordings that are not fit for use had not been made.
    read : the canonical tables: ``read("force", run)`` gives a run's rows, ``read.pieces("force", run)``
        the rows of a long record some at a time, ``read("loads")`` a table as a whole.
    """
    for check in DATA_CHECKS:
        yield from check(batch, read)
