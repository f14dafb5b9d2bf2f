"""How the check of a batch is shown in a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from metro.batch.alike import alike_as_one
from metro.batch.capabilities import Capability
from metro.batch.check import CheckReport
from metro.batch.entries import FILE
from metro.batch.findings import Finding

if TYPE_CHECKING:
    from rich.console import Group, RenderableType
    from rich.table import Table

COLOURS = {"error": "red", "warning": "yellow", "note": "cyan"}


def render(report: CheckReport) -> Group:
    """Return a check, to be printed by rich: what can be computed, what is there, what is wrong."""
    from rich.console import Group

    return Group(*_parts(report))


def _parts(report: CheckReport) -> Iterator[RenderableType]:
    """Yield the parts in their order; errors come last, where the eye is when the printing stops."""
    from rich.padding import Padding
    from rich.text import Text

    yield Text(f"{report.folder}", style="bold")
    unread = any(one.file == FILE and one.severity == "error" and not one.column for one in report.problems)
    if not unread:  # else the table would list every observable as impossible to compute
        yield Padding(_can(report), (0, 0, 1, 0))
    yield Padding(Text("\n".join((*report.there, f"hold-out: {report.plan['how']}"))), (0, 0, 1, 2))
    for severity in ("note", "warning", "error"):
        lines = [str(finding) for finding in report.problems if finding.severity == severity]
        for line in alike_as_one(lines):
            yield Text.assemble((f"{severity:8}", COLOURS[severity]), line)
    yield Text(_verdict(report.problems), style="bold green" if report.ok else "bold red")


def _can(report: CheckReport) -> Group:
    """Return what can be computed, from what, and what is missing; then what was measured in vain.

    What was not measured at all is named and no more.
    """
    from rich.console import Group
    from rich.text import Text

    sorted_out = sorted(report.capabilities, key=lambda can: not can.source)
    shown = [can for can in sorted_out if can.source or can.measured]
    others = ", ".join(can.name for can in sorted_out if not (can.source or can.measured))
    return Group(
        *([_table(shown)] if shown else []), *([Text(f"not measured here: {others}")] if others else [])
    )


def _table(capabilities: list[Capability]) -> Table:
    from rich.table import Table
    from rich.text import Text

    table = Table(show_edge=False, pad_edge=False, header_style="bold")
    for title in ("observable", "computed from", "missing"):
        table.add_column(title, overflow="fold")
    for can in capabilities:
        source = Text(can.source, style="green") if can.source else Text("cannot be computed", style="yellow")
        table.add_row(can.name, source, Text("\n".join(can.missing)))
    return table


def _verdict(problems: tuple[Finding, ...]) -> str:
    """Count what was found, in words."""
    counts = {severity: sum(finding.severity == severity for finding in problems) for severity in COLOURS}
    words = [f"{count} {severity}{'' if count == 1 else 's'}" for severity, count in counts.items() if count]
    return f"\n{', '.join(words) or 'nothing to complain of'}: " + (
        "the batch cannot be run until the errors are mended" if counts["error"] else "the batch can be run"
    )
