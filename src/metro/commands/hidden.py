"""What ``metro simulate`` can hide: the effects of each kind of batch, with what says how large they are.

The simulator shares no code with this package, so its names stand here again; a test compares them.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from enum import StrEnum
from typing import Any

from metro.batch.findings import suggestion
from metro.commands.calls import CallError, wrong_call

# Kind → effect → its parameters: "[3]" a list of three numbers, "[]" one for each tooth, "?" not needed.
EFFECTS: dict[str, dict[str, str]] = {
    "force": {
        "tool_runout": "radius_um angle_deg",
        "tool_wear": "edge_growth_per_m",
        "chip_size_effect": "exponent",
        "tool_deflection": "kx_n_um ky_n_um",
        "orbit_stiffness": "amplitude phase_deg",
        "pitch_error": "pitch_deg[]",
        "dynamometer_rotation": "angle_deg",
        "dynamometer_resonance": "frequency_hz[3] damping[3]",
        "charge_drift": "slope_n_s[3]? time_constant_s[3]?",
        "chipped_tooth": "tooth length_um",
        "hard_spot": "ktc_step from_share",
        "speed_dependence": "exponent",
        "sensor_lag": "time_constant_ms",
        "second_orbit_stiffness": "amplitude phase_deg",
        "slow_growth": "growth_um",
        "tilted_surface": "rise_um_mm",
    },
    "joint_force": {
        "clock_offset": "offset_ms",
        "friction_reversal": "joint torque_nm",
        "friction_warmup": "joint slope_nm_s",
        "gear_ripple": "joint order torque_nm phase_deg?",
        "payload_error": "mass_kg com_mm[3]",
        "tool_offset_error": "dx_mm dy_mm dz_mm",
        "viscous_change": "joint change",
        "torque_constant": "joint error",
        "joint_delay": "joint delay_ms",
        "gain_drift": "share_per_s",
    },
    "deformation": {
        "tool_offset_error": "dx_mm dy_mm dz_mm",
        "joint_backlash": "joint angle_mdeg",
        "stiffness_scale": "factor joint?",
        "stiffness_hardening": "joint cubic",
        "link_flexibility": "link compliance_rad_nm",
        "tool_bending": "stiffness_n_um",
        "thermal_drift": "um_per_min[3]",
        "wall_tilt": "tilt_mrad",
    },
    "waviness": {
        "friction_reversal": "joint torque_nm",
        "gear_ripple": "joint order torque_nm phase_deg?",
        "joint_backlash": "joint angle_mdeg",
        "path_vibration": "frequency_hz amplitude_um phase_deg?",
        "fixed_length_waves": "length_mm amplitude_um phase_deg",
        "entry_ringing": "frequency_hz damping amplitude_um",
        "drifting_vibration": "frequency_hz amplitude_um phase_deg? growth_per_s",
    },
    "flatness": {
        "spindle_tilt": "about_x_mrad about_y_mrad",
        "thermal_growth": "um_per_min",
        "fixture_bow": "xx_um xy_um yy_um",
        "path_vibration": "frequency_hz amplitude_um",
        "entry_transient": "amplitude_um length_mm",
        "stiffness_scale": "factor",
        "tool_step": "from_share height_um",
        "hard_spot": "x_mm y_mm radius_mm height_um",
        "settling_growth": "growth_um time_constant_s",
        "scanner_distortion": "uuu_um uuv_um uvv_um vvv_um",
        "wear_within_face": "growth",
        "missed_depth": "at_share depth_um",
        "rail_sag": "sag_um",
        "walk_of_height": "step_um",
    },
    "lobes": {
        "missing_mode": "frequency_hz damping stiffness_n_um axis",
        "process_damping": "coefficient_n_mm",
        "mode_coupling": "angle_deg",
        "spindle_speed_softening": "change_per_krpm",
        "speed_dependence": "exponent reference_rpm",
        "speed_damping": "growth_per_krpm",
        "yielding_with_depth": "loss_per_mm",
        "wrong_labels": "share",
        "uneven_pitch": "pitch_deg[]",
        "tool_runout": "radius_um angle_deg",
    },
}
JOINTS, LINKS = ("1", "2", "3", "4", "5", "6"), ("1", "2", "3")
CHOICES = {"axis": ("x", "y"), "joint": JOINTS, "link": LINKS}
EVERY_JOINT = "stiffness_scale"  # the effect that all joints may share


class Style(StrEnum):
    """How a simulated batch is measured."""

    a = "a"
    b = "b"


def hidden(words: str, kind: str) -> list[str]:
    """Read an effect as a call gives it; return it as the simulator is given it.

    Parameters
    ----------
    words : ``NAME`` or ``NAME:PARAMETER=VALUE,…``.
    kind : of the batch, a key of :data:`EFFECTS`.

    Raises
    ------
    CallError
        There is no such effect of that kind, or no such parameter; one is missing, or is not a number.
    """
    name, _, settings = words.partition(":")
    if name not in EFFECTS[kind]:
        raise _no_effect(name, kind)
    # Only a comma before the next parameter parts: a list of numbers has commas, too.
    given = dict(_pair(name, one) for one in re.split(r",(?=\s*[a-z_]+=)", settings) if settings)
    known = dict(parameters(name, kind))
    for parameter in given:
        if parameter not in known:
            told = suggestion(parameter, known) or f", expected {', '.join(known)}"
            raise wrong_call(f"--effect {name}", f"{parameter}: is no parameter of it{told}")
    read = [f"{one}={_value(name, one, known[one], value)}" for one, value in given.items()]
    missing = [one for one, shape in known.items() if not shape.endswith("?") and one not in given]
    if given and missing:
        message = f"{', '.join(missing)}: missing. Give all parameters, or none: they are drawn then"
        raise wrong_call(f"--effect {name}", message)
    return [name, *read]


def parameters(name: str, kind: str) -> Iterator[tuple[str, str]]:
    """Yield the parameters of an effect, each with its shape: "", "[3]" or "[]", and "?" behind it."""
    for entry in EFFECTS[kind][name].split():
        parameter = re.match(r"\w+", entry)
        if parameter:
            yield parameter[0], entry[parameter.end() :]


def _no_effect(name: str, kind: str) -> CallError:
    others = [other for other, known in EFFECTS.items() if name in known]
    told = f"; it is one of --kind {others[0]}" if others else suggestion(name, EFFECTS[kind])
    expected = told or f", expected one of: {', '.join(EFFECTS[kind])}"
    return wrong_call("--effect", f"no effect {name!r} in a batch of --kind {kind}{expected}")


def _pair(name: str, setting: str) -> tuple[str, str]:
    parameter, equals, value = setting.partition("=")
    if not equals:
        raise wrong_call(f"--effect {name}", f'found "{setting}", expected PARAMETER=VALUE')
    return parameter.strip(), value.strip()


def _value(name: str, parameter: str, shape: str, text: str) -> str:
    """Return a value as JSON, as the simulator reads it."""
    choices = CHOICES.get(parameter, ())
    if name == EVERY_JOINT and choices:
        choices = (*choices, "all")
    if choices:
        expected, sound = f"one of: {', '.join(choices)}", text.strip('"') in choices
        value: Any = text.strip('"')
        value = int(value) if value.isdigit() else value
    else:
        value, count = _read(text), shape.strip("[]?")
        many = shape.startswith("[")
        expected = f"{count or 'some'} numbers, as [1.5,2,…]" if many else "a number, as 12.5"
        sound = _numbers(value, count) if many else _number(value)
    if not sound:
        raise wrong_call(f"--effect {name}", f'{parameter}: found "{text}", expected {expected}')
    return json.dumps(value)


def _read(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return None


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _numbers(value: Any, count: str) -> bool:
    right = isinstance(value, list) and len(value) > 0 and all(map(_number, value))
    return right and (not count or len(value) == int(count))
