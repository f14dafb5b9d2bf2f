"""Effects of the contract that a force batch of the harder world can hide: each made as it is made in a shop.

The parameters are those of the contract; what is built has more (where a tool is bent, how a land wears), and
the truth states what the result comes to in the contract's terms.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from virtual_cell.hidden import Hidden, Parameters, drawn_angle, drawn_signed, drawn_size
from virtual_cell.session import Plan
from virtual_cell.units import DEG, MM, N_UM, UM
from virtual_cell.world.force.cutter import drawn_wear, set_off, spread, uneven_pitch
from virtual_cell.world.force.making import Making
from virtual_cell.world.force.metal import length_for
from virtual_cell.world.force.table import loaded
from virtual_cell.world.force.terms import orbit_waves
from virtual_cell.world.force.yielding import Holder

HALVINGS = 9  # in the search of a sway: to 0.2 % of half the pitch


def _runout(m: Making, p: Parameters) -> Making:
    radius, angle = p["radius_um"] * UM, p["angle_deg"] * DEG
    return m.with_(tool=set_off(m.cell.tool, radius, angle, m.rng))


def _pitch_drawn(rng: np.random.Generator, m: Making) -> Parameters:
    off = spread(m.cell.tool.teeth, rng) * drawn_size(rng, 0.8, 5.0)
    return {"pitch_deg": [round(float(e), 3) for e in off]}


def _pitch(m: Making, p: Parameters) -> Making:
    """Index the gashes wrongly; the helices of the teeth differ as they did."""
    tool = m.cell.tool
    off = np.array(p["pitch_deg"]) * DEG - uneven_pitch(tool, 0.5 * m.cell.depth)
    return m.with_(tool=replace(tool, angles=tool.angles + off))


def _wear(m: Making, p: Parameters) -> Making:
    return m.with_(wear=drawn_wear(p["edge_growth_per_m"], m.cell.metres, m.cell.metal.edge, m.rng))


def _size(m: Making, p: Parameters) -> Making:
    """Let the metal have a longer strain gradient."""
    return m.with_(metal=replace(m.cell.metal, length=length_for(p["exponent"], m.cell.metal)))


def _deflection(m: Making, p: Parameters) -> Making:
    """Clamp the tool in a soft holder; its modes lie skew, above where chatter would start."""
    stiffness = (p["kx_n_um"] * N_UM, p["ky_n_um"] * N_UM)
    base = float(m.rng.uniform(3200.0, 5200.0))
    frequency = (base, base * float(m.rng.uniform(1.05, 1.3)))
    # A cut of depth a stays stable where 2 ζ k > K_t a for all that the lobes may do.
    heavy = float(m.cell.metal.shear[0]) * m.cell.depth
    damping = [max(0.7 * heavy / k, 0.08) for k in stiffness]
    skew = float(m.rng.uniform(-8.0, 8.0)) * DEG
    return m.with_(holder=Holder(stiffness, frequency, (damping[0], damping[1]), skew))


def _helical(m: Making) -> Plan:
    return next(plan for plan in m.plans if plan.operation == "helical")


def _orbit(m: Making, p: Parameters) -> Making:
    """Let the machine sway as it circles, as much as makes such a wave of the axial force.

    With a sway of about the pitch over 2π, the bottom begins to leave the floor once per orbit.

    Raises
    ------
    ValueError
        No sway makes so large a wave.
    """
    low, high = 0.0, 0.5 * _helical(m).axial_depth_mm * MM
    for _ in range(HALVINGS):
        sway = 0.5 * (low + high)
        wave, _ = orbit_waves(replace(m.cell, sway=sway), _helical(m))
        low, high = (sway, high) if abs(wave) < p["amplitude"] else (low, sway)
    if abs(wave) < 0.8 * p["amplitude"]:
        raise ValueError(f"no sway makes the axial force vary by {p['amplitude']:g} of its mean")
    return m.with_(sway=sway, sway_phase=p["phase_deg"] * DEG - float(np.angle(wave)))


def _rotation(m: Making, p: Parameters) -> Making:
    return m.with_(table=replace(m.cell.table, yaw=p["angle_deg"] * DEG))


def _resonance_drawn(rng: np.random.Generator, m: Making) -> Parameters:
    table = loaded(m.cell.table, drawn_size(rng, 650.0, 1700.0))
    damping = [drawn_size(rng, 0.015, 0.07) for _ in range(3)]
    return {"frequency_hz": [float(f"{f:.4g}") for f in table.frequency[:, 0]], "damping": damping}


def _resonance(m: Making, p: Parameters) -> Making:
    """Clamp a heavy fixture on the table: all modes come down, the second of each axis with the first."""
    asked = np.array(p["frequency_hz"])
    table = loaded(m.cell.table, float(asked.min()))
    factor = (asked / table.frequency[:, 0])[:, None]
    damping = table.damping.copy()
    damping[:, 0] = p["damping"]
    return m.with_(table=replace(table, bare=table.bare * factor, damping=damping))


def _filter(m: Making, p: Parameters) -> Making:
    """Leave the low pass of an earlier job on: it is the lowest in the chain."""
    amplifier = m.cell.amplifier
    cutoff = p["corner_hz"] / amplifier.rate
    return m.with_(amplifier=replace(amplifier, order=int(p["order"]), cutoff=cutoff))


def _drift_drawn(rng: np.random.Generator, _: Making) -> Parameters:
    if rng.uniform() < 0.5:
        return {"time_constant_s": [drawn_size(rng, 3.0, 30.0) for _ in range(3)]}
    return {"slope_n_s": [drawn_signed(rng, 1.5, 15.0) for _ in range(3)]}


def _drift(m: Making, p: Parameters) -> Making:
    """Let the input leak: a current that charges it, or a bad insulation that discharges it."""
    amplifier = m.cell.amplifier
    if "slope_n_s" in p:
        amplifier = replace(amplifier, drift=np.array(p["slope_n_s"]), waits=(0.1, 0.6))
    if "time_constant_s" in p:
        amplifier = replace(amplifier, constant=np.array(p["time_constant_s"]))
    return m.with_(amplifier=amplifier)


def _end(m: Making, p: Parameters) -> Making:
    return m.with_(tool=replace(m.cell.tool, corner=p["corner_radius_mm"] * MM))


def _end_drawn(rng: np.random.Generator, m: Making) -> Parameters:
    return {"corner_radius_mm": drawn_size(rng, 0.8, 0.98 * m.cell.tool.radius / MM)}


INSIDE: Mapping[str, Hidden[Making]] = {
    "tool_runout": Hidden(
        "radius_um angle_deg",
        lambda r, _: {"radius_um": drawn_size(r, 2.0, 14.0), "angle_deg": drawn_angle(r)},
        _runout,
    ),
    "tool_wear": Hidden(
        "edge_growth_per_m",
        lambda r, m: {"edge_growth_per_m": drawn_size(r, 0.2, 2.5) / m.cell.metres},
        _wear,
    ),
    "chip_size_effect": Hidden("exponent", lambda r, _: {"exponent": drawn_size(r, 0.18, 0.42)}, _size),
    "tool_deflection": Hidden(
        "kx_n_um ky_n_um",
        lambda r, _: {"kx_n_um": drawn_size(r, 0.9, 5.0), "ky_n_um": drawn_size(r, 0.9, 5.0)},
        _deflection,
    ),
    "orbit_stiffness": Hidden(
        "amplitude phase_deg",
        lambda r, _: {"amplitude": drawn_size(r, 0.05, 0.35), "phase_deg": drawn_angle(r)},
        _orbit,
    ),
    "pitch_error": Hidden("pitch_deg[]", _pitch_drawn, _pitch),
    "dynamometer_rotation": Hidden(
        "angle_deg", lambda r, _: {"angle_deg": drawn_signed(r, 2.5, 9.0)}, _rotation
    ),
    "dynamometer_resonance": Hidden("frequency_hz[3] damping[3]", _resonance_drawn, _resonance),
    "amplifier_filter": Hidden(
        "corner_hz order",
        lambda r, _: {"corner_hz": drawn_size(r, 250.0, 1150.0), "order": int(r.integers(1, 5))},
        _filter,
    ),
    "charge_drift": Hidden("slope_n_s[3]? time_constant_s[3]?", _drift_drawn, _drift),
    "tool_end": Hidden("corner_radius_mm", _end_drawn, _end),
}
