"""The columns of a joint log: positions of up to nine axes, and the torques or currents of their motors."""

from __future__ import annotations

import re
from collections.abc import Sequence

MOST_AXES = 9  # an arm of seven joints on two external axes
AXES = range(1, MOST_AXES + 1)
JOINT_COLUMNS = (
    *(f"q{i}_deg" for i in AXES),
    *(f"q{i}_mm" for i in AXES),
    *(f"q{i}_set_deg" for i in AXES),
    *(f"q{i}_set_mm" for i in AXES),
    *(f"tau{i}_nm" for i in AXES),
    *(f"current{i}_a" for i in AXES),
)
_AXIS = re.compile(r"(?:q|tau|current)(\d)_.*")


def positions(names: Sequence[str]) -> list[str]:
    """Return the column of each axis' position, from axis 1 to the last before one that has none."""
    found: list[str] = []
    for i in AXES:
        column = next((name for name in (f"q{i}_deg", f"q{i}_mm") if name in names), "")
        if not column:
            break
        found.append(column)
    return found


def fault_of(names: Sequence[str]) -> str:
    """Say which column a joint log of these columns lacks, or has too much; "" where it is whole."""
    own = [name for name in JOINT_COLUMNS if name in names]
    count = len(positions(own))
    if count < 2:
        return "q1_deg, q2_deg, … (q1_mm of a linear axis), the positions of two axes or more"
    beyond = next((name for name in own if int(_AXIS.sub(r"\1", name)) > count), "")
    if beyond:
        return f"q{count + 1}_deg, since there is {beyond}: the axes are counted from 1 without a gap"
    twice = next((i for i in AXES if f"q{i}_deg" in own and f"q{i}_mm" in own), 0)
    if twice:
        return f"one position of axis {twice}: there are q{twice}_deg and q{twice}_mm"
    driven = [name for name in own if name.startswith(("tau", "current"))]
    if not driven:
        return "tau1_nm, … (torques of the motors) or current1_a, … (their currents)"
    both = next((i for i in AXES if f"tau{i}_nm" in own and f"current{i}_a" in own), 0)
    return f"one drive signal of axis {both}: there are tau{both}_nm and current{both}_a" if both else ""


def fault_of_six(names: Sequence[str]) -> str:
    """Say which column the robot log of a cut lacks beside its angles; "" where it is whole."""
    for least, whole in (("q{}_set_deg", False), ("tau{}_nm", True), ("current{}_a", True)):
        wanted = [least.format(i) for i in range(1, 7)]
        missing = [name for name in wanted if name not in names]
        if 0 < len(missing) < len(wanted):
            return f"the column {', '.join(missing)}, expected {wanted[0]} to {wanted[-1]}"
        if whole and not missing:
            return ""
    return "tau1_nm to tau6_nm (torques of the motors), or current1_a to current6_a (their currents)"
