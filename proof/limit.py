"""A bound on the processor time of a piece of work, which other work on the same machine does not use up."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager


class OutOfTimeError(BaseException):
    """The time is used up. It is no ``Exception``: what catches these on its way must not catch it."""


@contextmanager
def bounded(seconds: float | None) -> Iterator[None]:
    """Raise :class:`OutOfTimeError` once this process has used so much processor time; None: never."""
    if seconds is None:
        yield
        return

    def stop(*_: object) -> None:
        raise OutOfTimeError(f"it took more than {seconds:g} s of processor time")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
