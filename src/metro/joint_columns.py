"""The columns of a joint log: positions of up to nine axes, and the torques or currents of their motors."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

MOST_AXES = 9  # an arm of seven joints on two external axes
AXES = range(1, MOST_AXES + 1)
TURNS, SHIFTS = tuple(f"q{i}_deg" for i in AXES), tuple(f"q{i}_mm" for i in AXES)
POSITIONS = (*TURNS, *SHIFTS)
PLACE, TURNED = ("x_mm", "y_mm", "z_mm"), ("rx_deg", "ry_deg", "rz_deg")
TORQUES = tuple(f"tau{i}_nm" for i in AXES)
JOINT_COLUMNS = (
    *POSITIONS,
    *(name.replace("_", "_set_") for name in POSITIONS),
    *TORQUES,
    *(f"current{i}_a" for i in AXES),
    *(f"temperature{i}_c" for i in AXES),
    "temperature_c",
)
MOVED = tuple(
    form.format(i, unit)
    for form in ("rate{}_{}_s", "acceleration{}_{}_s2")
    for unit in ("deg", "mm")
    for i in AXES
)
_AXIS = re.compile(r"(?:q|tau|current|temperature)(\d)_.*")


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
    beyond = next((name for name in own if _AXIS.match(name) and int(_AXIS.sub(r"\1", name)) > count), "")
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


def fault_of_poses(names: Sequence[str]) -> str:
    """Say which position of a joint a table lacks, or has too much; "" where it is whole."""
    own = [name for name in POSITIONS if name in names]
    count = len(positions(own))
    if count < 2:
        return "q1_deg, q2_deg, … (q1_mm of a linear axis), the positions of two axes or more"
    if len(own) > count:
        beyond = next(name for name in own if name not in positions(own))
        return f"one position of each axis, counted from 1 without a gap: there is {beyond}"
    return ""


def fault_of_targets(names: Sequence[str]) -> str:
    """Say what a table of targets lacks: joints, or places of the tip with all three angles or none."""
    if any(name in names for name in POSITIONS):
        return fault_of_poses(names)
    lacking = [name for name in PLACE if name not in names]
    if lacking:
        return f"{POSITIONS[0]}, {POSITIONS[1]}, … of the joints, or {', '.join(PLACE)} of the tip"
    turned = [name for name in TURNED if name in names]
    lacking = [name for name in TURNED if name not in names]
    return f"{', '.join(lacking)} beside {', '.join(turned)}" if turned and lacking else ""


def fault_of_cut(names: Sequence[str]) -> str:
    """Say which column the robot log of a cut lacks, or has too much; "" where it is whole.

    Every axis that turns has a torque or a current; the drive of a linear axis is not evaluated.
    """
    if fault := fault_of(names):
        return fault
    axes = axes_in(names)
    for wanted in (axes.commanded, axes.torques, axes.driven("current{}_a")):
        missing = [name for name in wanted if name not in names]
        if 0 < len(missing) < len(wanted):
            return f"the column {', '.join(missing)}, expected {wanted[0]} to {wanted[-1]}"
    currents = axes.driven("current{}_a")
    if axes.torques and axes.torques[0] not in names and currents[0] not in names:
        return f"{axes.torques[0]}, … (torques of the motors) or {currents[0]}, … (their currents)"
    return ""


def numbered(form: str, names: Iterable[object]) -> list[str]:
    """Return those of ``names`` that are the ``form`` with the number of an axis, by that number."""
    own = set(names)
    return [name for name in (form.format(i) for i in AXES) if name in own]


@dataclass(frozen=True)
class Axes:
    """The columns of the axes of an arm, in tables of joint logs and of load tests.

    ``linear``: of each axis from the base up, whether it shifts (mm) instead of turning (deg).
    """

    linear: tuple[bool, ...]

    def __len__(self) -> int:
        return len(self.linear)

    @property
    def positions(self) -> list[str]:
        """Measured positions, ``q1_deg`` …, or ``q1_mm`` of a linear axis."""
        return self._of("q{}_{}")

    @property
    def commanded(self) -> list[str]:
        """Set-points, from ``q1_set_deg``."""
        return self._of("q{}_set_{}")

    @property
    def rates(self) -> list[str]:
        """Speeds, from ``rate1_deg_s``."""
        return self._of("rate{}_{}_s")

    @property
    def accelerations(self) -> list[str]:
        """Accelerations, from ``acceleration1_deg_s2``."""
        return self._of("acceleration{}_{}_s2")

    @property
    def units(self) -> list[float]:
        """What one of each position's unit is in SI: rad, or m."""
        from metro.units import DEG, MM  # which imports NumPy, and this module is imported with the contract

        return [MM if linear else DEG for linear in self.linear]

    @property
    def turning(self) -> list[int]:
        """Places of the axes that turn, from 0: those whose drives are evaluated."""
        return [place for place, linear in enumerate(self.linear) if not linear]

    def driven(self, form: str) -> list[str]:
        """Columns of the axes that turn: the ``form`` with their numbers."""
        return [form.format(place + 1) for place in self.turning]

    @property
    def torques(self) -> list[str]:
        """Torques of the motors of the axes that turn, from ``tau1_nm``."""
        return self.driven("tau{}_nm")

    def _of(self, form: str) -> list[str]:
        return [form.format(i + 1, "mm" if linear else "deg") for i, linear in enumerate(self.linear)]


def axes_in(names: Sequence[str]) -> Axes:
    """Return the axes whose positions are among the names of columns."""
    return Axes(tuple(name.endswith("_mm") for name in positions(names)))


def stated(table: pd.DataFrame) -> list[str]:
    """Return the columns of positions in which a table has any number."""
    there = [name for name in POSITIONS if name in table]
    if table.empty:  # as where a batch has no such table
        return []
    return list(table[there].columns[table[there].notna().any()])


def axes_of(table: pd.DataFrame) -> Axes:
    """Return the axes whose positions a table states; a column without any number is none."""
    return axes_in(stated(table))
