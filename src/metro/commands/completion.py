"""Names that a shell completes when the tab key is pressed: batches and observables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

OBSERVABLES = ("force", "joint_force", "deformation", "waviness", "flatness", "lobes")


def batches(incomplete: str) -> Iterator[str]:
    """Yield the batches that have results in the working folder."""
    for path in sorted(Path("reports").glob("*/verdict.json")):
        if path.parent.name.startswith(incomplete):
            yield path.parent.name


def observables(incomplete: str) -> Iterator[str]:
    """Yield the observables of the contract."""
    return (name for name in OBSERVABLES if name.startswith(incomplete))
