"""Draws each model beside a closed form that shares no code with it.

The page of the models shows the figures, ``tests/docs`` holds each to its bound. To draw them anew:
``python scripts/validation.py docs/figures``.
"""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from metro.cutting.chip import Cut as Pass
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.force import mean_force
from metro.cutting.law import EdgeLaw
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.report import style
from metro.robot.kinematics import Arm, arm_of_cell
from metro.robot.statics import joint_torque, tip_compliance, tip_jacobian
from metro.robot.tracking import tracking_error
from metro.signals.kalman import smooth
from metro.surface.areal import CellSums, gaussian_s_filter, interior, make_grid
from metro.surface.tip_response import respond, tip_modes
from metro.units import Array

Line = tuple[Array, Array]
CELL = Path(__file__).parents[1] / "config/cells/kr160.yaml"
POSE = np.radians([-35.0, -5.0, 5.0, -40.0, -80.0, 60.0])
COEFFICIENTS = np.array(
    [10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3]
)  # [T] table 4, N/m² and N/m


@dataclass(frozen=True)
class Check:
    """Curves of a closed form, and the model's values at some of their places.

    Attributes
    ----------
    lines, points : by name; a name in both is one quantity. bound : of the relative difference that is
        allowed, which the figure states.
    """

    xlabel: str
    ylabel: str
    lines: dict[str, Line]
    points: dict[str, Line]
    bound: float

    @property
    def worst(self) -> float:
        """Largest difference of the points from the lines, over the largest value of the line."""
        return max(
            float(np.abs(y - np.interp(x, *self.lines[name])).max() / np.abs(self.lines[name][1]).max())
            for name, (x, y) in self.points.items()
        )


def mean_force_by_hand(
    arc: Engagement, feed: float, depth: float, teeth: int, coefficients: Sequence[float]
) -> Array:
    """Mean force (3,), N, of even teeth: sin², sin cos, sin and cos integrated over the arc by hand."""
    ktc, krc, kac, kte, kre, kae = coefficients
    p, q = arc.entry, arc.exit
    square = (q - p) / 2 - (math.sin(2 * q) - math.sin(2 * p)) / 4
    product = (math.cos(2 * p) - math.cos(2 * q)) / 4
    sine, cosine = math.cos(p) - math.cos(q), math.sin(q) - math.sin(p)
    force = [
        -feed * (ktc * product + krc * square) - kte * cosine - kre * sine,
        feed * (ktc * square - krc * product) + kte * sine - kre * cosine,
        feed * kac * sine + kae * (q - p),
    ]
    return np.array(force) * teeth * depth / (2 * math.pi)


def force() -> Check:
    """Mean force over the radial depth: integrals of sin², sin cos, sin and cos over the arc, by hand."""
    radius, feed, depth, teeth = 6e-3, 0.05e-3, 1e-3, 4
    tool = Cutter(radius, math.radians(40.0), evenly_pitched(teeth))
    share = np.linspace(0.05, 0.95, 181)
    arcs = [engagement("side", "down", 2 * radius * s, radius) for s in share]
    exact = np.array([mean_force_by_hand(arc, feed, depth, teeth, COEFFICIENTS) for arc in arcs])
    found = np.array(
        [mean_force(tool, EdgeLaw(), Pass(feed, depth, arc), COEFFICIENTS) for arc in arcs[::15]]
    )
    names = [f"mean force along {axis}" for axis in "xyz"]
    return Check(
        "radial depth over diameter, down milling",
        "force (N)",
        {name: (share, exact[:, i]) for i, name in enumerate(names)},
        {name: (share[::15], found[:, i]) for i, name in enumerate(names)},
        1e-9,
    )


def modes() -> Check:
    """Receptance of two masses on springs: the inverse of the dynamic stiffness."""
    mass, rigid = np.diag([3.0, 1.2]), np.array([[9e6, -3e6], [-3e6, 3e6]])
    square, shape = np.linalg.eigh(np.linalg.inv(mass) ** 0.5 @ rigid @ np.linalg.inv(mass) ** 0.5)
    tip = (np.linalg.inv(mass) ** 0.5 @ shape)[1]
    damping, omega = 4e-5, np.sqrt(square)
    model = Structure(np.zeros(2, dtype=int), omega, damping * omega / 2, square / tip**2)
    hz = np.linspace(100.0, 500.0, 401)
    at = 2 * np.pi * hz
    dynamic = rigid + 1j * at[:, None, None] * damping * rigid - at[:, None, None] ** 2 * mass
    exact, found = np.linalg.inv(dynamic)[:, 1, 1], model.receptance(at[::10])[:, 0, 0]
    parts: dict[str, Callable[[Array], Array]] = {"real part": np.real, "imaginary part": np.imag}
    return Check(
        "frequency (Hz)",
        "receptance (µm/N)",
        {name: (hz, 1e6 * of(exact)) for name, of in parts.items()},
        {name: (hz[::10], 1e6 * of(found)) for name, of in parts.items()},
        1e-9,
    )


def lobes() -> Check:
    """Boundary of four teeth in a slot on one mode in y: their sum does not vary, the lobes are closed."""
    teeth, radial, hz, zeta, k = 4, 6e8, 50.0, 0.03, 5e6
    mode = Structure(np.array([1]), 2 * np.pi * np.array([hz]), np.array([zeta]), np.array([k]))
    omega = 2 * np.pi * np.linspace(1.0005 * hz, 2.2 * hz, 20001)
    flexible = 1 / (k * (1 - (omega / (2 * np.pi * hz)) ** 2 + 2j * zeta * omega / (2 * np.pi * hz)))
    depth = -1 / (2 * radial * flexible.real)
    phase = -np.angle(1 + 1 / (radial * depth * flexible)) % (2 * np.pi)
    rpm = np.linspace(340.0, 800.0, 461)
    each = []
    for lobe in range(8):
        speed = 60 * omega / (teeth * (phase + 2 * np.pi * lobe))
        order = np.argsort(speed)
        each.append(np.interp(rpm, speed[order], depth[order], left=np.inf, right=np.inf))
    exact = np.min(each, axis=0)
    found = stability_boundary(mode, Cut(teeth, 0.0, math.pi, 1e9, radial), rpm[::20]).depth
    name = "least unstable depth"
    bound = 2e-3  # of the straight lines between the points of the closed form
    return Check(
        "spindle speed (rev/min)",
        "depth of cut (mm)",
        {name: (rpm, 1e3 * exact)},
        {name: (rpm[::20], 1e3 * found)},
        bound,
    )


def joint_force() -> Check:
    """Level of a torque that wanders in noise: the mean of the joint Gaussian, by a linear system."""
    rng, n, noise, drift = np.random.default_rng(5), 60, 4.0, 0.5
    seen = 20.0 + np.cumsum(rng.normal(0, drift**0.5, n)) + rng.normal(0, noise**0.5, n)
    step = np.diff(np.eye(n), axis=0)
    exact = np.linalg.solve(np.eye(n) / noise + step.T @ step / drift, seen / noise)
    found = smooth(seen[:, None], np.array([noise]), np.array([drift]))[0][:, 0]
    at, name = np.arange(n, dtype=float), "level of the torque"
    return Check(
        "bin along the wall", "torque (N m)", {name: (at, exact)}, {name: (at[::3], found[::3])}, 1e-9
    )


def arm() -> Arm:
    """Return the published arm with its tool."""
    cell = yaml.safe_load(CELL.read_text(encoding="utf-8"))
    found = arm_of_cell(cell, {"tool_in_flange_mm": [212.5, 0.0, 279.91]})
    assert found is not None, CELL
    return found


def torques() -> Check:
    """Torques that a force on the tip asks for: the work it does over a small turn of each joint."""
    kr160, push, step = arm(), np.array([150.0, -270.0, -50.0]), 1e-6
    turn = np.linspace(-40.0, 40.0, 81)
    poses = POSE + np.radians(turn)[:, None] * np.eye(6)[2]
    lines, points = {}, {}
    for i in range(6):
        way = kr160.tip(poses + step * np.eye(6)[i]) - kr160.tip(poses - step * np.eye(6)[i])
        lines[f"joint {i + 1}"] = (turn, -way @ push / (2 * step))
        found = joint_torque(tip_jacobian(kr160, poses[::8]), push)[:, i]
        points[f"joint {i + 1}"] = (turn[::8], found)
    return Check("turn of joint 3 (°)", "motor torque (N m)", lines, points, 1e-6)


def deformation() -> Check:
    """Deflection of the tip: every joint turned by its torque times its compliance, by forward kinematics."""
    kr160, compliance = arm(), 1 / np.array([1.8e6, 2.1e6, 1.3e6, 3.1e5, 3.9e5, 2.3e5])
    angle = np.linspace(0.0, 360.0, 121)
    push = 200.0 * np.stack([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0 * angle], axis=1)
    step = 1e-6
    ways = [kr160.tip(POSE + step * e) - kr160.tip(POSE - step * e) for e in np.eye(6)]
    twist = compliance * (push @ np.transpose(ways)) / (2 * step)
    exact = kr160.tip(POSE + twist) - kr160.tip(POSE)
    found = push[::8] @ tip_compliance(kr160, POSE, compliance)
    return Check(
        "direction of a force of 200 N in the plane (°)",
        "deflection (mm)",
        {f"along {a}": (angle, 1e3 * exact[:, i]) for i, a in enumerate("xyz")},
        {f"along {a}": (angle[::8], 1e3 * found[:, i]) for i, a in enumerate("xyz")},
        2e-3,  # what the turn itself changes, which the linear model leaves out
    )


def waviness() -> Check:
    """Way of the tip when one joint lags: the chord of its circle about the joint's axis."""
    kr160 = arm()
    lag = np.linspace(0.0, 50.0, 51)
    tip = kr160.tip(POSE)
    radius = {
        "joint 1": (0, math.hypot(*(kr160.work[:3, :3] @ tip + kr160.work[:3, 3])[:2])),
        "joint 6": (5, 0.2125),
    }
    lines, points = {}, {}
    for name, (joint, r) in radius.items():
        lines[name] = (lag, 2e6 * r * np.sin(np.radians(lag * 1e-3) / 2))
        measured = POSE + np.radians(lag[::5] * 1e-3)[:, None] * np.eye(6)[joint]
        error = tracking_error(kr160, measured, np.broadcast_to(POSE, measured.shape)).tip
        points[name] = (lag[::5], 1e6 * np.linalg.norm(error, axis=1))
    return Check("lag of the joint (0.001°)", "error of the tip (µm)", lines, points, 1e-6)


def face() -> Check:
    """Tip of an arm under a force that sets in: the damped oscillation of one mass, two samples a period."""
    omega, k, ratio, push, step = 20.0, 4.0e4, 0.06, 100.0, 0.15
    modes = tip_modes(np.eye(3) * k / omega**2, np.eye(3)[None] * k)
    time = step * np.arange(31)
    found = respond(modes, np.full((1, 3), ratio), np.tile([0.0, 0.0, push], (1, 31, 1)), step)[0]
    fine = np.linspace(0.0, time[-2], 581)
    turn = omega * math.sqrt(1 - ratio**2)
    decay = np.exp(-ratio * omega * fine)
    exact = push / k * (1 - decay * (np.cos(turn * fine) + ratio * omega / turn * np.sin(turn * fine)))
    name = "height of the tip"
    return Check(
        "time (s)", "height (mm)", {name: (fine, 1e3 * exact)}, {name: (time[:-1], 1e3 * found)}, 1e-6
    )


def flatness() -> Check:
    """Waves that pass the areal filter: the transmission of ISO 16610-61."""
    nesting, pitch = 2.5, 0.375
    x, y = (
        g.ravel() for g in np.meshgrid(np.arange(0.2, 120, pitch), np.arange(0.2, 30, pitch), indexing="ij")
    )
    grid = make_grid(np.array([x.min(), y.min()]), np.array([x.max(), y.max()]), 2 * pitch)
    cells = grid.cells(x, y)
    wavelength = np.array([2.5, 3.0, 4.0, 5.0, 7.5, 10.0])
    kept = []
    for each in wavelength:
        sums = CellSums(grid, grid.sums(cells), grid.sums(cells, np.cos(2 * np.pi * x / each)))
        inside = interior(sums, 2 * nesting)
        wave = np.cos(2 * np.pi * grid.centres()[inside.ravel()][:, 0] / each)
        kept.append(float(gaussian_s_filter(sums, nesting)[inside] @ wave / (wave @ wave)))
    fine = np.linspace(2.5, 10.0, 151)
    name = "share that passes"
    exact = np.exp(-np.pi * (0.46972 * nesting / fine) ** 2)
    bound = 0.02  # of cells of two pitches
    return Check(
        "wavelength (mm)", "transmission", {name: (fine, exact)}, {name: (wavelength, np.array(kept))}, bound
    )


CHECKS = {
    each.__name__: each
    for each in (force, modes, lobes, joint_force, torques, deformation, waviness, face, flatness)
}


def drawn(check: Check) -> bytes:
    """Return a check as SVG: closed forms as lines, the model as points."""
    with style.style():
        figure, ((axes,),) = style.new_figure(2.4, width=5.0)
        for colour, (name, line) in zip(style.SERIES, check.lines.items(), strict=False):
            axes.plot(*line, color=colour, label=name)
            axes.plot(*check.points[name], "o", color=colour, mfc="white", ms=4)
        axes.set(xlabel=check.xlabel, ylabel=check.ylabel)
        axes.set_title(
            f"lines: closed form; points: the model; apart by less than {check.bound:.0e}", loc="left"
        )
        if len(check.lines) > 1:
            axes.legend(ncols=2 if len(check.lines) > 3 else 1, loc="best")
        return style.to_svg(figure)


if __name__ == "__main__":
    for name, make in CHECKS.items():
        check = make()
        if not check.worst < check.bound:
            sys.exit(f"{name}: {check.worst:.3g} apart, more than {check.bound:.0e}")
        (Path(sys.argv[1]) / f"model-{name}.svg").write_bytes(drawn(check))
        print(f"{name}: {check.worst:.1e}")
