"""What was identified of the joints and of the payload, in a few words for the first page."""

from __future__ import annotations

from collections.abc import Iterator

from metro.report.numbers import quantity
from metro.units import JSON


def joint_words(identified: JSON) -> Iterator[str]:
    """Yield what was identified of joints and payload."""
    runs = ((identified.get("joints") or {}).get("runs") or {}).values()
    known = {
        joint
        for run in runs
        for joint, value in zip(run["joints"], run["coulomb"], strict=True)
        if value["value"] is not None
    }
    if known:
        yield f"friction of {len(known)} joint{'s' if len(known) > 1 else ''}"
    payload = (identified.get("calibration") or {}).get("payload")
    if payload:
        centre = ", ".join(quantity(payload["centre"][axis], with_unit=False) for axis in "xyz")
        yield f"payload {quantity(payload['mass'])}, its centre at {centre} mm in the flange's frame"
