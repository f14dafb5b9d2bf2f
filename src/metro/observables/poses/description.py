"""What is said of measured poses: which tables they fill, and what a batch has for them."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, capability, plural
from metro.observables.description import Description
from metro.observables.poses import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has of poses; nothing where it has none."""
    series = int((stock.runs["poses"] != "").sum()) if "poses" in stock.runs else 0
    if not series:
        return ()
    arm = [] if stock.has_arm() else ["arm.dh in cell.yaml"]
    source = f"{plural(series, 'run')} with measured poses"
    return (capability("the arm by measured poses", source, arm, measured=True),)


POSES = Description(
    name=NAME,
    title="the arm by measured poses",
    assumes="Joints turn by their readings about the axes of the declared geometry; links and base are "
    "rigid. Corrections and effects are added to that. Unless payload_kg changes within a series, what the "
    "load bends cannot be distinguished from what the arm's own weight does.",
    tables=TABLES,
    shown=TABLES,
    needs=needs,
)
