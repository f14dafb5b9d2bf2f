"""Faults of hammer tests, FRFs and recorded telegrams."""

import numpy as np
from corpus_case import Case, channel, clipped, replaced


def cases():
    """Return the cases of hammer records, FRFs and RSI recordings."""
    return [*_hammer(), *_frf(), *_packets()]


def _hammer():
    file = "impacts/r2.csv"

    def case(fault, change, how, *says):
        return channel("hammer record", file, change, fault, how, *says)

    def double(table):
        hit = table["force_n"].to_numpy()
        return table.assign(force_n=hit + 0.6 * np.roll(hit, 60))

    def times(name, factor):
        return lambda t: t.assign(**{name: t[name] * factor})

    quiet = np.random.default_rng(6).normal(0.0, 0.1, 2048)
    return [
        case("a double hit", double, "flagged", "double hit", "left out"),
        case("no hit", lambda t: t.assign(force_n=quiet), "flagged", "no force pulse", "left out"),
        case("forces in kN", times("force_n", 1e-3), "refused", "force_n", "kN"),
        case("a dead hammer", lambda t: t.assign(force_n=0.0), "flagged", "hammer force stays at 0"),
        case("a dead accelerometer", lambda t: t.assign(response=0.0), "flagged", "response stays at 0"),
        case("a clipped accelerometer", clipped("response", 0.3), "flagged", "overloaded", "left out"),
        case(
            "one channel twice",
            lambda t: t.assign(response=t["force_n"]),
            "flagged",
            "force channel over again",
            "left out",
        ),
    ]


def _frf():
    file = "impacts/r2.csv"

    def case(fault, change, how, *says):
        return channel("FRF", file, change, fault, how, *says)

    def times(factor):
        return lambda t: t.assign(real=t["real"] * factor, imag=t["imag"] * factor)

    def npz(fault, change, *says):
        def apply(folder):
            with np.load(folder / "impacts/r2.npz") as archive:
                arrays = dict(archive)
            np.savez(folder / "impacts/r2.npz", **change(arrays))

        return Case("FRF", "npz", fault, apply, "refused", says)

    other = replaced("impacts.csv", "tip,1,1x,1x,2", "tip,1,5y,5y,2")
    return [
        case("conjugated", lambda t: t.assign(imag=-t["imag"]), "flagged", "conjugated", "left out"),
        case("mm/N", times(1e3), "flagged", "13.2 g", "response_unit"),
        case("µm/N", times(1e6), "refused", "real", "mm/N"),
        case(
            "frequencies in kHz",
            lambda t: t.assign(frequency_hz=t["frequency_hz"] / 1e3),
            "refused",
            "frequency_hz",
            "kHz",
        ),
        case(
            "a negative frequency",
            lambda t: t.assign(frequency_hz=t["frequency_hz"] - 50),
            "refused",
            "frequency_hz",
            "line 2",
        ),
        case("all nought", times(0.0), "flagged", "stays at 0", "left out"),
        case(
            "a coherence of percents",
            lambda t: t.assign(coherence=98.0),
            "refused",
            "coherence",
            "98",
            "0 to 1",
        ),
        npz("objects (pickled)", lambda a: {**a, "frf": np.array([{}] * 200, dtype=object)}, "NumPy archive"),
        npz("no frequencies", lambda a: {"frf": a["frf"]}, "freq_hz"),
        npz("one line too few", lambda a: {**a, "frf": a["frf"][1:]}, "frf", "shape", "expected"),
        npz("two dimensions", lambda a: {**a, "frf": np.stack([a["frf"]] * 2)}, "frf", "shape", "expected"),
        npz("text for numbers", lambda a: {**a, "freq_hz": np.array(["x"] * 200)}, "freq_hz", "expected"),
        Case(
            "FRF",
            "UFF 58",
            "other points than the table says",
            other,
            "refused",
            ("5y", "1x"),
            "impacts/r2.uff",
        ),
        Case(
            "FRF",
            "UFF 58b",
            "other points than the table says",
            other,
            "refused",
            ("5y", "1x"),
            "impacts/r2.uff",
        ),
    ]


def _packets():
    file = "robot_log/r2.rsi"

    def case(fault, change, how, *says):
        def apply(folder):
            lines = (folder / file).read_text().splitlines()
            (folder / file).write_text("\n".join(change(lines)) + "\n")

        return Case("robot_log", "RSI", fault, apply, how, says)

    def third(old, new):
        return lambda lines: [*lines[:2], lines[2].replace(old, new), *lines[3:]]

    def every(old, new):
        return lambda lines: [line.replace(old, new) for line in lines]

    return [
        case("a telegram twice", lambda rows: [*rows[:9], rows[8], *rows[9:]], "read"),
        case("a late telegram", lambda rows: [*rows[:5], rows[6], rows[5], *rows[7:]], "read"),
        case("lost telegrams", lambda rows: rows[:50] + rows[90:], "flagged", "gap", "40 samples"),
        case("a torn telegram", lambda rows: [*rows[:50], rows[50][:90], *rows[51:]], "flagged", "torn"),
        case("text in a number", third('A1="', 'A1="x'), "refused", "line 3", "expected a number"),
        case("no set-points", every("ASPos", "RSol"), "refused", "ASPos", "expected"),
        case("motor currents", every("GearTorque", "MACur"), "flagged", "MACur", "GearTorque"),
        case("no time stamps", every("IPOC", "Time"), "refused", "IPOC", "expected"),
        case("two starts", lambda rows: rows + rows, "refused", "IPOC"),
    ]
