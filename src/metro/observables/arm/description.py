"""What is said of setting a cell up: what a batch has for tool, work and payload."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, capability, plural
from metro.observables.description import Description


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has of touched points and of torques under a payload; nothing where it has none."""
    touches, payload = stock.tables["touches"], stock.tables["payload"]
    found = []
    if len(touches):
        found.append(Capability("tool and work", f"{plural(len(touches), 'row')} of touches.csv"))
    if len(payload):
        lacking = [] if stock.has_arm() else ["arm.dh or arm.urdf in cell.yaml"]
        source = f"torques in {plural(len(payload), 'row')} of payload.csv"
        found.append(capability("payload", source, lacking, measured=True))
    return tuple(found)


CALIBRATION = Description(
    name="calibration",
    title="tool, work and payload",
    assumes="",
    tables=(),
    needs=needs,
)
