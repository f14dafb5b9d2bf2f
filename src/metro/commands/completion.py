"""Names that a shell completes when the tab key is pressed: batches, observables and effects."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import typer


def with_results(reports: Path) -> list[str]:
    """Return the batches that have results in a folder."""
    return sorted(path.parent.name for path in reports.glob("*/verdict.json"))


def batches(incomplete: str) -> Iterator[str]:
    """Yield the batches that have results in the working folder."""
    return (name for name in with_results(Path("reports")) if name.startswith(incomplete))


def observables(incomplete: str) -> Iterator[str]:
    """Yield the observables of the contract."""
    from metro.observables.catalogue import names

    return (name for name in names() if name.startswith(incomplete))


def effects(context: typer.Context, incomplete: str) -> Iterator[str]:
    """Yield the effects that a simulated batch of the kind asked for may hide."""
    from metro.batch.findings import ContractError
    from metro.commands.hidden import simulated

    try:
        known = simulated().get(context.params.get("kind") or "force", {})
    except ContractError:  # a shell has no place for a message
        return iter(())
    return (name for name in known if name.startswith(incomplete))
