"""The day on which an arm of the harder world cut: in which order, how warm, of which metal, read by what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from virtual_cell.milling import Coefficients, scattered
from virtual_cell.recipes.arm_draws import Bench
from virtual_cell.session import Plan
from virtual_cell.units import DEG, MM
from virtual_cell.world.arm import joints, stylus, tracker
from virtual_cell.world.arm.robot import Robot
from virtual_cell.world.arm.stylus import Stylus
from virtual_cell.world.arm.tracker import Tracker
from virtual_cell.world.draws import between, signed

Runs = list[tuple[Plan, int]]


@dataclass(frozen=True, eq=False)
class Session:
    """The day on which a batch was made: instruments, people, metal, warmth.

    Attributes
    ----------
    runs : condition and replicate, in the order of cutting. without_idle : places in that order. entries : so
        many holes were milled on a helix before, which nobody recorded.
    gap : s between runs. idle_first : whether all idle runs were made before the first cut.
    common, own, drift : relative scatter of all coefficients in a run and of each, and their change over the
        session. slow : relative, the spindle is slower than told, and its scatter ``spindle`` between runs.
    shallow : m, standard deviation by which axial and radial depths are off.
    """

    runs: Runs
    without_idle: frozenset[int]
    entries: int
    stylus: Stylus
    tracker: Tracker
    warming: joints.Warming
    gap: float
    idle_first: bool
    common: float
    own: float
    drift: float
    slow: float
    spindle: float
    shallow: float

    def cut_at(self, order: int) -> float:
        """Time, s, at which the run of that order (1, 2, …) is cut."""
        return (len(self.runs) * 45.0 if self.idle_first else 0.0) + order * self.gap

    def idle_at(self, order: int) -> float:
        """Time, s, of its idle run."""
        return order * 45.0 if self.idle_first else self.cut_at(order) - 0.4 * self.gap

    def metal(self, bench: Bench, order: int, rng: np.random.Generator) -> Coefficients:
        """Coefficients as they are in a run."""
        whole = 1.0 + self.common * rng.standard_normal() + self.drift * (order - 1) / len(self.runs)
        return scattered(bench.metal, self.own, rng).softened(whole)

    def cut(self, plan: Plan, rng: np.random.Generator) -> Plan:
        """Return the settings as they really are in a run."""
        axial, radial = rng.normal(0.0, self.shallow / MM, 2)
        return replace(
            plan, axial_depth_mm=plan.axial_depth_mm + axial, radial_depth_mm=plan.radial_depth_mm + radial
        )


def session(
    rng: np.random.Generator, plans: Sequence[Plan], *, clumps: float, lacking: float, entries: float
) -> Session:
    """Draw a day; probabilities: repeats in ``clumps``, idle logs ``lacking``, ``entries`` on a helix."""
    runs = [(plan, i) for plan in plans for i in range(1, plan.replicates + 1)]
    clumped = bool(rng.uniform() < clumps)
    order = rng.permutation(len(plans if clumped else runs))
    if clumped:
        runs = [(plans[k], i) for k in order for i in range(1, plans[k].replicates + 1)]
    else:
        runs = [runs[k] for k in order]
    forgetful = rng.uniform() < lacking
    again = [place for place, (_, replicate) in enumerate(runs, start=1) if replicate > 1]
    forgotten = [place for place in again if rng.uniform() < 0.5] if forgetful else []
    return Session(
        runs,
        frozenset(forgotten),
        int(rng.integers(1, 4)) if rng.uniform() < entries else 0,
        stylus.drawn(rng),
        tracker.drawn(rng),
        joints.warming(rng),
        gap=between(rng, 90.0, 500.0),
        idle_first=bool(rng.uniform() < 0.3),
        common=between(rng, 0.003, 0.009),
        own=between(rng, 0.003, 0.009),
        drift=signed(rng, 0.005, 0.03),
        slow=signed(rng, 1.8e-4, 4e-3),
        spindle=between(rng, 1e-4, 2e-3),
        shallow=between(rng, 8.0, 60.0) * 1e-6,
    )


def in_plain_units(robot: Robot, bench: Bench, session: Session) -> dict[str, Any]:
    """Return what was drawn of the world, for the truth."""
    recorder, servo = robot.recorder, robot.servo
    return {
        "presliding_mrad": (robot.joints.bristle * 1e3).round(3).tolist(),
        "stribeck_mrad_s": (robot.joints.creep * 1e3).round(2).tolist(),
        "above_coulomb": robot.joints.breakaway.round(3).tolist(),
        "friction_by_load": robot.joints.by_load.round(4).tolist(),
        "viscous_lost_when_warm": round(robot.joints.thinning, 3),
        "warmth_of_the_first_and_last_cut": [
            round(session.warming.at(session.cut_at(i)), 3) for i in (1, len(session.runs))
        ],
        "idle_runs_before_all_cuts": session.idle_first,
        "runs_without_idle_log": sorted(session.without_idle),
        "helical_entries_not_recorded": session.entries,
        "transmission_error_arcsec": (robot.transmission.size.sum(axis=1) / DEG * 3600.0).round(1).tolist(),
        "lost_motion_arcsec": (robot.springs.lost / DEG * 3600.0).round(2).tolist(),
        "stiffness_of_the_pieces": robot.springs.ratio.round(3).tolist(),
        "modes_hz": [round(mode[0], 2) for mode in robot.links.modes],
        "torques_off": recorder.gain.round(4).tolist(),
        "packets_late_lost_doubled": [round(v, 5) for v in (recorder.late, recorder.lost, recorder.doubled)],
        "clock_skew_ppm": round(recorder.skew * 1e6, 1),
        "servo_lag_ms": round(servo.lag * 1e3, 2),
        "trace_zero_um": round(session.stylus.zero * 1e6, 2),
        "tracker_um_per_m": round(session.tracker.across * 1e6, 2),
        "dynamometer_gains_off": bench.calibration[:3].round(4).tolist(),
        "coefficients_scatter": [round(v, 4) for v in (session.common, session.own, session.drift)],
    }
