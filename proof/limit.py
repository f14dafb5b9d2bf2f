"""A bound on the processor time of a piece of work, which other work on the same machine does not use up."""

from __future__ import annotations

import os
import signal
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

Ending = Callable[[float, FrameType | None], None]


class OutOfTimeError(BaseException):
    """The time is used up. It is no ``Exception``: what catches these on its way must not catch it."""


def raised(seconds: float, _frame: FrameType | None) -> None:
    """Raise :class:`OutOfTimeError`; where compiled code calls Python, that may take the process along."""
    raise OutOfTimeError(_words(seconds))


def ended(reason: Path, code: int) -> Ending:
    """Return what ends the process at once with an exit code, and writes where it was to a file before."""

    def stop(seconds: float, frame: FrameType | None) -> None:
        reason.parent.mkdir(parents=True, exist_ok=True)
        reason.write_text("".join(traceback.format_stack(frame)) + _words(seconds) + "\n")
        os._exit(code)

    return stop


@contextmanager
def bounded(seconds: float | None, stop: Ending = raised) -> Iterator[None]:
    """Call ``stop`` once this process has used so many ``seconds`` of processor time; None: never."""
    if seconds is None:
        yield
        return
    limit = seconds
    before = signal.signal(signal.SIGPROF, lambda _, frame: stop(limit, frame))
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def _words(seconds: float) -> str:
    return f"it took more than {seconds:g} s of processor time"
