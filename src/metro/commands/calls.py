"""Calls that are wrong in themselves: what was asked for is not there, or cannot be asked for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from metro.batch.findings import ContractError, Finding, suggestion
from metro.commands.completion import OBSERVABLES


class CallError(ContractError):
    """The call is wrong, not the input: told in one line, exit code 2."""


def wrong_call(what: str, message: str) -> CallError:
    """Return the error that says what is wrong with a part of a call: an option, or what was given for it."""
    return CallError([Finding("error", what, message)])


@contextmanager
def part_of_the_call() -> Iterator[None]:
    """Let what is wrong with the values read in this block be an error of the call."""
    try:
        yield
    except ContractError as error:
        raise CallError(error.problems) from None


def require_name(name: str) -> None:
    """Refuse a name that no batch can have.

    Raises
    ------
    CallError
        It has other characters than those of a batch's folder.
    """
    from metro.batch.discover import NAME, NAME_IN_WORDS

    if not NAME.fullmatch(name):
        raise wrong_call(name, f"is no name for a batch: it is made of {NAME_IN_WORDS}")


def require_verdict(batch: str, observable: str, there: Iterable[str]) -> None:
    """Refuse an observable on which a batch has no verdict; "" stands for all of them.

    Raises
    ------
    CallError
        There is no such observable.
    ContractError
        There is, but not in this batch.
    """
    found = list(there)
    if not observable or observable in found:
        return
    if observable not in OBSERVABLES:
        known = list(dict.fromkeys([*found, *OBSERVABLES]))
        told = suggestion(observable, known) or f", expected one of: {', '.join(found or known)}"
        raise wrong_call(observable, f"is no observable{told}")
    words = f"found verdicts on {', '.join(found)}" if found else "found no verdict at all"
    raise ContractError([Finding("error", batch, f"{words}, expected one on {observable}")])
