"""Joint logs among unknown files: angles, torques, currents by the names of columns, or by their courses."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath

import numpy as np

from metro.formats.measures import MeasureError, measure
from metro.importing.look import Column, Seen
from metro.importing.propose import Proposal, is_clock, time_of
from metro.joint_columns import MOST_AXES

DRIVE = "joints.drive"  # the question for the columns of currents or torques
ANGLES = "joints.angles"
LEAST_AXES = 2
ALIKE = 0.98  # correlation of a column with the differences of another one, which it is the speed of
# Names of joint logs, the number of the axis at the end: RTDE of Universal Robots, ROS, KUKA, ABB, libraries.
_MEASURED, _SET = r"(?:actual|meas(?:ured)?|act)?_?", r"(?:target|set|cmd|command(?:ed)?|desired)_?"
_ANGLE = r"(?:q|joint|pos(?:ition)?s?|angle)"
_NAMES = {
    "q{}_set_deg": rf"{_SET}{_ANGLE}|(?:q|joint)_?(?:set|cmd|d(?:es)?)",
    "q{}_deg": rf"{_MEASURED}(?:{_ANGLE}|joint_?pos(?:ition)?s?|axis|a)",
    "current{}_a": rf"{_MEASURED}(?:motor_?|joint_?)?(?:current|i|amp)s?",
    "tau{}_nm": rf"{_MEASURED}(?:motor_?|joint_?)?(?:tau|torque|effort|moment|t)s?(?:_?j)?",
}
_NUMBERED = re.compile(r"(?P<stem>.*?)[ _\[(.]*(?P<axis>\d)[\])]?(?: *\[(?P<unit>[^\]]*)\])?")


def joint_log(seen: Seen) -> Proposal | None:
    """Propose how a joint log is read; None where a file shows none."""
    return _by_name(seen) or _by_course(seen)


def _by_name(seen: Seen) -> Proposal | None:
    """Find numbered names of angles, and of torques or currents."""
    found: dict[str, dict[int, Column]] = {}
    for column in seen.columns:
        match = _NUMBERED.fullmatch(column.name.strip())
        if not match:
            continue
        for name, pattern in _NAMES.items():
            if re.fullmatch(pattern, match["stem"].strip(), re.IGNORECASE):
                found.setdefault(name, {})[int(match["axis"])] = column
                break
    angles = found.get("q{}_deg", {})
    axes = _consecutive(angles)
    drive = next((name for name in ("tau{}_nm", "current{}_a") if set(found.get(name, {})) >= set(axes)), "")
    time = time_of(seen)
    if len(axes) < LEAST_AXES or not drive:
        return None
    columns: dict[str, str | int | tuple[str, int]] = {} if time is None else {"t_s": time.name}
    stated = {} if time is None or not time.unit else {"t_s": time.unit}
    for name in ("q{}_deg", "q{}_set_deg", drive):
        for place, axis in enumerate(axes, start=1):
            if axis in found.get(name, {}):
                own = found[name][axis]
                columns[name.format(place)] = own.name
                stated |= {name.format(place): own.unit} if own.unit else {}
    why = {name: f"the name {source}" for name, source in columns.items()}
    timed = time is not None or seen.step is not None
    return Proposal("joints", ((seen.path.name, ""),), seen.path.name, columns, why, timed, stated)


def _consecutive(angles: Mapping[int, Column]) -> list[int]:
    """Return the axes from 0 or 1 on, without a gap."""
    axes = sorted(angles)
    whole = bool(axes) and axes[0] in (0, 1) and axes == list(range(axes[0], axes[0] + len(axes)))
    return axes if whole and len(axes) <= MOST_AXES else []


def _by_course(seen: Seen) -> Proposal | None:
    """Find columns without names that are a clock, angles, and these angles' speeds, in this order."""
    if any(column.name for column in seen.columns) or len(seen.columns) < 1 + 2 * LEAST_AXES:
        return None
    time = seen.columns[0].values
    if not is_clock(time, uneven=True):
        return None
    for count in range(MOST_AXES, LEAST_AXES - 1, -1):
        if len(seen.columns) < 1 + 3 * count:
            continue
        angles, speeds = seen.columns[1 : 1 + count], seen.columns[1 + count : 1 + 2 * count]
        if all(_is_speed(a.values, s.values, time) for a, s in zip(angles, speeds, strict=True)):
            columns: dict[str, str | int | tuple[str, int]] = {"t_s": 1}
            columns |= {f"q{i}_deg": i + 1 for i in range(1, count + 1)}
            why = dict.fromkeys(columns, f"columns {2 + count} to {1 + 2 * count}, which are its speed")
            why["t_s"] = "column 1, which rises like a clock"
            why |= {f"q{i}_deg": f"column {i + count + 1}, which is its speed" for i in range(1, count + 1)}
            return Proposal("joints", ((seen.path.name, ""),), seen.path.name, columns, why, True)
    return None


def _is_speed(angle: np.ndarray, speed: np.ndarray, time: np.ndarray) -> bool:
    """Return whether one column is the speed of another one: their steps, over some samples, go together."""
    step = max(1, len(time) // 1000)
    moved = (angle[step:] - angle[:-step]) / (time[step:] - time[:-step])
    half = 0.5 * (speed[step:] + speed[:-step])
    if not (np.isfinite(moved).all() and moved.std() > 0.0 and half.std() > 0.0):
        return False
    return bool(np.corrcoef(moved, half)[0, 1] > ALIKE)


def lacks_drive(proposal: Proposal) -> bool:
    """Return whether a joint log is proposed whose torques or currents are not known yet."""
    known = any(name.startswith(("tau", "current")) for name in proposal.columns)
    return proposal.kind == "joints" and bool(proposal.columns) and not known


def axes_of(proposal: Proposal) -> int:
    """Return how many axes a proposed joint log has."""
    return sum(name.startswith("q") and "_set_" not in name for name in proposal.columns)


def span(answer: str) -> list[int]:
    """Return the numbers of columns of an answer, as 14-19 or 3,5,7; none where it is no such answer."""
    match = re.fullmatch(r"(\d+) *(?:-|–|…|\.\.) *(\d+)", answer.strip())
    if match:
        return list(range(int(match[1]), int(match[2]) + 1))
    parts = [part.strip() for part in answer.split(",")]
    return [int(part) for part in parts] if all(part.isdigit() for part in parts) else []


def with_drive(proposal: Proposal, answers: Mapping[str, str]) -> Proposal:
    """Return a joint log with the columns of the drives that were answered."""
    if not lacks_drive(proposal) or DRIVE not in answers:
        return proposal
    name = "current{}_a" if _is_current(answers.get("unit.drive", "")) else "tau{}_nm"
    given = {name.format(i): at for i, at in enumerate(span(answers[DRIVE]), start=1)}
    why = dict.fromkeys(given, f"your answer to {DRIVE}")
    stated = dict.fromkeys(given, answers.get("unit.drive", ""))
    return replace(
        proposal,
        columns={**proposal.columns, **given},
        why={**proposal.why, **why},
        stated={**proposal.stated, **stated},
    )


def _is_current(unit: str) -> bool:
    try:
        return measure(unit).quantity == "current"
    except MeasureError:
        return False


def together(proposals: Sequence[Proposal]) -> Iterator[Proposal]:
    """Yield the proposals, joint logs of one layout as one: they share a mapping."""
    merged: list[Proposal] = []
    for each in proposals:
        for at, other in enumerate(merged):
            suffixes = {PurePath(p.pattern).suffix for p in (each, other)}
            alike = (each.kind, each.columns, each.stated) == (other.kind, other.columns, other.stated)
            if each.kind == "joints" and each.columns and alike and len(suffixes) == 1:
                merged[at] = replace(other, rows=other.rows + each.rows, pattern=f"*{suffixes.pop()}")
                break
        else:
            merged.append(each)
    yield from merged
