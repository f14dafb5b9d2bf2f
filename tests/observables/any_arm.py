"""Side cuts by an arm of any chain of joints, made by this file's own matrices: logs, walls, load tests."""

import numpy as np
import pandas as pd
import yaml
from scipy.interpolate import CubicSpline

# kind, theta, alpha (deg), d, a (mm): seven joints that turn; and a rail along x under six.
SEVEN = [("revolute", 0, alpha, d, 0) for alpha, d in zip(
    (-90, 90, 90, -90, -90, 90, 0), (850, 0, 1000, 0, 1000, 0, 315), strict=True)]  # fmt: skip
RAIL = [("prismatic", 90, -90, 0, 0)] + [("revolute", *row) for row in (
    (0, 90, 500, 250), (90, 0, 0, 610), (-180, -90, 0, 70), (0, 90, 710, 0), (0, -90, 0, 0), (0, 0, 215, 0),
)]  # fmt: skip
UPRIGHT, ON_SIDE = np.eye(3), np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # the rail's z is the base's x
START = {
    "seven": np.radians([10, 40, 15, -75, 20, 60, 0]),
    "rail": np.array([0.4, 0.1, -0.9, 0.9, 0.2, 0.9, 0.1]),
}
TOOL = np.array([0.06, 0.02, 0.14])
FORCE = np.array([35.0, 110.0, -20.0])
LOAD, CENTRE = 4.2, np.array([0.03, -0.02, 0.11])
TOOL_DIAMETER = 0.016
PERIOD, FEED, LENGTH = 0.012, 0.02, 0.1  # s, m/s, m
SOFT = 4e-7  # rad/(N m) of every joint, and a fifth of it in m/N of the rail


def frames(rows, base, q):
    """Frames after the base and after each joint, (n + 1, 4, 4)."""
    at = np.eye(4)
    at[:3, :3] = base
    found = [at]
    for (kind, theta, alpha, d, a), value in zip(rows, q, strict=True):
        turn = np.radians(theta) + (value if kind == "revolute" else 0.0)
        shift = d * 1e-3 + (value if kind == "prismatic" else 0.0)
        c, s, ca, sa = np.cos(turn), np.sin(turn), np.cos(np.radians(alpha)), np.sin(np.radians(alpha))
        along = a * 1e-3
        step = np.array(
            [
                [c, -s * ca, s * sa, along * c],
                [s, c * ca, -c * sa, along * s],
                [0, sa, ca, shift],
                [0, 0, 0, 1],
            ]
        )
        found.append(found[-1] @ step)
    return np.array(found)


class AnyArm:
    """An arm by name: ``seven`` or ``rail``."""

    def __init__(self, name):
        self.name, self.rows = name, {"seven": SEVEN, "rail": RAIL}[name]
        self.base = ON_SIDE if name == "rail" else UPRIGHT
        self.linear = np.array([row[0] == "prismatic" for row in self.rows])
        self.soft = np.where(self.linear, SOFT / 5, SOFT * np.linspace(0.6, 1.4, len(self.rows)))

    def point(self, q, place=TOOL):
        """Place of a point of the flange, base frame, m."""
        flange = frames(self.rows, self.base, q)[-1]
        return flange[:3, :3] @ place + flange[:3, 3]

    def moves(self, q, of):
        """Slopes of a function of the joints by central differences, (..., n)."""
        steps = 1e-6 * np.eye(len(q))
        return np.stack([(of(q + s) - of(q - s)) / 2e-6 for s in steps], axis=-1)

    def jacobian(self, q):
        """Jacobian (3, n) of the tip."""
        return self.moves(q, self.point)

    def weight(self, q, load=0.0):
        """Torques that hold the links (15 kg at each frame) and a load at its centre."""

        def energy(at):
            heights = frames(self.rows, self.base, at)[2:, 2, 3]
            return 9.81 * (15.0 * heights.sum() + load * self.point(at, CENTRE)[2])

        return self.moves(q, energy)

    def follow(self, start, way):
        """Angles along a straight way of the tip, the flange's axes fixed and a rail at rest, (m, n)."""
        axes, q, found = frames(self.rows, self.base, start)[-1][:3, :3], start.copy(), []
        free = np.where(self.linear, 0.0, 1.0)
        for place in self.point(start) + way:
            for _ in range(5):
                flange = frames(self.rows, self.base, q)[-1][:3, :3]
                turn = 0.5 * sum(np.cross(flange[:, k], axes[:, k]) for k in range(3))
                spin = self.moves(q, lambda at: frames(self.rows, self.base, at)[-1][:3, :3])
                about = 0.5 * sum(np.cross(flange[:, k][None], spin[:, k].T) for k in range(3)).T
                both = np.vstack([self.jacobian(q), about]) * free
                q = q + free * (np.linalg.pinv(both) @ np.concatenate([place - self.point(q), turn]))
            found.append(q)
        return np.array(found)

    def columns(self, form, values):
        """Columns of values (m, n) in the units of files."""
        units = ["mm" if linear else "deg" for linear in self.linear]
        sizes = np.where(self.linear, 1e-3, np.pi / 180)
        return {form.format(i + 1, unit): values[:, i] / sizes[i] for i, unit in enumerate(units)}

    def torques(self, values, form="tau{}_nm"):
        """Columns of the torques (m, n) of the joints that turn."""
        return {form.format(i + 1): values[:, i] for i in np.flatnonzero(~self.linear)}


def write(folder, name, *, commanded=True, profile=True, form="tau{}_nm", scale=1.0, drives=None, seed=0):
    """Write the batch of an arm; ``form`` and ``scale`` of its drive signals, ``drives`` of its cell."""
    arm, rng = AnyArm(name), np.random.default_rng(seed)
    folder.mkdir()
    start = START[name]
    tip = arm.point(start)
    corner = tip - [0.02, 0.0, 0.0]
    knots = np.linspace(0.0, LENGTH + 0.04, 29)
    nodes = arm.follow(start, np.outer(knots - 0.02, [1.0, 0, 0]))
    runs = []
    for number, share in enumerate((1.0, 0.6, 0.8), start=1):
        row = {"run": f"r{number}", "condition": f"c{share:g}", "replicate": 1, "order": number}
        row |= {"operation": "side", "direction": "up", "spindle_rpm": 6000, "feed_per_tooth_mm": 0.1}
        row |= {
            "axial_depth_mm": 10,
            "radial_depth_mm": share,
            "cut_length_mm": LENGTH * 1e3,
            "feed_direction_deg": 0,
        }
        for log in ("idle", "robot"):
            s = np.arange(0.0, knots[-1], FEED * PERIOD)
            q = CubicSpline(knots, nodes)(s)
            rate = np.gradient(q, PERIOD, axis=0)
            # The arc of contact is ahead of the tool's axis: it is whole where the axis meets the work.
            arc = np.sqrt(share * 1e-3 * (TOOL_DIAMETER - share * 1e-3))
            inside = np.clip((s - 0.02) / arc + 1, 0, 1) * np.clip((0.02 + LENGTH - s) / arc, 0, 1)
            at_knots = np.array([arm.weight(each) for each in nodes])
            torque = CubicSpline(knots, at_knots)(s) + 20 * np.tanh(rate / 1e-3) + 300 * rate
            if log == "robot":
                asked = np.array([-arm.jacobian(each).T @ (share * FORCE) for each in nodes])
                torque = torque + inside[:, None] * CubicSpline(knots, asked)(s)
            torque = torque + rng.normal(0, 0.5, torque.shape)
            table = {"t_s": np.arange(len(s)) * PERIOD}
            table |= arm.columns("q{}_set_{}", q) if commanded else {}
            table |= arm.columns("q{}_{}", np.round(q + 2e-6 * rng.normal(size=q.shape), 8))
            table |= arm.torques(torque / scale, form)
            file = f"{row['run']}-{log}.csv"
            pd.DataFrame(table).to_csv(folder / file, index=False)
            row[f"{log}_log"] = file
        if profile:
            x = np.arange(0.0, LENGTH - 0.001, 0.0001)
            middle = nodes[len(nodes) // 2]
            give = (arm.jacobian(middle) * arm.soft) @ arm.jacobian(middle).T @ (share * FORCE)
            pd.DataFrame({"x_mm": x * 1e3, "z_mm": -1e3 * give[1] + rng.normal(0, 5e-4, len(x))}).to_csv(
                folder / f"{row['run']}-wall.csv", index=False
            )
            row["profile"] = f"{row['run']}-wall.csv"
        runs.append(row)
    pd.DataFrame(runs).to_csv(folder / "runs.csv", index=False)
    loads, payload = [], []
    for pose in range(6):
        q = start + np.where(arm.linear, 0.2, 0.4) * rng.uniform(-1, 1, len(start)) * (pose > 0)
        place = {key: round(float(value[0]), 6) for key, value in arm.columns("q{}_{}", q[None]).items()}
        for axis in range(3):
            force = 400.0 * np.eye(3)[axis]
            moved = (arm.jacobian(q) * arm.soft) @ arm.jacobian(q).T @ force + rng.normal(0, 1e-6, 3)
            loads.append({"pose": f"p{pose}", "point": "tip", **place}
                         | dict(zip(("fx_n", "fy_n", "fz_n"), force, strict=True))
                         | dict(zip(("dx_mm", "dy_mm", "dz_mm"), 1e3 * moved, strict=True)))  # fmt: skip
        for loaded, mass in (("yes", LOAD), ("no", 0.0)):
            torque = arm.weight(q, mass) + rng.normal(0, 0.05, len(q))
            payload.append({"loaded": loaded, **place, **arm.torques(torque[None])})
    pd.DataFrame(loads).to_csv(folder / "loads.csv", index=False)
    pd.DataFrame(payload).map(lambda v: v if isinstance(v, str) else float(np.ravel(v)[0])).to_csv(
        folder / "payload.csv", index=False
    )
    cell = {
        "cell": name,
        "arm": {"dh": [list(row[1:]) for row in arm.rows], "joints": [row[0] for row in arm.rows]},
    }
    cell["arm"] |= {"base": {"rpy_deg": [0, 90, 0]}} if name == "rail" else {}
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell | ({"drives": drives} if drives else {})))
    batch = {"format": 1, "batch": folder.name, "title": "Any arm", "source": "simulated", "cell": name}
    batch |= {
        "tool": {"diameter_mm": TOOL_DIAMETER * 1e3, "teeth": 2, "helix_deg": 30},
        "tool_in_flange_mm": (TOOL * 1e3).tolist(),
    }
    batch |= {"work": {"material": "AA6061-T6", "size_mm": [LENGTH * 1e3, 50, 20]}}
    batch |= {"work_in_base": {"xyz_mm": (corner * 1e3 + [20, 0, 0]).tolist(), "rpy_deg": [0, 0, 0]}}
    batch |= {"instruments": {"robot_log": {"period_ms": PERIOD * 1e3}, "profiler": {"cutoff_mm": 8}}}
    (folder / "batch.yaml").write_text(yaml.safe_dump(batch))
    return arm
