"""What the instruments of a sound little batch read: every kind of recording, in closed form."""

import numpy as np
import pandas as pd

AXES = range(1, 7)


def force(run=1):
    """Four teeth at 6000 rpm through 1 mm × 0.05 mm, air before and after; the spindle's angle with it."""
    t = np.arange(1200) * 1e-3 + 2e-4 * run
    cut = np.where((t > 0.2) & (t < 1.0), 1.0, 0.0)
    noise = np.random.default_rng(run).normal(0.0, 0.5, (3, len(t)))
    turn = 2 * np.pi * 100.0 * t
    waves = [np.sin(turn) + np.cos(4 * turn), np.cos(turn) - np.sin(4 * turn), np.sin(4 * turn + 1.0)]
    forces = [
        cut * (mean + 40 * wave) + rest for mean, wave, rest in zip((60, 80, 30), waves, noise, strict=True)
    ]
    return pd.DataFrame(dict(zip(("t_s", "fx_n", "fy_n", "fz_n"), (t, *forces), strict=True))).round(6)


def robot(run=1, shift_deg=0.0):
    """Six joints along a straight feed, torques of gravity, friction and noise; log of 4 ms."""
    t = 1000.0 + np.arange(300) * 4e-3
    noise = np.random.default_rng(100 + run).normal(0.0, 0.5, (6, len(t)))
    table = {"t_s": t}
    for i in AXES:
        table[f"q{i}_set_deg"] = (-20.0 * (-1) ** i + 5 * i + shift_deg) + 0.8 * i * np.linspace(0, 1, len(t))
    for i in AXES:
        table[f"q{i}_deg"] = table[f"q{i}_set_deg"] + 2e-3 * np.sin(np.linspace(0, 9, len(t)) + i)
    for i in AXES:
        table[f"tau{i}_nm"] = 900.0 / i + 20 * np.sin(np.linspace(0, 6, len(t)) + i) + noise[i - 1]
    return pd.DataFrame(table).round(6)


def path():
    """Two passes of the tip across the face of 60 mm × 40 mm."""
    x = np.linspace(0.0, 60.0, 20)
    passes = [
        (i, k, a, 10.0 + 20.0 * (k - 1), 0.0) for k in (1, 2) for i, a in enumerate(x, 1 + 20 * (k - 1))
    ]
    return pd.DataFrame(passes, columns=["point", "pass", "x_mm", "y_mm", "z_mm"])


def profile(run=1):
    """A stylus trace of 60 mm: a slope, waves, roughness."""
    x = np.arange(600) * 0.1
    z = 1e-4 * x + 5e-3 * np.sin(x / 2) + np.random.default_rng(500 + run).normal(0, 5e-4, len(x))
    return pd.DataFrame({"x_mm": x, "z_mm": z}).round(6)


def cloud(run=1):
    """A face of 60 mm × 40 mm, a point every 2 mm, bowed by some hundredths."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(0, 60.1, 2), np.arange(0, 40.1, 2)))
    z = 0.02 * (x / 60) ** 2 + np.random.default_rng(200 + run).normal(0, 5e-3, len(x))
    return pd.DataFrame({"x_mm": x, "y_mm": y, "z_mm": z}).round(4)


def frf():
    """Receptance (m/N) of one mode: 60 Hz, 3 %, 2 N/µm; lines of 2 Hz."""
    f = np.arange(2.0, 402.0, 2.0)
    r = f / 60.0
    h = 5e-7 / (1 - r**2 + 0.06j * r)
    return pd.DataFrame({"frequency_hz": f, "real": h.real, "imag": h.imag})


def record(number=1):
    """A hammer's hit of 500 N and 2 ms, and the acceleration (m/s2) of the mode of `frf`."""
    t = np.arange(2048) / 2048.0
    hit = np.where(abs(t - 0.05) < 1e-3, 500 * np.cos(np.pi * (t - 0.05) / 2e-3), 0.0)
    wn, zeta, stiffness = 2 * np.pi * 60.0, 0.03, 2e6
    wd = wn * np.sqrt(1 - zeta**2)
    impulse = np.exp(-zeta * wn * t) * np.sin(wd * t) * wn**2 / (stiffness * wd)
    moved = np.convolve(hit, impulse)[: len(t)] / 2048.0
    answer = np.gradient(np.gradient(moved, t), t) + np.random.default_rng(700 + number).normal(
        0, 0.02, len(t)
    )
    force_n = hit + np.random.default_rng(800 + number).normal(0, 0.1, len(t))
    return pd.DataFrame({"t_s": t, "force_n": force_n, "response": answer})
