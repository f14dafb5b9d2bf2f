"""How names, pairs, runs and probabilities are written."""

from __future__ import annotations

import re
from collections.abc import Sequence

from metro.units import JSON

SURE = 0.95  # probability from which on a cause counts as identified
# Base parameters of which something is believed beforehand, by the pattern of their names.
BELIEFS = {
    r"softer_joint_(\d)": "compliance of joint {} in the cut, against the load tests",
    r"lost_motion_joint_(\d)": "lost motion of joint {} in the load tests, of its twist there",
    r"straight_joint_(\d)": "share of the compliance of joint {} that does not harden",
    r"wall_zero": "zero of all walls",
    r"gear_wave_(\d+)": "wave {} of the errors of the gears along the walls, over what is usual",
    r"force_off": "force",
    r"force_off_(\w+)_([xyz])": "force by the {}, along {} and relative to its size",
    r"place_height": "height of the scanner",
    r"place_tilt_([xy])": "tilt of the scanner along {}, at the edges of the work",
    r"form_(xx|xy|yy)": "curvature {} of the scanner's field, at the edges of the work",
    r"ringing_off_(.+)": "frequencies of the tip at pose {}",
    r"loss_off_(.+)": "damping ratio of the tip at pose {}, over the known one",
    r"at_once_([xyz])_(.+)": "share of the compliance that follows a force along {} at once, at pose {}",
    r"swing_(\d+)_([xyz])_(.+)": "mode {} beside those of the tip, by the force along {}, at pose {}",
    r"drive_lag": "lag of all torques behind the force",
    r"drive_smoothing": "spread in time of all torques against the force",
    r"torque_gain": "gain of all torques",
    r"friction_of_joint_(\d)": "friction of joint {} against the idle run",
    r"viscous_friction_of_joint_(\d)": "viscous friction of joint {} against the idle run",
    r"torque_constant_of_joint_(\d)": "torque constant of joint {} against the idle run",
    r"gain_of_joint_(\d)": "gain of the torque of joint {}",
    r"gain_of_(.)": "gain of the dynamometer along {}",
    r"transfer": "the wall's waves less the tip's, as a share",
    r"crosstalk_of_(.)_in_(.)": "crosstalk of the dynamometer from {} to {}",
}


def plain(name: str) -> str:
    """Write the name of an effect or observable as words."""
    return name.replace("_", " ")


def belief(name: str) -> str:
    """Write the name of a base parameter that says by how much an instrument, or what is declared, is off."""
    for pattern, words in BELIEFS.items():
        if found := re.fullmatch(pattern, name):
            return words.format(*found.groups())
    return plain(name)


def listed(names: Sequence[str]) -> str:
    """Name effects in a row."""
    *first, last = map(plain, names)
    return f"{', '.join(first)} and {last}" if first else last


def pair(names: Sequence[str]) -> str:
    """Name an effect and its rival."""
    effect, rival = names
    return f"{plain(effect)} from {plain(rival)}"


def chance(probability: float) -> str:
    """Write a probability so that none is one."""
    return "more than 0.99" if probability > 0.99 else f"{probability:.2f}"


def cut(run: JSON) -> str:
    """Name runs of one kind, and how often they are made."""
    return str(run["proposal"]) + (f", {run['repeats']} times" if run["repeats"] > 1 else "")
