"""How names, pairs, runs and probabilities are written."""

from __future__ import annotations

from collections.abc import Sequence

from metro.units import JSON


def plain(name: str) -> str:
    """Write the name of an effect or observable as words."""
    return name.replace("_", " ")


def listed(names: Sequence[str]) -> str:
    """Name effects in a row."""
    *first, last = map(plain, names)
    return f"{', '.join(first)} and {last}" if first else last


def pair(names: Sequence[str]) -> str:
    """Name an effect and its rival."""
    effect, rival = names
    return f"{plain(effect)} from {plain(rival)}"


def chance(probability: float) -> str:
    """Write a probability so that none is one."""
    return "more than 0.99" if probability > 0.99 else f"{probability:.2f}"


def cut(run: JSON) -> str:
    """Name runs of one kind, and how often they are made."""
    return str(run["proposal"]) + (f", {run['repeats']} times" if run["repeats"] > 1 else "")
