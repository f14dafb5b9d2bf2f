"""What the data of a batch contradict, as findings of the check: warnings, since the batch can be run."""

from __future__ import annotations

from collections.abc import Iterator

from metro.batch.batch import Batch
from metro.batch.findings import Finding
from metro.batch.processed import Tables
from metro.observables.force.static_meaning import static_deflection
from metro.stages.identify import slips_of

BUDGET = 0.01  # model-form budget of the base models' noise: no contradiction depends on it


def contradictions(batch: Batch, read: Tables) -> Iterator[Finding]:
    """Yield a warning for each contradiction that identify would find, with the line or cell to change.

    And a note where the machine is so soft that its static deflection, as its table of stations has it, is
    not what happens.
    """
    slips, identified = slips_of(batch, read, BUDGET)
    for slip in slips:
        yield Finding("warning", slip.file, slip.text, run=slip.run, column=slip.column)
    if reason := static_deflection(batch, read, identified).get("reason"):
        yield Finding("note", "stations.csv", reason)
