"""Names that are like others: what a misspelt column or key was most likely meant to be."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_LEAST = 2  # words in common


def resembling(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that ``name`` is most likely a misspelling of; None where it resembles none."""
    by_lower = {entry.lower(): entry for entry in known}
    without_unit = [entry for entry in by_lower if entry.startswith(f"{name.lower()}_")]
    matches = without_unit or difflib.get_close_matches(name.lower(), by_lower, n=1, cutoff=0.6)
    return by_lower[matches[0]] if matches else None


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return the words that name the nearest known name; "" where ``name`` resembles none."""
    names = list(known)
    near = resembling(name, names) or _of_its_words(name, names)
    return f' (did you mean "{near}"?)' if near else ""


def _of_its_words(name: str, known: Iterable[str]) -> str | None:
    """Return the one known name that has all words of ``name``, or of which it has all (feed_mm)."""
    words = set(name.lower().split("_"))
    others = {entry: set(entry.lower().split("_")) for entry in known}
    near = [entry for entry, its in others.items() if _LEAST <= len(words & its) == min(len(words), len(its))]
    return near[0] if len(near) == 1 else None
