"""``metro next``: checks the call before the search, and shows on a terminal that the search is at work."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path

from metro.batch.planned import limits_of
from metro.commands.calls import part_of_the_call, require_verdict
from metro.commands.status import verdicts
from metro.commands.which import batch_name


def checked_call(
    batch: str, observable: str, limits: Sequence[str], *, processed: Path, reports: Path
) -> str:
    """Return the name of the batch that runs are to be planned for.

    Parameters
    ----------
    batch : its name, or a folder of it. observable : only this one; "" for all. limits : ``COLUMN=LOW:HIGH``.

    Raises
    ------
    CallError
        There is no such batch or observable, or a limit is not valid.
    ContractError
        The batch has no results, or no verdict on the observable.
    """
    name = batch_name(batch, processed, reports)
    with part_of_the_call():
        limits_of(limits)
    require_verdict(name, observable, verdicts(reports / name))
    return name


@contextmanager
def at_work(what: str) -> Iterator[None]:
    """Show on a terminal what is being done and for how long, until this block ends.

    The output of the block is printed after it, when the line of the terminal is free again.
    """
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    shown = Progress(
        *columns, console=console, transient=True, redirect_stdout=False, disable=not console.is_terminal
    )
    said = io.StringIO()
    try:
        with redirect_stdout(said), shown:
            shown.add_task(what, total=None)
            yield
    finally:  # the output that came before an error is not lost
        sys.stdout.write(said.getvalue())
