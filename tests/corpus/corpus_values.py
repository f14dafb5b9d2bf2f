"""Faults of what instruments read: clocks, units, channels, clouds, hits and FRFs."""

import numpy as np
from corpus_case import Case, channel, clipped, replaced, tabled


def cases():
    """Return the cases of every kind of recording."""
    found = [case for kind, file, t in CLOCKED for case in _clock(kind, file, t)]
    return [
        *found,
        *_dynamometer(),
        *_robot(),
        *_path(),
        *_profile(),
        *_scan(),
    ]


CLOCKED = (
    ("dynamometer", "dynamometer/r2.csv", "t_s"),
    ("robot_log", "robot_log/r2.csv", "t_s"),
    ("idle_log", "idle_log/r2.csv", "t_s"),
    ("hammer record", "impacts/r2.csv", "t_s"),
    ("FRF", "impacts/r2.csv", "frequency_hz"),
    ("profile", "profile/r2.csv", "x_mm"),
)


def _clock(kind, file, time):
    def case(fault, change, how="refused", says=()):
        return Case(kind, "CSV", fault, tabled(file, change), how, tuple(says))

    def repeated(table):
        table.loc[50, time] = table.loc[49, time]

    def backwards(table):
        table.loc[50, time] = table.loc[40, time]

    def restarted(table):
        table.loc[100:, time] -= table.loc[100, time] - table.loc[0, time]

    found = [
        case("a stamp twice", repeated, says=("line 52", time, "larger value")),
        case("a stamp that falls", backwards, says=("line 52", time, "larger value")),
        case("two recordings in one", restarted, says=("line 102", time, "larger value")),
        case("rows upside down", lambda t: t[::-1], says=("line 3", time, "larger value")),
        case("five rows", lambda t: t[:5], says=("found 5 rows", "expected at least 8")),
        case("one row", lambda t: t[:1], says=("found 1 rows", "expected at least 8")),
    ]
    if time != "frequency_hz":
        found.append(case("a gap", lambda t: t.drop(index=range(80, 120)), "flagged", ("gap", "40 samples")))
    if time == "t_s":
        step = {"hammer record": 1 / 2048, "dynamometer": 1e-3}.get(kind, 4e-3)
        random = np.random.default_rng(9)

        def jitter(table):
            table[time] += random.uniform(-0.4, 0.4, len(table)) * step

        def scaled(factor):
            return lambda table: table.assign(t_s=table[time] * factor)

        found += [
            case("a jittering clock", jitter, "flagged", ("scatter", "late")),
            case("milliseconds", scaled(1e3), says=("t_s", "milliseconds", "expected")),
            case("microseconds", scaled(1e6), says=("t_s", "microseconds", "expected")),
            case("another rate than declared", lambda t: t[::2], "flagged", ("declared", "Hz")),
            case(
                "numbers of samples for time",
                lambda t: t.assign(t_s=np.arange(len(t))),
                says=("t_s", "expected"),
            ),
        ]
    return found


def _dynamometer():
    file = "dynamometer/r2.csv"

    def case(fault, change, how, *says):
        return channel("dynamometer", file, change, fault, how, *says)

    force = ["fx_n", "fy_n", "fz_n"]

    def times(factor):
        return lambda t: t.assign(**{name: t[name] * factor for name in force})

    def flat(table):
        table.loc[300:340, "fx_n"] = 5000.0

    def copied(folder):
        (folder / file).write_bytes((folder / "dynamometer/r1.csv").read_bytes())

    def two(table):
        return table.rename(columns={"t_s": "fx_n", "fx_n": "t_s"})

    return [
        case("forces in kN", times(1e-3), "refused", "fx_n", "kN", "expected"),
        case("forces in µN", times(1e6), "refused", "fx_n", "expected"),
        case("a dead channel", lambda t: t.assign(fz_n=0.0), "flagged", "Fz stays at 0", "left out"),
        case("a stuck channel", lambda t: t.assign(fy_n=-4999.0), "flagged", "Fy stays at -4999", "left out"),
        case("a clipped channel", clipped("fx_n", 0.2), "flagged", "Fx stays at", "range", "left out"),
        case("a channel at full scale", flat, "flagged", "Fx stays at 5000", "range", "left out"),
        case("a channel twice", lambda t: t.assign(fy_n=t["fx_n"]), "flagged", "Fx and Fy", "left out"),
        case(
            "a channel twice, turned round",
            lambda t: t.assign(fy_n=-t["fx_n"]),
            "flagged",
            "Fx and Fy",
            "left out",
        ),
        case("all channels dead", lambda t: t.assign(**dict.fromkeys(force, 0.0)), "flagged", "left out"),
        case("an offset in air", lambda t: t.assign(fx_n=t["fx_n"] + 50), "flagged", "Fx reads", "air"),
        case("time and force exchanged", two, "refused", "t_s", "larger value"),
        Case(
            "dynamometer",
            "CSV",
            "the recording of another run, copied",
            copied,
            "refused",
            ("r1.csv", "same content"),
        ),
    ]


def _robot():
    file = "robot_log/r2.csv"

    def case(fault, change, how, *says):
        return channel("robot_log", file, change, fault, how, *says)

    names = [f"q{i}{part}_deg" for i in range(1, 7) for part in ("", "_set")]

    def radians(table):
        return table.assign(**{name: np.radians(table[name]) for name in names})

    def wrapped(table):
        middle = table["q6_deg"].median()
        return table.assign(q6_deg=(table["q6_deg"] - middle) % 360.0 - 180.0)

    def still(table):
        return table.assign(**{name: table[name].iloc[0] for name in names})

    def jump(table):
        table.loc[150:, "q3_deg"] += 400.0

    def actual(table):
        return table.assign(q3_deg=table["q3_deg"] + 30.0)

    shifted = tabled("idle_log/r2.csv", lambda t: t.assign(**{n: t[n] + 25.0 for n in names}))
    idle_radians = tabled("idle_log/r2.csv", radians)
    place = ("idle_log/r2.csv", "q1_set_deg", "the same path")
    return [
        case("angles in radians", radians, "refused", "q1_set_deg", "radians", "expected degrees"),
        case("an encoder that wraps", wrapped, "refused", "q6_deg", "wraps", "expected"),
        case("an encoder that jumps", jump, "refused", "q3_deg", "jumps", "expected"),
        case("angles that are not those commanded", actual, "refused", "q3_deg", "q3_set_deg", "expected"),
        case("an arm that does not move", still, "flagged", "no joint moves", "left out"),
        case("a dead torque", lambda t: t.assign(tau2_nm=0.0), "flagged", "tau2_nm stays at 0", "left out"),
        case(
            "a torque twice",
            lambda t: t.assign(tau3_nm=t["tau2_nm"]),
            "flagged",
            "tau2_nm and tau3_nm",
            "left out",
        ),
        case("a clipped torque", clipped("tau1_nm", 0.985), "flagged", "tau1_nm stays at", "left out"),
        Case("idle_log", "CSV", "another path", shifted, "refused", place),
        Case("idle_log", "CSV", "angles in radians", idle_radians, "refused", ("q1_set_deg", "radians")),
        Case(
            "idle_log",
            "CSV",
            "the cut's own log",
            replaced("runs.csv", "idle_log/r2.csv", "robot_log/r2.csv"),
            "refused",
            ("robot_log/r2.csv", "row 3", "idle_log"),
            "runs.csv",
        ),
    ]


def _path():
    file = "path/r2.csv"

    def case(fault, change, how, *says):
        return channel("path", file, change, fault, how, *says)

    def times(factor):
        return lambda t: t.assign(**{name: t[name] * factor for name in ("x_mm", "y_mm", "z_mm")})

    return [
        case("in metres", times(1e-3), "refused", "metres", "expected millimetres"),
        case("in micrometres", times(1e3), "refused", "micrometres", "expected millimetres"),
        case(
            "in the frame of the robot", lambda t: t.assign(x_mm=t["x_mm"] + 1200), "refused", "x_mm", "work"
        ),
        case("one point", lambda t: t[:1], "refused", "found 1 rows", "expected at least 2"),
        case("one place", lambda t: t.assign(x_mm=1.0, y_mm=1.0), "refused", "x_mm", "expected"),
        case("half a pass", lambda t: t.assign(**{"pass": 1.5}), "refused", "line 2", "pass", "whole number"),
    ]


def _profile():
    file = "profile/r2.csv"

    def case(fault, change, how, *says):
        return channel("profile", file, change, fault, how, *says)

    return [
        case("a length in metres", lambda t: t.assign(x_mm=t["x_mm"] / 1e3), "refused", "x_mm", "metres"),
        case(
            "a length in micrometres",
            lambda t: t.assign(x_mm=t["x_mm"] * 1e3),
            "refused",
            "x_mm",
            "micrometres",
        ),
        case(
            "heights in micrometres",
            lambda t: t.assign(z_mm=t["z_mm"] * 1e3),
            "refused",
            "z_mm",
            "micrometres",
        ),
        case("heights in metres", lambda t: t.assign(z_mm=t["z_mm"] * 1e-3), "refused", "z_mm", "metres"),
        case("a dead stylus", lambda t: t.assign(z_mm=0.5), "flagged", "z stays at 0.5", "left out"),
        case("a stylus at its stop", clipped("z_mm", 0.6), "flagged", "z stays at", "left out"),
        case("the length for the height", lambda t: t.assign(z_mm=t["x_mm"]), "refused", "z_mm", "expected"),
    ]


def _cloud(change, seed=4):
    def apply(folder):
        file = folder / "scan/r2.xyz"
        points = change(np.loadtxt(file), np.random.default_rng(seed))
        np.savetxt(file, points, "%.4f")

    return apply


def _outliers(points, random):
    return np.vstack([points, random.uniform(-5000, 5000, (20 * len(points), 3))])


def _scan():
    def case(fault, change, how, *says):
        return Case("scan", "XYZ", fault, _cloud(change), how, says)

    scale = np.array([[2.0, 2.0, 1.0]])
    return [
        case("one point", lambda p, _: p[:1], "refused", "found 1", "expected at least 3"),
        case("two points", lambda p, _: p[:2], "refused", "found 2", "expected at least 3"),
        case("one point many times", lambda p, _: np.tile(p[:1], (500, 1)), "refused", "expected"),
        case("collinear points", lambda p, _: p[:31] * [1, 0, 1], "refused", "expected"),
        case("all NaN", lambda p, _: p * np.nan, "refused", "found 0", "expected at least"),
        case(
            "most NaN",
            lambda p, r: np.where(r.random((len(p), 1)) < 0.7, np.nan, p),
            "flagged",
            "without coordinates",
        ),
        case("infinite points alone", lambda p, _: p + np.inf, "refused", "expected"),
        case("metres", lambda p, _: p / 1e3, "refused", "metres", "expected millimetres"),
        case("inches", lambda p, _: p / 25.4, "refused", "inches", "expected millimetres"),
        case("centimetres", lambda p, _: p / 10, "refused", "centimetres", "expected millimetres"),
        case("micrometres", lambda p, _: p * 1e3, "refused", "micrometres", "expected millimetres"),
        case("another part", lambda p, _: p * scale, "refused", "another part", "extent_margin"),
        case("a quarter of the face", lambda p, _: p[(p[:, 0] < 30) & (p[:, 1] < 20)], "refused", "expected"),
        case("twenty outliers for each point", _outliers, "refused", "expected"),
        case(
            "in the frame of the scanner",
            lambda p, _: p + np.array([900, 0, 0]),
            "refused",
            "x_mm",
            "to_work",
        ),
        case("a side face", lambda p, _: p[:, [2, 0, 1]], "refused", "expected"),
    ]
