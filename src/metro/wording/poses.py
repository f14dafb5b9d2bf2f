"""An arm by measured poses: what was found, the residual and its kind, what to measure next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from metro.units import JSON
from metro.wording.candidates import Sentence
from metro.wording.names import SURE, chance, listed, pair, plain

BY = {"random": "at random", "region": "by region", "time": "by time"}
LEAST_PART = 0.05  # of the residual, that is reported
KINDS = {
    "pose": "a cause that changes with the pose and not with one joint alone, such as a link, a bearing or "
    "a load that yields",
    "time": "a drift of the arm, its base or the instrument",
    "temperature": "a growth that the temperature as recorded does not follow",
}
OTHER_LOAD = "the poses again with another load on the flange (payload_kg)"
PARTS = {
    "pose": "is alike at poses that are close in all joints",
    "time": "changes with time",
    "temperature": "changes with the temperature",
}


def _verdict(values: JSON) -> str:
    several = len(values["series"]) > 1
    return " ".join(
        _of_series(one, f"Series {run}: " if several else "") for run, one in values["series"].items()
    )


def _of_series(one: JSON, start: str) -> str:
    medians = one["medians"]
    region = medians["region"]
    others = listed_medians({kind: medians[kind]["effects"] for kind in medians if kind != "region"})
    fall = (
        f"{start}of poses left out by region the median error is {region['nominal']:.2g} mm with the "
        f"declared geometry, {region['geometry']:.2g} mm corrected and {region['effects']:.2g} mm with "
        f"effects ({others})."
    )
    fall = fall[0].upper() + fall[1:] if not start else fall
    torn = {first for first, _ in one["rivals"]}
    sure = [effect for effect in one["effects"] if effect["probability"] >= SURE]
    leads = [effect for effect in one["effects"] if effect["probability"] < SURE]
    parts = [fall]
    if sure:
        parts.append(f"Found: {listed(grouped(sure))}.")
    if torn:
        pairs = [f"{plain(first)} from {plain(second)}" for first, second in one["rivals"]]
        parts.append(f"These poses cannot distinguish {listed(pairs)}.")
    elif leads:
        parts.append(f"Possible cause: {listed(grouped(leads))}.")
    if not one["effects"]:
        parts.append("Nothing beyond the declared geometry was found.")
    return " ".join(parts)


def listed_medians(medians: Mapping[str, float]) -> str:
    """Write medians of other ways of leaving out: by time 0.078 mm, at random 0.066 mm."""
    return ", ".join(f"{BY[kind]} {value:.2g} mm" for kind, value in medians.items())


def grouped(effects: Sequence[JSON]) -> list[str]:
    """Write an effect of several joints once: gear eccentricity (joints 1, 2 and 4)."""
    joints: dict[str, list[str]] = {}
    for effect in effects:
        joints.setdefault(plain(effect["effect"]), []).extend(
            [str(effect["joint"])] if effect["joint"] else []
        )
    return [
        f"{name} (joint{'s' if len(own) > 1 else ''} {_counted(own)})" if own else name
        for name, own in joints.items()
    ]


def _counted(joints: Sequence[str]) -> str:
    """Write joints in a row: 1 to 5, where none between is lacking."""
    numbers = sorted(map(int, joints))
    whole = len(numbers) > 2 and numbers[-1] - numbers[0] == len(numbers) - 1
    return f"{numbers[0]} to {numbers[-1]}" if whole else listed(list(map(str, numbers)))


def _left(values: JSON) -> str:
    parts = []
    for run, one in values["series"].items():
        noise = one["noise"]
        beside = f", beside {noise['value']:.2g} mm that {SOURCES[noise['source']]}" if noise else ""
        named = f" in series {run}" if values["several"] else ""
        what = "distance" if one["measured"] == "distances" else "coordinate"
        parts.append(f"{one['scatter']:.2g} mm in a {what}{named}{beside}")
    return "; ".join(parts)


SOURCES = {"repeats": "repeats of a pose differ by", "instrument": "the instrument is stated to have"}


def _ceiling(values: JSON) -> str:
    several = values["several"]
    return " ".join(
        _of_ceiling(one, f"in series {run}, " if several else "") for run, one in values["series"].items()
    )


def _of_ceiling(one: JSON, where: str) -> str:
    """Say how much any cause could explain, and of which kind it is."""
    largest = {name: share for name, share in one["parts"].items() if share >= LEAST_PART and name != "alone"}
    low, high = (100 * max(end, 0.0) for end in one["ci95"])
    noise = one["noise_share"]
    instrument = (
        "" if noise is None else f" The stated noise of the instrument makes {100 * noise:.0f} % of it."
    )
    if not largest or one["ci95"][0] <= 0.0:
        return (
            f"The residual {where}repeats with no joint, pose, time or temperature as far as these poses "
            f"show, so that no cause of these kinds can explain it.{instrument}"
        )
    joints = {name.split()[1]: share for name, share in largest.items() if name.startswith("joint")}
    parts = [f"{100 * share:.0f} % {PARTS[name]}" for name, share in largest.items() if name in PARTS]
    parts = [_of_joints(joints), *parts] if joints else parts
    alone = f"{100 * one['parts']['alone']:.0f} % does not repeat"
    return (
        f"Of the residual {where}{listed([*parts, alone])}. Whatever the cause, other poses predict "
        f"{100 * max(one['share'], 0.0):.0f} % ({low:.0f} to {high:.0f} %) of it at one that is left out."
        f"{instrument} This points to {_kind(next(iter(largest)))}."
    )


def _of_joints(shares: Mapping[str, float]) -> str:
    """Say which part depends on one joint's angle alone: 35 % depends on the angle of joint 3 (19 %), …."""
    if len(shares) == 1:
        ((joint, share),) = shares.items()
        return f"{100 * share:.0f} % depends on the angle of joint {joint} alone"
    each = listed([f"{joint} ({100 * share:.0f} %)" for joint, share in shares.items()])
    return f"{100 * sum(shares.values()):.0f} % depends on the angle of one joint alone, of joints {each}"


def _kind(name: str) -> str:
    return KINDS.get(name, f"the gear or the encoder of {name}, finer than its curve")


def _next(values: JSON) -> str:
    rivals = dict.fromkeys(tuple(each) for each in values["rivals"])
    parts = [f"to distinguish {pair(each)}: {_telling(each)}" for each in rivals]
    for run, kind in values["rest"].items():
        if kind.startswith("joint"):
            parts.append(
                f"for the residual of {run}: {kind} alone in steps of 0.2°, both ways, all others at rest"
            )
        elif kind in ("time", "temperature"):
            parts.append(f"for the residual of {run}: one pose again and again while the arm warms up")
        elif kind == "pose":
            parts.append(f"for the residual of {run}: {OTHER_LOAD}")
    if values["without_noise"]:
        parts.append("a few poses five times each or sigma_mm, to know how much of the residual is noise")
    return "; ".join(parts) or "the poses of table pose_next, which lower the errors of the geometry most"


def _telling(rivals: Sequence[str]) -> str:
    if "base_tilt" in rivals:
        return (
            f"{OTHER_LOAD}; or a point on the base beside the one on the flange, the arm stretched out to "
            "several sides"
        )
    return OTHER_LOAD


def _no_gain(values: JSON) -> str:
    return (
        f"left-out regions gain {100 * values['gain']:.2g} % of the squared residual "
        f"(by luck: {chance(values['p_value'])})"
    )


SENTENCES: Mapping[str, Sentence] = {
    "pose_verdict": _verdict,
    "pose_left": _left,
    "pose_ceiling": _ceiling,
    "pose_next": _next,
    "pose_no_gain": _no_gain,
}
