"""Effects that a batch of a cutting arm may hide: how large they come, what each changes, where seen."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from virtual_cell.arm_cell import ArmCell
from virtual_cell.hidden import JOINT, Hidden, Parameters, drawn_angle, drawn_signed, drawn_size
from virtual_cell.units import DEG, MM, MS, N_UM, UM

_MDEG = 1e-3 * DEG
_LOAD = 600.0  # N, a load on the tip by which hardening is drawn
_MOVING = 0.4  # of the largest travel: joints that move enough to show what goes with their angle


def _joint(rng: np.random.Generator, among: Sequence[int] = range(6)) -> int:
    """Draw a joint, 1 … 6, among indices 0 … 5."""
    return among[int(rng.integers(len(among)))] + 1


def _likely(rng: np.random.Generator, among: tuple[int, ...]) -> int:
    """Draw a joint, mostly one of some, where there are any."""
    return _joint(rng, among if among and rng.uniform() < 0.7 else tuple(range(6)))


def _moving(cell: ArmCell) -> list[int]:
    travel = cell.moves.travel
    return [joint for joint in range(6) if travel[joint] > _MOVING * max(travel)]


def _on(values: Sequence[float], joint: int, value: float) -> tuple[float, ...]:
    """Put a value at a joint (1 … 6)."""
    return tuple(value if i == joint - 1 else old for i, old in enumerate(values))


def _digits(value: float) -> float:
    return float(f"{value:.3g}")


def _friction(
    low: float, high: float, name: str, per: Callable[[ArmCell], float]
) -> Callable[[np.random.Generator, ArmCell], Parameters]:
    """Draw a change of a joint's Coulomb level, in parts of that level, over ``per(cell)``."""

    def draw(rng: np.random.Generator, cell: ArmCell) -> Parameters:
        joint = _likely(rng, cell.moves.turning)
        level = float(cell.drives.coulomb[joint - 1]) / per(cell)
        return {"joint": joint, name: drawn_signed(rng, low * level, high * level)}

    return draw


def _ripple(rng: np.random.Generator, cell: ArmCell) -> Parameters:
    joint = _joint(rng, _moving(cell))
    wave = drawn_size(rng, 3.0, 12.0) * MM * cell.moves.travel[joint - 1]
    level = float(cell.drives.coulomb[joint - 1])
    return {
        "joint": joint,
        "order": float(round(2.0 * math.pi / wave)),
        "torque_nm": drawn_size(rng, 0.01 * level, 0.25 * level),
        "phase_deg": drawn_angle(rng),
    }


def _rippled(cell: ArmCell, p: Parameters) -> ArmCell:
    return replace(
        cell,
        ripple=_on(cell.ripple, p["joint"], p["torque_nm"]),
        ripple_order=_on(cell.ripple_order, p["joint"], p["order"]),
        ripple_phase=_on(cell.ripple_phase, p["joint"], p.get("phase_deg", 0.0) * DEG),
    )


def _payload(rng: np.random.Generator, _: ArmCell) -> Parameters:
    at = [float(round(v)) for v in rng.uniform([-150.0, -150.0, 0.0], [150.0, 150.0, 300.0])]
    return {"mass_kg": drawn_size(rng, 0.2, 15.0), "com_mm": at}


def _offset(rng: np.random.Generator, _: ArmCell) -> Parameters:
    towards = rng.standard_normal(3)
    d = towards / np.linalg.norm(towards) * drawn_size(rng, 5.0, 150.0)
    return {name: float(round(v, 2)) for name, v in zip(("dx_mm", "dy_mm", "dz_mm"), d, strict=True)}


def _scale(rng: np.random.Generator, _: ArmCell) -> Parameters:
    every = rng.uniform() < 0.6
    joint, size = ("all", (0.01, 0.4)) if every else (_joint(rng), (0.03, 0.7))
    return {"factor": float(round(math.exp(drawn_signed(rng, *size)), 3)), "joint": joint}


def _scaled(cell: ArmCell, p: Parameters) -> ArmCell:
    every = p.get("joint", "all") == "all"
    return replace(cell, factor=(p["factor"],) * 6 if every else _on(cell.factor, p["joint"], p["factor"]))


def _hardening(rng: np.random.Generator, cell: ArmCell) -> Parameters:
    """Draw by how much (relative) a joint is stiffer under a load on the tip than under none."""
    joint = _joint(rng)
    k, torque = float(cell.arm.stiffness[joint - 1]), _LOAD * cell.moves.lever[joint - 1]
    return {"joint": joint, "cubic": _digits(drawn_size(rng, 0.2, 6.0) * k**3 / torque**2)}


def _vibration(rng: np.random.Generator, cell: ArmCell) -> Parameters:
    """Draw a vibration whose waves on the wall are 0.9 to 7 mm long at every feed."""
    slow, fast = cell.moves.speed
    ends = sorted((fast / (7.0 * MM), slow / (0.9 * MM)))
    return {
        "frequency_hz": drawn_size(rng, *ends),
        "amplitude_um": drawn_size(rng, 0.1, 8.0),
        "phase_deg": drawn_angle(rng),
    }


def _vibrating(cell: ArmCell, p: Parameters) -> ArmCell:
    shaken = (p["frequency_hz"], p["amplitude_um"] * UM, p.get("phase_deg", 0.0) * DEG)
    return replace(cell, vibration=shaken, chirp=p.get("growth_per_s", 0.0))


def _drift(rng: np.random.Generator, _: ArmCell) -> Parameters:
    towards = rng.standard_normal(3)
    d = towards / np.linalg.norm(towards) * drawn_size(rng, 0.3, 12.0)
    return {"um_per_min": [float(round(v, 3)) for v in d]}


INSIDE: Mapping[str, Hidden[ArmCell]] = {
    "clock_offset": Hidden(
        "offset_ms",
        lambda r, _: {"offset_ms": drawn_signed(r, 5.0, 250.0)},
        lambda c, p: replace(c, clock_offset=p["offset_ms"] * MS),
    ),
    "friction_reversal": Hidden(
        f"{JOINT} torque_nm",
        _friction(0.015, 0.4, "torque_nm", lambda _: 1.0),
        lambda c, p: replace(c, reversal=_on(c.reversal, p["joint"], p["torque_nm"])),
    ),
    "friction_warmup": Hidden(
        f"{JOINT} slope_nm_s",
        _friction(0.02, 0.5, "slope_nm_s", lambda c: c.moves.seconds),
        lambda c, p: replace(c, warmup=_on(c.warmup, p["joint"], p["slope_nm_s"])),
    ),
    "gear_ripple": Hidden(f"{JOINT} order torque_nm phase_deg?", _ripple, _rippled),
    "payload_error": Hidden(
        "mass_kg com_mm[3]",
        _payload,
        lambda c, p: replace(c, payload=p["mass_kg"], payload_at=tuple(v * MM for v in p["com_mm"])),
    ),
    "tool_offset_error": Hidden(
        "dx_mm dy_mm dz_mm",
        _offset,
        lambda c, p: replace(c, tip_offset=tuple(p[f"d{axis}_mm"] * MM for axis in "xyz")),
    ),
    "joint_backlash": Hidden(
        f"{JOINT} angle_mdeg",
        lambda r, c: {"joint": _likely(r, c.moves.swaying), "angle_mdeg": drawn_size(r, 0.5, 30.0)},
        lambda c, p: replace(c, gap=_on(c.gap, p["joint"], p["angle_mdeg"] * _MDEG)),
    ),
    "stiffness_scale": Hidden(f"factor {JOINT}|all?", _scale, _scaled),
    "stiffness_hardening": Hidden(
        f"{JOINT} cubic", _hardening, lambda c, p: replace(c, cubic=_on(c.cubic, p["joint"], p["cubic"]))
    ),
    "path_vibration": Hidden("frequency_hz amplitude_um phase_deg?", _vibration, _vibrating),
}
OUTSIDE: Mapping[str, Hidden[ArmCell]] = {
    "viscous_change": Hidden(
        f"{JOINT} change",
        lambda r, _: {"joint": _joint(r), "change": drawn_size(r, 0.3, 6.0)},
        lambda c, p: replace(c, viscous_change=_on(c.viscous_change, p["joint"], p["change"])),
    ),
    "torque_constant": Hidden(
        f"{JOINT} error",
        lambda r, _: {"joint": _joint(r), "error": drawn_signed(r, 0.01, 0.3)},
        lambda c, p: replace(c, torque_gain=_on(c.torque_gain, p["joint"], p["error"])),
    ),
    "joint_delay": Hidden(
        f"{JOINT} delay_ms",
        lambda r, _: {"joint": _joint(r), "delay_ms": drawn_size(r, 30.0, 500.0)},
        lambda c, p: replace(c, delay=_on(c.delay, p["joint"], p["delay_ms"] * MS)),
    ),
    "gain_drift": Hidden(
        "share_per_s",
        lambda r, c: {"share_per_s": _digits(drawn_signed(r, 0.02, 0.5) / c.moves.seconds)},
        lambda c, p: replace(c, gain_drift=p["share_per_s"]),
    ),
    "link_flexibility": Hidden(
        "link=1|2|3 compliance_rad_nm",
        lambda r, _: {"link": int(r.integers(1, 4)), "compliance_rad_nm": drawn_size(r, 1e-8, 2e-6)},
        lambda c, p: replace(c, link=p["link"], link_compliance=p["compliance_rad_nm"]),
    ),
    "tool_bending": Hidden(
        "stiffness_n_um",
        lambda r, _: {"stiffness_n_um": drawn_size(r, 2.0, 80.0)},
        lambda c, p: replace(c, tool_compliance=1.0 / (p["stiffness_n_um"] * N_UM)),
    ),
    "thermal_drift": Hidden(
        "um_per_min[3]", _drift, lambda c, p: replace(c, drift=tuple(v * UM / 60.0 for v in p["um_per_min"]))
    ),
    "wall_tilt": Hidden(
        "tilt_mrad",
        lambda r, _: {"tilt_mrad": drawn_signed(r, 0.05, 3.0)},
        lambda c, p: replace(c, tilt=p["tilt_mrad"] * 1e-3),
    ),
    "fixed_length_waves": Hidden(
        "length_mm amplitude_um phase_deg",
        lambda r, _: {
            "length_mm": drawn_size(r, 1.2, 6.0),
            "amplitude_um": drawn_size(r, 0.1, 8.0),
            "phase_deg": drawn_angle(r),
        },
        lambda c, p: replace(c, wave=(p["length_mm"] * MM, p["amplitude_um"] * UM, p["phase_deg"] * DEG)),
    ),
    "entry_ringing": Hidden(
        "frequency_hz damping amplitude_um",
        lambda r, c: {
            "frequency_hz": _digits(c.moves.speed[0] / (drawn_size(r, 1.5, 4.0) * MM)),
            "damping": drawn_size(r, 0.01, 0.05),
            "amplitude_um": drawn_size(r, 0.5, 40.0),
        },
        lambda c, p: replace(c, ringing=(p["frequency_hz"], p["damping"], p["amplitude_um"] * UM)),
    ),
    "drifting_vibration": Hidden(
        "frequency_hz amplitude_um phase_deg? growth_per_s",
        lambda r, c: {**_vibration(r, c), "growth_per_s": _digits(drawn_size(r, 0.3, 1.0) / c.moves.seconds)},
        _vibrating,
    ),
}
ARM_EFFECTS: Mapping[str, Hidden[ArmCell]] = {**INSIDE, **OUTSIDE}
# where each is seen
SHOWN: Mapping[str, tuple[str, ...]] = {
    "joint_force": (
        *("clock_offset", "friction_reversal", "friction_warmup", "gear_ripple", "payload_error"),
        *("tool_offset_error", "viscous_change", "torque_constant", "joint_delay", "gain_drift"),
    ),
    "deformation": (
        *("tool_offset_error", "joint_backlash", "stiffness_scale", "stiffness_hardening"),
        *("link_flexibility", "tool_bending", "thermal_drift", "wall_tilt"),
    ),
    "waviness": (
        *("friction_reversal", "gear_ripple", "joint_backlash", "path_vibration"),
        *("fixed_length_waves", "entry_ringing", "drifting_vibration"),
    ),
}
