"""Causes outside any library of effects that a force batch of the harder world can hide: how large they come.

Each is made as it happens (:mod:`virtual_cell.world.force.outside_work`,
:mod:`virtual_cell.world.force.outside_machine`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from virtual_cell.hidden import Hidden, drawn_angle, drawn_signed, drawn_size
from virtual_cell.units import DEG, MM, RPM, UM
from virtual_cell.world.force import outside_machine as machine
from virtual_cell.world.force import outside_work as work
from virtual_cell.world.force.cause import Cause
from virtual_cell.world.force.making import Making


def _caused(m: Making, cause: Cause) -> Making:
    return m.with_(causes=(*m.cell.causes, cause))


def _axis(rng: np.random.Generator) -> int:
    return int(rng.integers(3))


OUTSIDE: Mapping[str, Hidden[Making]] = {
    "loose_bolt": Hidden(
        "axis sign preload_n share",
        lambda r, _: {
            "axis": _axis(r),
            "sign": float(r.choice([-1.0, 1.0])),
            "preload_n": drawn_size(r, 5.0, 60.0),
            "share": drawn_size(r, 0.04, 0.4),
        },
        lambda m, p: _caused(m, machine.LooseBolt(p["axis"], p["sign"], p["preload_n"], p["share"])),
    ),
    "creeping_shim": Hidden(
        "total_um early",
        lambda r, _: {"total_um": drawn_size(r, 60.0, 400.0), "early": drawn_size(r, 0.02, 0.3)},
        lambda m, p: _caused(m, work.CreepingShim(p["total_um"] * UM, p["early"])),
    ),
    "coolant_jet": Hidden(
        "push_n[3] eased from_share",
        lambda r, _: {
            "push_n": [drawn_signed(r, 5.0, 40.0) for _ in range(3)],
            "eased": round(float(r.uniform(0.1, 0.4)), 2),
            "from_share": round(float(r.uniform(0.3, 0.7)), 2),
        },
        lambda m, p: _caused(m, machine.CoolantJet((*p["push_n"],), p["eased"], p["from_share"])),
    ),
    "power_sag": Hidden(
        "share seconds chance",
        lambda r, _: {
            "share": drawn_size(r, 0.04, 0.25),
            "seconds": drawn_size(r, 0.1, 0.5),
            "chance": round(float(r.uniform(0.3, 0.8)), 2),
        },
        lambda m, p: _caused(m, machine.PowerSag(p["share"], p["seconds"], p["chance"])),
    ),
    "worn_way": Hidden(
        "wave_mm share dip_um at_deg",
        lambda r, _: {
            "wave_mm": drawn_size(r, 4.0, 30.0),
            "share": drawn_size(r, 0.05, 0.3),
            "dip_um": drawn_size(r, 5.0, 80.0),
            "at_deg": drawn_angle(r),
        },
        lambda m, p: _caused(
            m, machine.WornWay(p["wave_mm"] * MM, p["share"], p["dip_um"] * UM, p["at_deg"] * DEG)
        ),
    ),
    "moving_resonance": Hidden(
        "axis frequency_hz rise damping share",
        lambda r, _: {
            "axis": int(r.integers(2)),
            "frequency_hz": drawn_size(r, 250.0, 900.0),
            "rise": round(float(r.uniform(0.15, 0.5)), 2),
            "damping": drawn_size(r, 0.02, 0.08),
            "share": drawn_size(r, 0.1, 0.8),
        },
        lambda m, p: _caused(
            m, machine.MovingResonance(p["axis"], p["frequency_hz"], p["rise"], p["damping"], p["share"])
        ),
    ),
    "chip_recutting": Hidden(
        "more chance teeth",
        lambda r, _: {
            "more": drawn_size(r, 0.2, 1.2),
            "chance": round(float(r.uniform(0.1, 0.5)), 2),
            "teeth": drawn_size(r, 2.0, 15.0),
        },
        lambda m, p: _caused(m, work.Recutting(p["more"], p["chance"], p["teeth"])),
    ),
    "coating_loss": Hidden(
        "tooth after_m rubs harder shorter_um",
        lambda r, m: {
            "tooth": int(r.integers(m.cell.tool.teeth)),
            "after_m": round(float(r.uniform(0.2, 0.6)) * m.cell.metres, 2),
            "rubs": drawn_size(r, 0.3, 1.5),
            "harder": drawn_size(r, 0.05, 0.3),
            "shorter_um": drawn_size(r, 2.0, 10.0),
        },
        lambda m, p: _caused(
            m, work.CoatingLoss(p["tooth"], p["after_m"], p["rubs"], p["harder"], p["shorter_um"] * UM)
        ),
    ),
    "cable_microphonics": Hidden(
        "axis size_n frequency_hz",
        lambda r, _: {
            "axis": _axis(r),
            "size_n": drawn_size(r, 8.0, 80.0),
            "frequency_hz": drawn_size(r, 6.0, 60.0),
        },
        lambda m, p: _caused(m, machine.CableMicrophonics(p["axis"], p["size_n"], p["frequency_hz"])),
    ),
    "race_ovality": Hidden(
        "lobes size_um angle_deg",
        lambda r, _: {
            "lobes": int(r.choice([2, 3])),
            "size_um": drawn_size(r, 2.0, 16.0),
            "angle_deg": drawn_angle(r),
        },
        lambda m, p: _caused(m, machine.RaceOvality(p["lobes"], p["size_um"] * UM, p["angle_deg"] * DEG)),
    ),
    "corner_blending": Hidden(
        "place_mm length_mm drop aside_um",
        lambda r, _: {
            "place_mm": drawn_size(r, 1.0, 8.0),
            "length_mm": drawn_size(r, 1.0, 5.0),
            "drop": drawn_size(r, 0.15, 0.7),
            "aside_um": drawn_signed(r, 30.0, 300.0),
        },
        lambda m, p: _caused(
            m, machine.CornerBlending(p["place_mm"] * MM, p["length_mm"] * MM, p["drop"], p["aside_um"] * UM)
        ),
    ),
    "stick_slip": Hidden(
        "share frequency_hz",
        lambda r, _: {"share": drawn_size(r, 0.1, 0.6), "frequency_hz": drawn_size(r, 1.0, 8.0)},
        lambda m, p: _caused(m, machine.StickSlip(p["share"], p["frequency_hz"])),
    ),
    "built_up_edge": Hidden(
        "eased period_s",
        lambda r, _: {"eased": drawn_size(r, 0.06, 0.4), "period_s": drawn_size(r, 0.1, 1.0)},
        lambda m, p: _caused(m, work.BuiltUpEdge(p["eased"], p["period_s"])),
    ),
    "hard_skin": Hidden(
        "thick_mm harder",
        lambda r, _: {"thick_mm": drawn_size(r, 0.15, 0.7), "harder": drawn_size(r, 0.2, 1.0)},
        lambda m, p: _caused(m, work.HardSkin(p["thick_mm"] * MM, p["harder"])),
    ),
    "slanted_blank": Hidden(
        "rise_um_mm",
        lambda r, _: {"rise_um_mm": drawn_signed(r, 4.0, 40.0)},
        lambda m, p: _caused(m, work.SlantedBlank(p["rise_um_mm"] * UM / MM)),
    ),
    "heat_softening": Hidden(
        "exponent",
        lambda r, _: {"exponent": drawn_size(r, 0.12, 0.6)},
        lambda m, p: _caused(m, work.SpeedDependence(p["exponent"], m.plans[0].spindle_rpm * RPM)),
    ),
    "sagging_gain": Hidden(
        "axis share",
        lambda r, _: {"axis": _axis(r), "share": drawn_size(r, 0.04, 0.3)},
        lambda m, p: _caused(m, machine.SaggingGain(p["axis"], p["share"])),
    ),
}
