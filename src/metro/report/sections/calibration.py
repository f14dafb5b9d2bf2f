"""Setting a cell up: tool and work from touched points, the payload from torques, beside what is declared."""

from __future__ import annotations

import math
from collections.abc import Iterator

from metro.report.content import Bullets, Heading, Item, Paragraph, Picture, Section, Table
from metro.report.figures import joint_logs as figures
from metro.report.numbers import listing, number, percent, quantity
from metro.report.results import Results
from metro.units import JSON, printed

ANGLES = {"rx": "roll", "ry": "pitch", "rz": "yaw"}
FAR = 3.0  # half widths of the interval
CONVENTION = (
    "Angles: R = Rz(rz) Ry(ry) Rx(rx), the Z-Y-X order of ABB; quaternions: scalar first. All touched points "
    "share one least squares, so that an error of the tool is in that of the work."
)
Row = tuple[str, JSON, float]


def calibration(results: Results) -> Section | None:
    """Write tool, work and payload with intervals and the declared values; None for a batch without."""
    block = results.identified.get("calibration")
    if not block:
        return None
    items: list[Item] = []
    for title, rows, said in (
        (
            "Tool and work from touched points",
            [*_tool(block, results), *_work(block, results)],
            _touching(block),
        ),
        ("Payload from the joints' torques", [*_payload(block, results)], _torques(block)),
    ):
        if rows:
            items += [Heading(title), _table(rows, said)]
    items += _by_joint(block, results)
    quaternion = (block.get("work") or {}).get("quaternion")
    if quaternion:
        parts = ", ".join(f"{part:.6f}" for part in quaternion).replace("-", "−")
        items.append(
            Paragraph(
                f"Orientation of the work as a quaternion (q1, q2, q3, q4): {parts}. {CONVENTION}", "note"
            )
        )
    missing = block.get("not_identified") or {}
    if missing:
        items.append(
            Bullets([f"{name}: not identified, {reason.rstrip('.')}." for name, reason in missing.items()])
        )
    return Section("Setup and calibration", items)


def _tool(block: JSON, results: Results) -> Iterator[Row]:
    declared = results.batch.manifest.get("tool_in_flange_mm") or [math.nan] * 3
    for axis, value in zip("xyz", declared, strict=True):
        if "tool" in block:
            yield f"tool centre point {axis}, flange frame", block["tool"][axis], float(value)


def _work(block: JSON, results: Results) -> Iterator[Row]:
    if "work" not in block:
        return
    frame = results.batch.manifest.get("work_in_base") or {}
    place, angles = frame.get("xyz_mm") or [math.nan] * 3, frame.get("rpy_deg") or [math.nan] * 3
    for axis, value in zip("xyz", place, strict=True):
        yield f"work origin {axis}, base", block["work"][axis], float(value)
    for name, value in zip(ANGLES, angles, strict=True):
        yield f"work angle {name} ({ANGLES[name]})", block["work"][name], float(value)


def _payload(block: JSON, results: Results) -> Iterator[Row]:
    carried = block.get("payload")
    if not carried:
        return
    head = (results.batch.cell.get("arm") or {}).get("head") or {}
    yield "mass", carried["mass"], float(head.get("mass_kg", math.nan))
    for axis, value in zip("xyz", head.get("centre_mm") or [math.nan] * 3, strict=True):
        yield f"centre of gravity {axis}, flange frame", carried["centre"][axis], float(value)
    xx, yy, zz, xy, xz, yz = head.get("inertia_kg_m2") or [math.nan] * 6
    declared = {"xx": xx, "xy": xy, "xz": xz, "yy": yy, "yz": yz, "zz": zz}
    for name, own in (carried.get("inertia") or {}).items():
        yield f"moment of inertia {name} about the centre", own, float(declared[name])


def _table(rows: list[Row], said: str) -> Table:
    apart = [_apart(found, declared) for _, found, declared in rows]
    far = [place for place, off in enumerate(apart) if off > FAR]
    known = sum(math.isfinite(off) for off in apart)
    finding = (
        f"{len(far) or 'None'} of {known} declared values are outside {FAR:g} intervals. " if known else ""
    )
    body = [
        [
            name,
            quantity(found, with_unit=False),
            printed(found["unit"]),
            number(declared, 6) if math.isfinite(declared) else "–",
            number(off, 2) if math.isfinite(off) else "–",
        ]
        for (name, found, declared), off in zip(rows, apart, strict=True)
    ]
    header = ["quantity", "identified", "unit", "declared", "difference over interval"]
    caption = f"{finding}{said} Difference: of identified and declared, over half the 95 % interval."
    return Table(header, body, caption, [2.4, 1.6, 0.6, 1, 1.2], numeric=[1, 3, 4], strong=far)


def _apart(found: JSON, declared: float) -> float:
    low, high = found["ci95"]
    half = 0.5 * (high - low) if low is not None and high is not None else 0.0
    return abs(found["value"] - declared) / half if half > 0 else math.nan


def _touching(block: JSON) -> str:
    touching = block.get("touching")
    if not touching:
        return ""
    rms = quantity(touching["rms"])
    return (
        f"The residual of the touched points is {rms} (rms, {touching['dof']} degrees of freedom); errors "
        "from "
        f"{touching['errors_from']}."
    )


def _by_joint(block: JSON, results: Results) -> list[Item]:
    """Say what the interval of a payload of joint logs holds, and draw what the load adds to the torques."""
    carried, course = block.get("payload") or {}, results.tables.get("payload_course")
    if "by_joint" not in carried:
        return []
    factors = [
        f"joint {joint} {quantity(factor, with_unit=False)}"
        for joint, factor in enumerate(carried["by_joint"], start=1)
        if factor
    ]
    mass = quantity(carried["mass_by_logs_alone"])
    scatter = percent(carried["scatter_of_drives"])
    text = (
        f"By noise and friction alone the mass would be {mass}. In its interval is, besides, the error of "
        f"the drive constants: {carried['drives']}. What they share scales every mass and moment alike: no "
        "log of torques or currents can show it. Factor by which each joint alone would change the load: "
        f"{listing(factors)}; beyond what is declared, the constants scatter from joint to joint by "
        f"{scatter}, which is in the interval, too. To know the mass better, weigh it, or take a pair of "
        "logs with a known mass."
    )
    items: list[Item] = [Paragraph(text)]
    if course is not None:
        one, two = carried["pairs"][0]
        caption = (
            f"Torques of run {two} less those of run {one} at the same places, and the torque of the load "
            "that was identified; what differs is friction that the load changes."
        )
        items.append(Picture(figures.load(course), caption, caption))
    return items


def _torques(block: JSON) -> str:
    carried = block.get("payload")
    if not carried:
        return ""
    left = ", ".join("–" if value is None else number(value, 2) for value in carried["rms"])
    inertia = "" if "inertia" in carried else " Torques at rest do not determine the moments of inertia."
    joints = carried["joints"]
    where = f"joints {joints[0]} to {joints[-1]}"
    return f"The residual of the torques with and without the load is {left} N m at {where} (rms).{inertia}"
