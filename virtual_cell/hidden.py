"""Effects that a batch may hide: how large they come, and what each changes.

``EFFECTS`` change the session of a force batch, ``BOUNDARY_EFFECTS`` the machine of tests on either side of
the stability boundary.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from virtual_cell.flexible import Machine
from virtual_cell.modes import Modes
from virtual_cell.session import Session
from virtual_cell.units import DEG, MM, MS, N_MM, N_UM, UM

Parameters = dict[str, Any]
JOINT = "joint=1|2|3|4|5|6"
Subject = TypeVar("Subject")


@dataclass(frozen=True)
class Hidden(Generic[Subject]):
    """How to draw an effect's parameters, in the contract's units, and how to apply them to its subject.

    ``parameters`` names them, parted by blanks. Behind a name: ``[3]`` a list of three numbers, ``[]`` one
    for each tooth, ``=x|y`` one of these words; ``?`` at its end: it may be left out.
    """

    parameters: str
    draw: Callable[[np.random.Generator, Subject], Parameters]
    apply: Callable[[Subject, Parameters], Subject]


def drawn_size(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform, three digits."""
    return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.3g}")


def drawn_angle(rng: np.random.Generator) -> float:
    """Uniform over a turn, degrees."""
    return float(round(rng.uniform(0.0, 360.0), 1))


def drawn_signed(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform, three digits, of either sign."""
    return drawn_size(rng, low, high) * float(rng.choice([-1.0, 1.0]))


def _pitch(rng: np.random.Generator, session: Session) -> Parameters:
    raw = rng.standard_normal(session.tool.teeth)
    raw -= raw.mean()
    return {"pitch_deg": [round(float(e), 3) for e in raw / np.abs(raw).max() * drawn_size(rng, 0.3, 2.0)]}


def _runout(session: Session, p: Parameters) -> Session:
    tool = replace(session.tool, runout=p["radius_um"] * UM, runout_angle=p["angle_deg"] * DEG)
    return replace(session, tool=tool)


def _chipped(session: Session, p: Parameters) -> Session:
    tool = replace(session.tool, chipped_tooth=p["tooth"], chipped_by=p["length_um"] * UM)
    return replace(session, tool=replace(tool, chipped_height=session.depth / 2.0))


def _size_effect(session: Session, p: Parameters) -> Session:
    k = replace(session.coefficients, size_exponent=p["exponent"], size_reference=session.mean_chip)
    return replace(session, coefficients=k)


def _angles(session: Session, p: Parameters) -> Session:
    angles = session.tool.angles + np.array(p["pitch_deg"]) * DEG
    return replace(session, tool=replace(session.tool, angles=angles))


def _sensor(session: Session, **changes: Any) -> Session:
    return replace(session, dynamometer=replace(session.dynamometer, **changes))


def _resonance(rng: np.random.Generator, _: Session) -> Parameters:
    return {
        "frequency_hz": [drawn_size(rng, 600.0, 1600.0) for _ in range(3)],
        "damping": [drawn_size(rng, 0.02, 0.08) for _ in range(3)],
    }


def _drift(rng: np.random.Generator, _: Session) -> Parameters:
    return {"slope_n_s": [drawn_signed(rng, 1.0, 12.0) for _ in range(3)]}


def _warm(session: Session, p: Parameters) -> Session:
    return replace(session, growth=p["growth_um"] * UM)


def _lagging(session: Session, p: Parameters) -> Session:
    lag = [0.0, 0.0, 0.0]
    lag[p["axis"]] = p["time_constant_ms"] * MS
    return _sensor(session, lag=(lag[0], lag[1], lag[2]))


def _speed(session: Session, p: Parameters) -> Session:
    return replace(session, speed_exponent=p["exponent"])


EFFECTS: Mapping[str, Hidden[Session]] = {
    "tool_runout": Hidden(
        "radius_um angle_deg",
        lambda r, _: {"radius_um": drawn_size(r, 2.0, 25.0), "angle_deg": drawn_angle(r)},
        _runout,
    ),
    "tool_wear": Hidden(
        "edge_growth_per_m",
        lambda r, _: {"edge_growth_per_m": drawn_size(r, 0.02, 0.4)},
        lambda s, p: replace(s, coefficients=replace(s.coefficients, wear=p["edge_growth_per_m"])),
    ),
    "chip_size_effect": Hidden(
        "exponent", lambda r, _: {"exponent": drawn_size(r, 0.06, 0.35)}, _size_effect
    ),
    "entry_exit_force": Hidden(
        "tangential radial",
        lambda r, _: {"tangential": drawn_size(r, 0.05, 0.5), "radial": drawn_size(r, 0.05, 0.5)},
        lambda s, p: replace(s, coefficients=replace(s.coefficients, jammed=(p["tangential"], p["radial"]))),
    ),
    "tool_deflection": Hidden(
        "kx_n_um ky_n_um",
        lambda r, _: {"kx_n_um": drawn_size(r, 1.5, 12.0), "ky_n_um": drawn_size(r, 1.5, 12.0)},
        lambda s, p: replace(s, stiffness=(p["kx_n_um"] * N_UM, p["ky_n_um"] * N_UM)),
    ),
    "orbit_stiffness": Hidden(
        "amplitude phase_deg",
        lambda r, _: {"amplitude": drawn_size(r, 0.03, 0.25), "phase_deg": drawn_angle(r)},
        lambda s, p: replace(s, orbit_stiffness=(p["amplitude"], p["phase_deg"] * DEG)),
    ),
    "pitch_error": Hidden("pitch_deg[]", _pitch, _angles),
    "dynamometer_rotation": Hidden(
        "angle_deg",
        lambda r, _: {"angle_deg": drawn_signed(r, 0.7, 8.0)},
        lambda s, p: _sensor(s, rotation=s.dynamometer.rotation + p["angle_deg"] * DEG),
    ),
    "dynamometer_resonance": Hidden(
        "frequency_hz[3] damping[3]",
        _resonance,
        lambda s, p: _sensor(s, resonance=tuple(zip(p["frequency_hz"], p["damping"], strict=True))),
    ),
    "charge_drift": Hidden(
        "slope_n_s[3]? time_constant_s[3]?",
        _drift,
        lambda s, p: _sensor(
            s,
            slope=tuple(p["slope_n_s"]) if "slope_n_s" in p else (0.0, 0.0, 0.0),
            time_constant=tuple(p["time_constant_s"]) if "time_constant_s" in p else None,
        ),
    ),
    "amplifier_filter": Hidden(
        "corner_hz order",
        lambda r, _: {"corner_hz": drawn_size(r, 320.0, 5000.0), "order": 1},
        lambda s, p: _sensor(s, lag=(1.0 / (2.0 * np.pi * p["corner_hz"]),) * 3),
    ),
    # outside of any library
    "chipped_tooth": Hidden(
        "tooth length_um",
        lambda r, s: {"tooth": int(r.integers(s.tool.teeth)), "length_um": drawn_size(r, 8.0, 60.0)},
        _chipped,
    ),
    "hard_spot": Hidden(
        "ktc_step from_share",
        lambda r, _: {
            "ktc_step": drawn_signed(r, 0.04, 0.15),
            "from_share": round(float(r.uniform(0.3, 0.7)), 2),
        },
        lambda s, p: replace(s, hard_spot=p["ktc_step"], hard_from=p["from_share"]),
    ),
    "speed_dependence": Hidden("exponent", lambda r, _: {"exponent": drawn_size(r, 0.05, 0.3)}, _speed),
    "lagging_channel": Hidden(
        "axis time_constant_ms",
        lambda r, _: {"axis": int(r.integers(3)), "time_constant_ms": drawn_size(r, 0.03, 0.5)},
        _lagging,
    ),
    "second_orbit_stiffness": Hidden(
        "amplitude phase_deg",
        lambda r, _: {"amplitude": drawn_size(r, 0.03, 0.25), "phase_deg": drawn_angle(r)},
        lambda s, p: replace(s, orbit_stiffness=(p["amplitude"], p["phase_deg"] * DEG), orbit_harmonic=2),
    ),
    "slow_growth": Hidden("growth_um", lambda r, _: {"growth_um": drawn_size(r, 10.0, 120.0)}, _warm),
    "tilted_surface": Hidden(
        "rise_um_mm",
        lambda r, _: {"rise_um_mm": drawn_signed(r, 1.0, 12.0)},
        lambda s, p: replace(s, tilt=p["rise_um_mm"] * UM / MM),
    ),
}


def _missing(rng: np.random.Generator, machine: Machine) -> Parameters:
    hz = [float(f) for modes in machine.modes for f in modes.damped]
    softest = min(float(modes.stiffness.min()) for modes in machine.modes) / N_UM
    return {
        "frequency_hz": drawn_size(rng, 0.5 * min(hz), 1.2 * max(hz)),
        "damping": drawn_size(rng, 0.012, 0.06),
        "stiffness_n_um": drawn_size(rng, 0.5 * softest, 12.0 * softest),
        "axis": str(rng.choice(["x", "y"])),
    }


def _with_mode(machine: Machine, p: Parameters) -> Machine:
    """Add a mode; its frequency is undamped, as in the contract."""
    damped = p["frequency_hz"] * float(np.sqrt(1.0 - p["damping"] ** 2))
    added = (damped, p["damping"], p["stiffness_n_um"] * N_UM)
    x, y = machine.modes
    known = x if p["axis"] == "x" else y
    parts = (known.damped, known.damping, known.stiffness)
    more = Modes(*(np.append(part, value) for part, value in zip(parts, added, strict=True)))
    return replace(machine, modes=(more, y) if p["axis"] == "x" else (x, more))


def _uneven(machine: Machine, p: Parameters) -> Machine:
    return replace(machine, uneven=tuple(angle * DEG for angle in p["pitch_deg"]))


def _spacing(rng: np.random.Generator, machine: Machine) -> Parameters:
    """Every other tooth out of its place, by whole steps of the march."""
    by = 2.0 * round(drawn_size(rng, 3.0, 24.0) / 2.0)
    return {"pitch_deg": [by * (tooth % 2) for tooth in range(machine.teeth)]}


BOUNDARY_EFFECTS: Mapping[str, Hidden[Machine]] = {
    "missing_mode": Hidden("frequency_hz damping stiffness_n_um axis=x|y", _missing, _with_mode),
    "process_damping": Hidden(
        "coefficient_n_mm",
        lambda r, _: {"coefficient_n_mm": drawn_size(r, 15.0, 900.0)},
        lambda m, p: replace(m, ploughing=p["coefficient_n_mm"] * (N_MM / (0.5 * m.diameter))),
    ),
    "mode_coupling": Hidden(
        "angle_deg",
        lambda r, _: {"angle_deg": drawn_signed(r, 4.0, 60.0)},
        lambda m, p: replace(m, turned=p["angle_deg"] * DEG),
    ),
    "spindle_speed_softening": Hidden(
        "change_per_krpm",
        lambda r, m: {"change_per_krpm": drawn_signed(r, 20.0 / m.fast, 400.0 / m.fast)},
        lambda m, p: replace(m, softening=p["change_per_krpm"] / 1000.0),
    ),
    # outside of any library
    "speed_dependence": Hidden(
        "exponent reference_rpm",
        lambda r, m: {"exponent": drawn_signed(r, 0.1, 1.5), "reference_rpm": round(0.7 * m.fast)},
        lambda m, p: replace(m, speed_exponent=p["exponent"], speed_reference=p["reference_rpm"]),
    ),
    "speed_damping": Hidden(
        "growth_per_krpm",
        lambda r, m: {"growth_per_krpm": drawn_size(r, 100.0 / m.fast, 3000.0 / m.fast)},
        lambda m, p: replace(m, damping_growth=p["growth_per_krpm"] / 1000.0),
    ),
    "yielding_with_depth": Hidden(
        "loss_per_mm",
        lambda r, m: {"loss_per_mm": drawn_size(r, 0.03 / (m.level / MM), 0.8 / (m.level / MM))},
        lambda m, p: replace(m, yielding=p["loss_per_mm"] / MM),
    ),
    "wrong_labels": Hidden(
        "share",
        lambda r, _: {"share": drawn_size(r, 0.03, 0.3)},
        lambda m, p: replace(m, mislabelled=p["share"]),
    ),
    "uneven_pitch": Hidden("pitch_deg[]", _spacing, _uneven),
    "tool_runout": Hidden(
        "radius_um angle_deg",
        lambda r, m: {
            "radius_um": drawn_size(r, 0.15 * m.feed / UM, 1.5 * m.feed / UM),
            "angle_deg": drawn_angle(r),
        },
        lambda m, p: replace(m, runout=p["radius_um"] * UM, runout_angle=p["angle_deg"] * DEG),
    ),
}
