"""What snakemake says while it works: a line for each finished step, a bar, and the causes of failures last.

Its own log, with everything that it has to say, is in ``.snakemake/log`` all the same; a dry run says what it
always does, and so does a call that asks for more (``--verbose``, ``--printshellcmds``).
"""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

STREAM = "DefaultStreamHandler"  # the name of snakemake's handler that writes to the terminal
# Parts of what is worth saying of what is said without an event: what one asked for, and where jobs went.
SAID = ("Nothing to be done", "Congratulations", "has been submitted")
SAID_LAST = (
    "Exiting because",
    "CalledProcessError",
)  # beginnings of what the logs of failed steps say better


def show_progress(logger: logging.Logger, settings: Any) -> None:
    """Let snakemake's ``logger`` write to the terminal through :class:`ProgressHandler`.

    ``settings`` : ``output_settings`` of the workflow.
    """
    if settings.dryrun or settings.verbose or settings.debug_dag or settings.printshellcmds:
        return
    for handler in list(logger.handlers):
        if handler.name == STREAM and isinstance(handler, logging.StreamHandler):
            own = ProgressHandler(Console(file=handler.stream, highlight=False, soft_wrap=True))
            own.setFormatter(handler.formatter)
            own.filters = list(handler.filters)
            logger.removeHandler(handler)
            logger.addHandler(own)


class ProgressHandler(logging.Handler):
    """Writes the records of a run of snakemake to a console."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self.name = STREAM
        self._console = console
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("left:"))
        self._bar = Progress(*columns, TimeRemainingColumn(), console=console, transient=True)
        self._jobs: dict[int, tuple[str, float]] = {}  # what each is about, and when it began
        self._finished: list[int] = []
        self._failures: dict[int, tuple[str, list[str]]] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record, or keep what it tells for a later one."""
        told: Any = record
        event = str(getattr(record, "event", None))
        if event == "job_info":
            self._jobs[told.jobid] = (told.rule_msg or told.rule_name, time.monotonic())
        elif event == "job_finished":
            self._finished.append(told.job_id)
            self._failures.pop(told.job_id, None)  # it was tried again
        elif event == "progress":
            self._progress(told.done, told.total)
        elif event == "job_error":
            words, _ = self._jobs.get(told.jobid, (told.rule_name, 0.0))
            self._failures[told.jobid] = (words, [str(log) for log in told.log])
            self._say(f"failed: {words}")
        elif self._is_worth_saying(record):
            self._say(self.format(record))

    def close(self) -> None:
        """Say last what made steps fail: the last lines of a terminal are those that are read."""
        self._bar.stop()
        for words, logs in self._failures.values():
            self._say(f"\n{words}: failed")
            for log in map(Path, logs):
                said = log.read_text(errors="replace").strip() if log.is_file() else ""
                self._say(f"{said or 'its log is empty'}\n({log})")
        self._failures = {}
        super().close()

    def _is_worth_saying(self, record: logging.LogRecord) -> bool:
        lines = str(record.msg).splitlines()
        if any(line.startswith(SAID_LAST) for line in lines[:2]):
            return False
        return record.levelno >= logging.WARNING or any(part in str(record.msg) for part in SAID)

    def _progress(self, done: int, total: int) -> None:
        if self._console.is_terminal:
            if not self._bar.tasks:
                self._bar.start()
                self._bar.add_task("", total=total)
            self._bar.update(self._bar.tasks[0].id, completed=done, total=total)
        for job in self._finished:
            words, began = self._jobs.get(job, ("", time.monotonic()))
            took = time.monotonic() - began
            self._say(f"{done:{len(str(total))}} of {total} steps  {words}  ({took:.0f} s)")
        self._finished.clear()

    def _say(self, text: str) -> None:
        if text and text != "None":
            self._console.print(escape(text))
