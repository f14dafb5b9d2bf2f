"""What was identified of the joints and of the payload, in a few words for the first page."""

from __future__ import annotations

from collections.abc import Iterator

from metro.report.content import Facts, Item, Picture
from metro.report.figures import joint_logs as figures
from metro.report.numbers import quantity
from metro.report.results import Results
from metro.units import JSON


def joint_words(identified: JSON) -> Iterator[str]:
    """Yield what was identified of joints, tool, work and payload."""
    runs = ((identified.get("joints") or {}).get("runs") or {}).values()
    known = {
        joint
        for run in runs
        for joint, value in zip(run["joints"], run["coulomb"], strict=True)
        if value["value"] is not None
    }
    if known:
        yield f"friction of {len(known)} joint{'s' if len(known) > 1 else ''}"
    calibrated = identified.get("calibration") or {}
    touched = [name for name in ("tool", "work") if name in calibrated]
    if touched:
        yield f"{' and '.join(touched)} by touched points"
    payload = calibrated.get("payload")
    if payload:
        centre = ", ".join(quantity(payload["centre"][axis], with_unit=False) for axis in "xyz")
        yield f"payload {quantity(payload['mass'])}, its centre at {centre} mm in the flange's frame"


def joint_facts(results: Results) -> list[Item]:
    """Give the payload, the largest friction and the figure that shows one of them; nothing without logs."""
    identified = results.identified
    payload = (identified.get("calibration") or {}).get("payload") or {}
    course, curve = (results.tables.get(name) for name in ("payload_course", "joint_log_curve"))
    table = results.tables.get("joint_log")
    if table is None or curve is None:
        return []
    facts = []
    if "mass" in payload:
        facts.append(("mass of the payload", quantity(payload["mass"]), "95 % interval, drives included"))
    run = str(curve["run"].iloc[0])
    one = identified["joints"]["runs"][run]
    pairs = zip(one["joints"], one["coulomb"], strict=True)
    # Friction opposes the motion: an interval that reaches zero determines none.
    known = [(joint, value) for joint, value in pairs if (value["ci95"][0] or 0.0) > 0.0]
    if known:
        joint, value = max(known, key=lambda pair: abs(pair[1]["value"]))
        facts.append(("largest Coulomb friction", quantity(value), f"joint {joint}, run {run}"))
    items: list[Item] = [Facts(facts)] if facts else []
    if course is not None:
        caption = "What the load adds to the torques of the joints: measured, and of the payload identified."
        items.append(Picture(figures.load(course), caption, caption))
    else:
        caption = f"Friction of the joints by their speed, run {run}."
        drawn = figures.friction(curve[curve["run"] == run], table[table["run"] == run])
        items.append(Picture(drawn, caption, caption))
    return items


def joint_next(results: Results) -> Iterator[str]:
    """Yield what would make more of the joint logs of a batch, or would make it more certain."""
    block, table = results.identified.get("joints"), results.tables.get("joint_log")
    if not block or table is None:
        return
    if table["remark"].str.contains("arm.dh").any():
        yield (
            "the joints: the arm's geometry (arm.dh or arm.urdf in cell.yaml), to separate friction and "
            "weight"
        )
    elif "condition" not in table:
        yield "the joints: a longer log in which every joint turns both ways at several speeds"
    elif (table["unit"] == "A").any():
        yield "the joints: drives.torque_per_ampere_nm_a in cell.yaml, to turn currents into torques"
    elif "none is declared" in str(block.get("drives")):
        yield (
            "the joints: a pair of logs with and without a load of known mass, or drives.uncertainty in "
            "cell.yaml: the assumed error of the drive constants is most of the intervals"
        )
    if table["tracking_mdeg"].isna().all():
        yield "the joints: set-points beside the measured angles (q1_set_deg …), to see how the arm follows"
