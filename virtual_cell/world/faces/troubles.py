"""Troubles that a batch of faces of the harder world may hide: how large they come."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from virtual_cell.hidden import Parameters, drawn_size
from virtual_cell.recipes.faces_world_draws import Workshop
from virtual_cell.units import MM, UM
from virtual_cell.world.draws import either_sign, uniform
from virtual_cell.world.faces import machine_troubles, work_troubles
from virtual_cell.world.faces.finish import Cause, FaceRun
from virtual_cell.world.faces.hideable import Applied, Hideable, sized, wave


def _trouble(
    parameters: str,
    draw: Callable[[np.random.Generator, Workshop], Parameters],
    make: Callable[[Parameters, Workshop], Cause],
) -> Hideable:
    """Return something to hide that is a cause of its own, exactly as its parameters say."""

    def apply(cell: Workshop, _: list[FaceRun], p: Parameters, __: np.random.Generator) -> Applied:
        return replace(cell, troubles=(*cell.troubles, make(p, cell))), 0.0

    return Hideable(parameters, draw, apply)


def _share(rng: np.random.Generator) -> float:
    """Draw the share of the faces that something happens in."""
    return uniform(rng, 0.4, 0.9)


TROUBLES: Mapping[str, Hideable] = {
    "heated_side": _trouble(
        "rise_um time_s",
        lambda r, c: {
            "rise_um": either_sign(r) * sized(r, c, 0.13, 400.0),
            "time_s": drawn_size(r, 40.0, 250.0),
        },
        lambda p, _: work_troubles.HeatedSide(p["rise_um"] * UM, p["time_s"]),
    ),
    "coolant_switched": _trouble(
        "shrink_um time_s share",
        lambda r, c: {
            "shrink_um": either_sign(r) * sized(r, c, 0.5, 120.0),
            "time_s": drawn_size(r, 3.0, 15.0),
            "share": _share(r),
        },
        lambda p, _: work_troubles.CoolantSwitched(p["shrink_um"] * UM, p["time_s"], p["share"]),
    ),
    "creeping_shim": _trouble(
        "sinks_um u v time_s",
        lambda r, c: {
            "sinks_um": sized(r, c, 0.15, 400.0),
            "u": either_sign(r),
            "v": either_sign(r),
            "time_s": drawn_size(r, 100.0, 1500.0),
        },
        lambda p, _: work_troubles.CreepingShim(p["sinks_um"] * UM, (p["u"], p["v"]), p["time_s"]),
    ),
    "chip_under_clamp": _trouble(
        "height_um radius_mm share",
        lambda r, c: {
            "height_um": sized(r, c, 0.2, 350.0),
            "radius_mm": drawn_size(r, 25.0, 50.0),
            "share": _share(r),
        },
        lambda p, _: work_troubles.ChipUnderClamp(p["height_um"] * UM, p["radius_mm"] * MM, p["share"]),
    ),
    "vacuum_release": _trouble(
        "lift_um radius_mm at_u at_v share",
        lambda r, c: {
            "lift_um": sized(r, c, 0.2, 350.0),
            "radius_mm": drawn_size(r, 25.0, 55.0),
            "at_u": uniform(r, 0.25, 0.75),
            "at_v": uniform(r, 0.25, 0.75),
            "share": _share(r),
        },
        lambda p, _: work_troubles.VacuumRelease(
            p["lift_um"] * UM, p["radius_mm"] * MM, (p["at_u"], p["at_v"]), p["share"]
        ),
    ),
    "hard_inclusion": _trouble(
        "more radius_mm share",
        lambda r, _: {
            "more": drawn_size(r, 3.0, 10.0),
            "radius_mm": drawn_size(r, 10.0, 22.0),
            "share": _share(r),
        },
        lambda p, _: work_troubles.HardInclusion(p["more"], p["radius_mm"] * MM, p["share"]),
    ),
    "thin_plate": _trouble(
        "frequency_hz drop size_um",
        lambda r, c: {
            "frequency_hz": wave(r, c, 8.0, 35.0),
            "drop": uniform(r, 0.05, 0.25),
            "size_um": sized(r, c, 0.2, 150.0),
        },
        lambda p, _: work_troubles.ThinPlate(p["frequency_hz"], p["drop"], p["size_um"] * UM),
    ),
    "corner_blending": _trouble(
        "dip_um way_mm",
        lambda r, c: {
            "dip_um": either_sign(r) * sized(r, c, 0.15, 350.0),
            "way_mm": drawn_size(r, 25.0, 60.0),
        },
        lambda p, _: machine_troubles.CornerBlending(p["dip_um"] * UM, p["way_mm"] * MM),
    ),
    "worn_way": _trouble(
        "dip_um half_mm first second",
        lambda r, c: {
            "dip_um": either_sign(r) * sized(r, c, 0.2, 150.0),
            "half_mm": drawn_size(r, 15.0, 45.0),
            "first": uniform(r, 0.2, 0.5),
            "second": uniform(r, 0.5, 0.8),
        },
        lambda p, _: machine_troubles.WornWay(p["dip_um"] * UM, p["half_mm"] * MM, (p["first"], p["second"])),
    ),
    "power_sag": _trouble(
        "loss lasts_s per_min",
        lambda r, _: {
            "loss": uniform(r, 0.3, 0.6),
            "lasts_s": drawn_size(r, 4.0, 15.0),
            "per_min": drawn_size(r, 1.5, 5.0),
        },
        lambda p, _: machine_troubles.PowerSag(p["loss"], p["lasts_s"], p["per_min"]),
    ),
    "lost_insert": _trouble(
        "from_share blunter shorter_um",
        lambda r, _: {
            "from_share": uniform(r, 0.25, 0.7),
            "blunter": drawn_size(r, 0.3, 1.5),
            "shorter_um": drawn_size(r, 5.0, 60.0),
        },
        lambda p, _: machine_troubles.LostInsert(p["from_share"], p["blunter"], p["shorter_um"] * UM),
    ),
    "snagging_hose": _trouble(
        "pull_um wrist=A|B",
        lambda r, c: {
            "pull_um": either_sign(r) * sized(r, c, 0.25, 200.0),
            "wrist": str(r.choice(sorted({case.wrist for case in c.cases}))),
        },
        lambda p, _: machine_troubles.SnaggingHose(p["pull_um"] * UM, p["wrist"]),
    ),
    "scanner_wheel": _trouble(
        "size_um length_mm",
        lambda r, c: {"size_um": sized(r, c, 0.6, 80.0), "length_mm": drawn_size(r, 25.0, 110.0)},
        lambda p, c: machine_troubles.ScannerWheel(
            p["size_um"] * UM, p["length_mm"] * MM, c.scanner.direction
        ),
    ),
}
