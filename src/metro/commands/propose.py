"""``metro propose``: checks the call before the search."""

from __future__ import annotations

from pathlib import Path

from metro.commands.calls import require_verdict
from metro.commands.status import verdicts
from metro.commands.which import batch_name

OBSERVABLE = "force"


def checked_call(batch: str, *, processed: Path, reports: Path) -> str:
    """Return the name of the batch whose residual is to be explained.

    Raises
    ------
    CallError
        There is no such batch.
    ContractError
        The batch has no results, or no verdict on the force.
    """
    name = batch_name(batch, processed, reports)
    require_verdict(name, OBSERVABLE, verdicts(reports / name))
    return name
