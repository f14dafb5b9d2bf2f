"""Entries of a manifest or a cell's description, by dotted paths of keys."""

from __future__ import annotations

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
