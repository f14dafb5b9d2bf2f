"""What unknown files probably are, and how they are read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from metro.batch.capabilities import plural
from metro.formats.channels import parted
from metro.importing.look import Column, Seen

_AXIS = re.compile(
    r"(?P<head>.*?(?:f|force|kraft|load)[ _]?)(?P<axis>[xyz])(?P<tail>(?![a-z]).*)", re.IGNORECASE
)
_TIME = re.compile(r"t|time|timestamp|zeit|stamp", re.IGNORECASE)
_NUMBER = re.compile(r"(\d+)(?!.*\d)")
LEAST_RUN = 3  # rows that count


@dataclass(frozen=True)
class Proposal:
    """How a group of files is read.

    Attributes
    ----------
    kind : a key of KINDS, or ``modes``.
    pattern : of the names of the files, where they need a mapping.
    columns : column of the contract → the file's own name or number, or (other file, number).
    why : what each guess is from, by column.
    rows : what the table names: the file with its record, and what is taken for ``{record}``.
    timed : whether the files have a time of their own, or need none.
    placed : whether the files state where they were measured.
    """

    kind: str
    rows: tuple[tuple[str, str], ...]
    pattern: str = ""
    columns: dict[str, str | int | tuple[str, int]] = field(default_factory=dict)
    why: dict[str, str] = field(default_factory=dict)
    timed: bool = True
    stated: dict[str, str] = field(default_factory=dict)
    more: tuple[str, ...] = ()
    placed: bool = False


def propose(files: Sequence[Seen]) -> tuple[list[Proposal], list[str]]:
    """Propose how files are read; what nothing is proposed for is in the second list, with the reason."""
    from metro.importing import joints
    from metro.importing.poses import measured_poses
    from metro.importing.slopes import slope_readings

    proposals: list[Proposal] = []
    unknown = [f"{seen.path.name}: {seen.fault}" for seen in files if seen.fault]
    rest = [seen for seen in files if not seen.fault]
    # columns that are named as angles and torques, as feet and slopes, or as joints and where the arm was
    # seen, are no coordinates, whatever else could be read from them
    named = {
        seen.path
        for seen in rest
        if seen.kind == "cloud" and (joints.joint_log(seen) or slope_readings(seen) or measured_poses(seen))
    }
    rest = [replace(s, kind="") if s.path in named else s for s in rest]
    for kind in dict.fromkeys(seen.kind for seen in rest if seen.kind):
        for placed in (False, True):
            group = [seen for seen in rest if seen.kind == kind and seen.placed is placed]
            rows = tuple((seen.path.name, _record(seen)) for seen in group)
            proposals += [Proposal(kind, rows, placed=placed)] if rows else []
    rest = [seen for seen in rest if not seen.kind]
    pairs, single, rest = _hammer_pairs(rest)
    proposals += pairs
    unknown += single
    for seen in rest:
        readers = (_forces, joints.joint_log, slope_readings, measured_poses, _numbered)
        found = next((made for reader in readers if (made := reader(seen))), None)
        if found is None:
            unknown.append(_reason(seen))
        else:
            proposals.append(found)
    return list(joints.together(proposals)), unknown


def _record(seen: Seen) -> str:
    number = _NUMBER.search(seen.path.name.split(".")[0])
    return str(int(number[1])) if number else ""


def _forces(seen: Seen) -> Proposal | None:
    """Find three forces by their names, of one record or of several with a number at the end."""
    groups: dict[tuple[str, str], dict[str, Column]] = {}
    for column in seen.columns:
        match = _AXIS.fullmatch(column.name.strip())
        if match:
            groups.setdefault((match["head"], match["tail"]), {})[match["axis"].lower()] = column
    whole = {key: group for key, group in groups.items() if set(group) == set("xyz")}
    if not whole:
        return None
    (_, tail), first = next(iter(whole.items()))
    time = time_of(seen)
    why = {f"f{axis}_n": f"the name {first[axis].name}" for axis in "xyz"}
    stated = {f"f{axis}_n": first[axis].unit for axis in "xyz" if first[axis].unit}
    file = seen.path.name
    records: tuple[tuple[str, str], ...] = ((file, ""),)
    if len(whole) == 1:
        columns: dict[str, str | int | tuple[str, int]] = {f"f{axis}_n": first[axis].name for axis in "xyz"}
    else:
        number = _NUMBER.search(tail)
        if number is None:
            return None
        tails = [_NUMBER.search(other) for _, other in whole]
        columns = {
            f"f{axis}_n": first[axis].name[: -len(tail)]
            + tail[: number.start()]
            + "{record}"
            + tail[number.end() :]
            for axis in "xyz"
        }
        records = tuple((f"{file}#{each[1]}", each[1]) for each in tails if each)
    if time is not None:
        columns["t_s"] = time.name
        why["t_s"] = f"the name {time.name}"
        stated |= {"t_s": time.unit} if time.unit else {}
    return Proposal(
        "force", tuple(records), file, columns, why, time is not None or seen.step is not None, stated
    )


def _numbered(seen: Seen) -> Proposal | None:
    """Find a list of points: without names, the first column counts them, and more follow."""
    if len(seen.columns) < 4 or any(column.name for column in seen.columns):
        return None
    counts = seen.columns[0].values
    if counts.size < LEAST_RUN or not (np.diff(counts) == 1.0).all():
        return None
    columns: dict[str, str | int | tuple[str, int]] = {f"{axis}_mm": k for k, axis in enumerate("xyz", 2)}
    why = {
        name: f"column 1 counts the points, so that column {at} is the next" for name, at in columns.items()
    }
    return Proposal("cloud", ((seen.path.name, ""),), seen.path.name, columns, why)


def _hammer_pairs(files: Sequence[Seen]) -> tuple[list[Proposal], list[str], list[Seen]]:
    """Find files of a hammer and files of a sensor that share a number, each of time and value.

    Returns
    -------
    proposals, what has no partner (one line for all), and the files that are neither of a hammer nor of a
    sensor.
    """
    two = [seen for seen in files if len(seen.columns) == 2]
    hammers = [seen for seen in two if re.search(r"impact|hammer|force", seen.path.name, re.IGNORECASE)]
    sensors = [seen for seen in two if re.search(r"acc|resp|vel|disp", seen.path.name, re.IGNORECASE)]
    if not hammers or not sensors:
        return [], [], list(files)
    rest = [seen for seen in files if seen not in hammers and seen not in sensors]
    single = _without_partner(hammers, sensors)
    shared = _once(hammers) & _once(sensors)
    hammers = [seen for seen in hammers if _record(seen) in shared]
    sensors = [seen for seen in sensors if _record(seen) in shared]
    if not hammers:
        return [], single, rest
    first, other = _template(hammers[0]), _template(sensors[0])
    columns: dict[str, str | int | tuple[str, int]] = {"force_n": 2, "response": (other, 2)}
    why = {
        "force_n": f"the file's name {hammers[0].path.name}",
        "response": f"the file's name {sensors[0].path.name}",
    }
    timed = all(is_clock(seen.columns[0].values) for seen in hammers)
    if timed:
        columns |= {"t_s": 1}
        why |= {"t_s": "column 1, which rises by the same step from row to row"}
    rows = tuple((f"{seen.path.name}#{_record(seen)}", _record(seen)) for seen in hammers)
    names = tuple(seen.path.name for seen in sensors)
    found = Proposal("record", rows, first.replace("{record}", "*"), columns, why, timed, more=names)
    return [found], single, rest


def _once(files: Sequence[Seen]) -> set[str]:
    """Return the numbers that one of the files has in its name, and no other."""
    numbers = [_record(seen) for seen in files]
    return {number for number in numbers if numbers.count(number) == 1}


def _without_partner(hammers: Sequence[Seen], sensors: Sequence[Seen]) -> list[str]:
    """Say how many files of either kind there are, which cannot be paired, and what to do; [] if all can."""
    shared = _once(hammers) & _once(sensors)
    single = [seen.path.name for seen in (*hammers, *sensors) if _record(seen) not in shared]
    if not single:
        return []
    counts = " and ".join(
        f"{plural(len(files), 'file')} of {whose} ({', '.join(seen.path.name for seen in files)})"
        for files, whose in ((hammers, "a hammer"), (sensors, "a sensor"))
    )
    return [
        f"{', '.join(single)}: found {counts}; a record of the hammer and that of the sensor belong together "
        "by the last number in their names, one of each with the same number. Rename the files so that their "
        "numbers agree, or give the command those alone that belong together"
    ]


def time_of(seen: Seen) -> Column | None:
    """Return the column that is named as times are; None where a file has none."""
    return next((each for each in seen.columns if _TIME.fullmatch(parted(each.name)[0])), None)


def is_clock(values: np.ndarray, *, uneven: bool = False) -> bool:
    """Return whether values rise by one step from row to row, as times do; a step of 1 counts the rows.

    ``uneven``: the steps may differ, as long as the values rise.
    """
    if values.size < LEAST_RUN:
        return False
    steps = np.diff(values)
    step = float(np.median(steps))
    if uneven:
        return step > 0.0 and bool((steps > 0.0).all()) and not bool((steps == 1.0).all())
    return step > 0.0 and step != 1.0 and bool((np.abs(steps - step) < 0.01 * step).all())


def _template(seen: Seen) -> str:
    return _NUMBER.sub("{record}", seen.path.name, count=1)


def _reason(seen: Seen) -> str:
    named = sum(bool(column.name) for column in seen.columns)
    listed = ", ".join(column.name for column in seen.columns[:8] if column.name)
    names = f", named {listed}" if named else " without names"
    none = "no dynamometer, hammer, profile, slopes, poses or scan"
    message = f"{seen.path.name}: {len(seen.columns)} columns{names}: {none}"
    logs = (
        "a joint log takes angles and torques or currents with numbered names; a robot log of a cut takes "
        "t_s, q1_deg …, tau1_nm … (or current1_a …), q1_set_deg …"
    )
    return f"{message}; {logs}: write its mapping by hand, as docs/data-contract.md says"
