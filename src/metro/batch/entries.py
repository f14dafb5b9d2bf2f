"""Entries of a manifest or a cell's description, by dotted paths of keys."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from metro.units import JSON

UNKNOWN = "unknown"  # cell of a batch that names no machine
FILE = "batch.yaml"


def entry(content: JSON, path: str) -> Any:
    """Return the value under a dotted path of keys; None where any of them is absent."""
    value: Any = content
    for key in path.split("."):
        value = value.get(key) if isinstance(value, dict) else None
    return value


def without_entries(content: JSON, paths: Iterable[str]) -> JSON:
    """Return a document without the entries under some dotted paths; one within a list takes the list along.

    What needs an entry then finds it missing, and never a text where it expects a number.
    """
    for path in paths:
        content = _without_entry(content, path.split("."))
    return content


def _without_entry(content: JSON, keys: list[str]) -> JSON:
    key, *deeper = keys
    inner = content.get(key)
    if deeper and isinstance(inner, dict):
        return {**content, key: _without_entry(inner, deeper)}
    return {name: value for name, value in content.items() if name != key}
