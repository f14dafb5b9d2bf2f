"""Errors of a command's call: what it asks for does not exist, or cannot be asked for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from metro.batch.findings import ContractError, Finding
from metro.spelling import suggestion


class CallError(ContractError):
    """The call is wrong, not the input: the message takes one line, and the exit code is 2."""


def wrong_call(what: str, message: str) -> CallError:
    """Return the error for a part of a call: an option, or the value that was given for it."""
    return CallError([Finding("error", what, message)])


@contextmanager
def part_of_the_call() -> Iterator[None]:
    """Turn the contract errors of the values read in this block into errors of the call."""
    try:
        yield
    except ContractError as error:
        raise CallError(error.problems) from None


def require_name(name: str) -> None:
    """Refuse a name that no batch can have.

    Raises
    ------
    CallError
        The name has characters that the name of a batch's folder cannot have.
    """
    from metro.batch.discover import NAME, NAME_IN_WORDS

    if not NAME.fullmatch(name):
        raise wrong_call(name, f"is no name for a batch: it is made of {NAME_IN_WORDS}")


def require_verdict(batch: str, observable: str, there: Iterable[str]) -> None:
    """Refuse an observable on which a batch has no verdict; "" means all of them.

    Raises
    ------
    CallError
        There is no such observable.
    ContractError
        There is such an observable, but this batch has no verdict on it.
    """
    available = list(there)
    if not observable or observable in available:
        return
    from metro.observables.catalogue import names

    if observable not in names():
        known = list(dict.fromkeys([*available, *names()]))
        expected = suggestion(observable, known) or f", expected one of: {', '.join(available or known)}"
        raise wrong_call(observable, f"is no observable{expected}")
    words = f"found verdicts on {', '.join(available)}" if available else "found no verdict at all"
    raise ContractError([Finding("error", batch, f"{words}, expected one on {observable}")])
