"""What snakemake shows while it works: a line for each finished step, a bar, the causes of failures last.

The bar is shown from the first step on, names the steps at work, and counts steps by the time that they take:
if each step counted as one, the bar would stand still where nearly all of the time goes.

Snakemake's own complete log is in ``.snakemake/log`` all the same. A dry run shows what it always does, and
so does a call that asks for more (``--verbose``, ``--printshellcmds``).
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

STREAM = "DefaultStreamHandler"  # the name of snakemake's handler that writes to the terminal
# Parts of the messages without an event that are shown: what was asked for, and where jobs were submitted.
SAID = ("Nothing to be done", "Congratulations", "has been submitted")
NOTHING_SAID = (
    "its log is empty: the system ended it, most often because the memory was full. Run fewer steps at once "
    "(--cores 1)"
)
SAID_LAST = (
    "Exiting because",
    "CalledProcessError",
)  # beginnings of messages whose cause the logs of failed steps show better
# Typical seconds of a step, by its rule; what is not named takes none.
SECONDS = {"ingest": 1, "identify": 4, "predict": 3, "loop": 34, "verdict": 1, "report": 4, "campaign": 5}
MOST_SHOWN = 2  # steps at work that the bar names
PACE = 3600.0  # s over which the speed is averaged for the remaining time: a step may take minutes


def show_progress(
    logger: logging.Logger, settings: Any, shorten: Callable[[Iterable[str]], list[str]] = list
) -> None:
    """Let snakemake's ``logger`` write to the terminal through :class:`ProgressHandler`.

    Parameters
    ----------
    settings : ``output_settings`` of the workflow.
    shorten : selects the lines of a failed step's log that are shown.
    """
    if settings.dryrun or settings.verbose or settings.debug_dag or settings.printshellcmds:
        return
    for handler in list(logger.handlers):
        if handler.name == STREAM and isinstance(handler, logging.StreamHandler):
            own = ProgressHandler(Console(file=handler.stream, highlight=False, soft_wrap=True), shorten)
            own.setFormatter(handler.formatter)
            own.filters = list(handler.filters)
            logger.removeHandler(handler)
            logger.addHandler(own)


@dataclass(frozen=True)
class Step:
    """A step: its message, its name beside the bar, its rule, and when it began."""

    words: str
    name: str = ""
    rule: str = ""
    began: float = field(default_factory=time.monotonic)


class ProgressHandler(logging.Handler):
    """Writes the records of a run of snakemake to a console."""

    def __init__(self, console: Console, shorten: Callable[[Iterable[str]], list[str]] = list) -> None:
        super().__init__()
        self._shorten = shorten
        self.name = STREAM
        self._console = console
        self._bar = Progress(
            BarColumn(bar_width=20),
            TextColumn("{task.fields[steps]}"),
            TimeElapsedColumn(),
            TextColumn("left:"),
            TimeRemainingColumn(),
            TextColumn("{task.description}", markup=False),
            console=console,
            transient=True,
            speed_estimate_period=PACE,
        )
        self._task: TaskID | None = None  # none before the first step
        self._planned: Mapping[str, int] = {}  # steps by rule, and the total
        self._steps: dict[int, Step] = {}
        self._at_work: dict[int, str] = {}  # their names
        self._seconds = 0  # that the finished steps typically take
        self._finished: list[int] = []
        self._failures: dict[int, tuple[str, list[str]]] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record, or keep its content for a later one."""
        details: Any = record
        event = str(getattr(record, "event", None))
        if event == "run_info":
            self._planned = getattr(record, "stats", {})
        elif event == "job_info":
            self._begin(details.jobid, _step(details))
        elif event == "job_finished":
            self._finished.append(details.job_id)
            self._at_work.pop(details.job_id, None)
            self._failures.pop(details.job_id, None)  # it was tried again
        elif event == "progress":
            self._progress(details.done, details.total)
        elif event == "job_error":
            words = self._steps.get(details.jobid, Step(details.rule_name)).words
            self._at_work.pop(details.jobid, None)
            self._failures[details.jobid] = (words, [str(log) for log in details.log])
            self._say(f"failed: {words}")
        elif self._is_worth_saying(record):
            self._say(self.format(record))

    def close(self) -> None:
        """Show last what made steps fail: the last lines of a terminal are those that are read."""
        self._bar.stop()
        for words, logs in self._failures.values():
            self._say(f"\n{words}: failed")
            for log in map(Path, logs):
                said = log.read_text(errors="replace").strip() if log.is_file() else ""
                lines = self._shorten(said.splitlines()) or [NOTHING_SAID]
                self._say("\n".join([*lines, f"({log})"]))
        self._failures = {}
        super().close()

    def _is_worth_saying(self, record: logging.LogRecord) -> bool:
        lines = str(record.msg).splitlines()
        if any(line.startswith(SAID_LAST) for line in lines[:2]):
            return False
        return record.levelno >= logging.WARNING or any(part in str(record.msg) for part in SAID)

    def _begin(self, job: int, step: Step) -> None:
        self._steps[job] = step
        self._at_work[job] = step.name
        if self._task is None and self._console.is_terminal:
            seconds = sum(SECONDS.get(rule, 0) * count for rule, count in self._planned.items())
            planned = self._planned.get("total", 0)
            self._task = self._bar.add_task("", total=seconds or None, steps=f"0 of {planned} steps")
            self._bar.start()
        self._show()

    def _progress(self, done: int, total: int) -> None:
        for job in self._finished:
            step = self._steps.get(job, Step(""))
            self._seconds += SECONDS.get(step.rule, 0)
            took = time.monotonic() - step.began
            self._say(f"{done:{len(str(total))}} of {total} steps  {step.words}  ({took:.0f} s)")
        self._finished.clear()
        self._show(steps=f"{done} of {total} steps")

    def _show(self, steps: str = "") -> None:
        """Bring the bar up to date, where there is one."""
        if self._task is None:
            return
        names = list(self._at_work.values())
        more = f" and {len(names) - MOST_SHOWN} more" if len(names) > MOST_SHOWN else ""
        words = f"{', '.join(names[:MOST_SHOWN])}{more}"
        if steps:
            self._bar.update(self._task, steps=steps)
        self._bar.update(self._task, completed=self._seconds, description=words, refresh=True)

    def _say(self, text: str) -> None:
        if text and text != "None":
            self._console.print(escape(text))


def _step(job: Any) -> Step:
    """Return the step that begins, named by its batch and stage."""
    batch = (getattr(job, "wildcards", None) or {}).get("batch")
    stage = "summary" if job.rule_name == "campaign" else job.rule_name
    name = f"{batch}: {stage}" if batch else stage
    return Step(job.rule_msg or job.rule_name, name, job.rule_name)
