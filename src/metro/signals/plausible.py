"""Is a recording in the unit that it should be, by range and extent? The answer is a problem in words, or "".

A wrong unit is a factor of a thousand, or of 57: limits lie where no measurement of milling does.
"""

from __future__ import annotations

import numpy as np

from metro.units import Array

MOST_OFF = 10.0  # between a declared rate and one by the time stamps: more is a unit, not a setting
CLOCKS = {"milliseconds": 1e3, "microseconds": 1e6, "minutes": 1 / 60}
SPECIFIC_N_MM2 = (20.0, 2e5)  # peak force over chip section: plastics … steel at the thinnest chips
ABOUT_KNOWN = (1 / 50, 500.0)  # of ktc where it is declared; thin chips are all edge force
HEIGHTS_MM = (1e-4, 5.0)  # peak to valley of a milled trace: finer than any roughness … coarser than any wave
WORKSPACE_MM = (10.0, 2e4)  # extent of a set of poses: a calibration over less, or of a larger arm, is none
STEEPEST_URAD = 2e4  # 20 µm on a millimetre, ten times the range of an autocollimator: no level reads that
TURN = 2.0 * np.pi
FOLLOWS_DEG = 5.0  # a joint that is further from its set-point is not the joint of that set-point
RECEPTANCE = 2e-5  # m/N, 50 N/mm: the middle line of a band is stiffer than that on any robot
# A structure may be softer, but not light without limit: above its modes an FRF is that of a mass, however
# soft it is. The smallest accelerometers have 0.2 g, and a hit moves one together with what it is glued to.
LIGHTEST_KG = 1e-3
# Measured tool tips have 0.13 to 0.48 kg, a beam of a metre 1.6 to 4.6 kg: soft and lighter is for a look.
LIGHT_KG = 0.1
HIT_OVER_NOISE = 20.0
KILONEWTON_HIT = 1.0  # N: no hammer's hit is softer
LOWEST_BAND_HZ = 5.0


def clock(time_s: Array, declared_hz: float | None) -> str:
    """Compare the rate of the stamps (n,), n ≥ 2, with the declared one."""
    return clock_of(float(np.median(np.diff(time_s))), declared_hz)


def clock_of(step: float, declared_hz: float | None) -> str:
    """Compare the rate of stamps that are a ``step`` (s) apart with the declared one."""
    if declared_hz is None:
        return ""
    ratio = step * declared_hz
    if 1 / MOST_OFF <= ratio <= MOST_OFF:
        return ""
    unit = next((name for name, factor in CLOCKS.items() if abs(ratio / factor - 1) < 0.05), "")
    hint = f"they seem to be in {unit}" if unit else "do they count samples?"
    fault = f"column t_s: stamps are {step:g} apart, expected {1 / declared_hz:g} s as batch.yaml declares"
    return f"{fault}: {hint}; export seconds"


def cutting_force(largest_n: float, chip_mm2: float, known_n_mm2: float | None) -> str:
    """Compare the largest force with the section of the chip, a_p f_z (NaN: not known)."""
    if not chip_mm2 > 0.0:
        return ""
    pressure = largest_n / chip_mm2
    low, high = SPECIFIC_N_MM2 if known_n_mm2 is None else (known_n_mm2 * share for share in ABOUT_KNOWN)
    if pressure == 0.0 or low <= pressure <= high:
        return ""
    unit = "kN" if pressure < low else "mN, or not to be calibrated"
    over = f"their peak over the chip's section (a_p f_z = {chip_mm2:g} mm2)"
    fault = f"columns fx_n, fy_n, fz_n: {over} is {pressure:.3g}"
    expected = f"expected {low:g} to {high:g} N/mm2: the forces seem to be in {unit}; export newtons"
    soft = " (a work as soft as that: declare coefficients.ktc_n_mm2)" if pressure < low else ""
    return f"{fault} N/mm2, {expected}, or mend their unit under files in batch.yaml{soft}"


def angles(names: list[str], values_deg: Array) -> str:
    """Check joint angles (n, k) in degrees: not in radians, and continuous."""
    most = float(np.abs(values_deg).max())
    if 0.0 < most <= TURN:
        fault = f"columns {names[0]} …: all angles lie within ±{most:.4g}"
        return f"{fault}: they seem to be in radians, expected degrees"
    jumps = np.diff(values_deg, axis=0)
    row, column = np.unravel_index(np.argmax(np.abs(jumps)), jumps.shape)
    jump = float(jumps[row, column])
    if abs(jump) <= 180.0:
        return ""
    why = "the encoder wraps" if abs(abs(jump) - 360.0) < 30.0 else "the counter lost its place"
    before, after = values_deg[row, column], values_deg[row + 1, column]
    fault = f"row {row + 2} of the log, column {names[column]}: jumps from {before:.5g} to {after:.5g}"
    return f"{fault}, expected a continuous angle: {why}; export it unwrapped"


def turns(names: list[str], values_deg: Array) -> str:
    """Check the unit of joint angles (m, k) in degrees."""
    most = float(np.abs(values_deg).max()) if names else TURN + 1.0
    if not 0.0 < most <= TURN:
        return ""
    fault = f"columns {names[0]} …: all angles lie within ±{most:.4g}"
    return f"{fault}: they seem to be in radians, expected degrees: state the unit under files in batch.yaml"


def positions(points_mm: Array, columns: str = "x_mm, y_mm, z_mm") -> str:
    """Check the unit of the positions (m, 3), or distances (m, 1), of measured poses in millimetres."""
    size, (low, high) = float(np.ptp(points_mm, axis=0).max()), WORKSPACE_MM
    if low <= size <= high:
        return ""
    unit = "metres" if size < low else "micrometres"
    fault = f"columns {columns}: the poses are within {size:.4g}, expected {low:g} to {high:g} mm"
    return f"{fault}: they seem to be in {unit}: state the unit under files in batch.yaml"


def following(set_deg: Array, actual_deg: Array) -> str:
    """Check that the joints (n, 6) are at their set angles."""
    off = np.median(np.abs(actual_deg - set_deg), axis=0)
    worst = int(np.argmax(off))
    if off[worst] <= FOLLOWS_DEG:
        return ""
    name = f"q{worst + 1}"
    fault = f"column {name}_deg: is {off[worst]:.4g}° from {name}_set_deg (median)"
    return f"{fault}, expected within {FOLLOWS_DEG:g}°: are the columns of one joint, and of one unit?"


def same_place(cut_deg: Array, idle_deg: Array) -> str:
    """Check that an idle run's set angles (n', 6) are where the cut's (n, 6) were."""
    low, high = cut_deg.min(axis=0) - FOLLOWS_DEG, cut_deg.max(axis=0) + FOLLOWS_DEG
    apart = (idle_deg.max(axis=0) < low) | (idle_deg.min(axis=0) > high)
    if not apart.any():
        return ""
    joint = int(np.argmax(apart))
    idle, cut = (f"{v[:, joint].min():.5g}° to {v[:, joint].max():.5g}°" for v in (idle_deg, cut_deg))
    fault = f"column q{joint + 1}_set_deg: the idle run moves from {idle}, the cut from {cut}"
    return f"{fault}, expected the same path: name the idle log of this run"


def trace(x_mm: Array, z_mm: Array, cut_mm: float | None) -> str:
    """Check length and heights (n,) of a stylus trace; ``cut_mm``: length of the cut or of the work."""
    length = float(np.ptp(x_mm))
    if cut_mm is not None and not 0.01 <= length / cut_mm <= 100.0:
        unit = "metres" if length < cut_mm else "micrometres"
        fault = f"column x_mm: the trace is {length:g} long, the cut {cut_mm:g} mm"
        return f"{fault}: it seems to be in {unit}, expected millimetres"
    height, (low, high) = float(np.ptp(z_mm)), HEIGHTS_MM
    if height == 0.0 or low <= height <= high:
        return ""
    unit = "metres" if height < low else "micrometres"
    fault = f"column z_mm: peak to valley is {height:.4g}, expected {low:g} to {high:g} mm"
    return f"{fault}: the heights seem to be in {unit}"


def slopes(feet_mm: Array, slope_urad: Array, line: np.ndarray) -> str:
    """Look at readings (n,) between the feet x1, y1, x2, y2 (n, 4): each a step of a flat surface."""
    step = np.hypot(feet_mm[:, 2] - feet_mm[:, 0], feet_mm[:, 3] - feet_mm[:, 1])
    if not step.all():
        at = int(np.argmin(step)) + 1
        return f"reading {at}: starts and ends at the same place, expected two feet at a distance"
    for number in np.unique(line):
        values = slope_urad[line == number]
        off = np.abs(values - np.median(values))
        if off.max() > STEEPEST_URAD:
            at = int(np.flatnonzero(line == number)[off.argmax()]) + 1
            return (
                f"column slope_urad: reading {at} differs by {off.max():.3g} µrad from the median of its "
                f"line, expected less than {STEEPEST_URAD:g} of a flat surface: state the unit under files "
                "in batch.yaml (um/m, arcsec, mrad …)"
            )
    return ""


def tip_path(points_mm: Array, size_mm: Array) -> str:
    """Check that a path (n, 3) passes a work of sides ``size_mm`` (3,), a corner of which is the origin."""
    span = float(np.ptp(points_mm[:, :2], axis=0).max())
    side = float(max(size_mm[:2]))
    if span == 0.0:
        return "columns x_mm, y_mm: all points are one place, expected a path"
    if not 0.02 <= span / side <= 50.0:
        unit = "metres" if span < side else "micrometres"
        fault = f"columns x_mm, y_mm: the path spans {span:g}, the work {side:g} mm"
        return f"{fault}: it seems to be in {unit}, expected millimetres"
    return beside(points_mm, size_mm, "is the path in the frame of the work (work_in_base in batch.yaml)?")


def beside(points_mm: Array, size_mm: Array, hint: str) -> str:
    """Describe where points (n, 3) of the work frame lie when none of them is near the work."""
    for axis, name in enumerate(("x_mm", "y_mm")):
        low, high = float(points_mm[:, axis].min()), float(points_mm[:, axis].max())
        margin = float(max(size_mm))
        if high < -margin or low > float(size_mm[axis]) + margin:
            fault, due = f"found {low:.5g} to {high:.5g}", f"0 to {size_mm[axis]:g} mm"
            return f"column {name}: {fault}, expected {due}, where the work is: {hint}"
    return ""


def hammer_force(force_n: Array) -> str:
    """Check that a hammer's hit (n,) is in newtons; a record without a hit cannot be checked."""
    peak, noise = float(np.abs(force_n).max()), float(np.median(np.abs(force_n)))
    if peak >= KILONEWTON_HIT or peak <= HIT_OVER_NOISE * noise:
        return ""
    fault = f"column force_n: the hit peaks at {peak:.3g} N, expected {KILONEWTON_HIT:g} N or more"
    return f"{fault}: the force seems to be in kN; export newtons"


def frf(frequency_hz: Array, values: np.ndarray) -> str:
    """Check the band and the size of a receptance (n,), m/N: soft and light at once, it has another unit.

    The stiffness alone does not show it: a soft structure in m/N is as stiff as a hard one in mm/N.
    """
    top = float(frequency_hz.max())
    if top < LOWEST_BAND_HZ:
        fault = f"column frequency_hz: ends at {top:g}, expected {LOWEST_BAND_HZ:g} Hz or more"
        return f"{fault}: frequencies seem to be in kHz"
    typical, mass = softness(frequency_hz, values)
    if typical <= RECEPTANCE or mass >= LIGHTEST_KG:
        return ""
    fault = (
        f"columns real, imag: the receptance is {typical:.3g} m/N (median) of a mass of {1e3 * mass:.2g} g"
    )
    expected = f"expected at most {RECEPTANCE:g} m/N, or {1e3 * LIGHTEST_KG:g} g or more"
    return f"{fault}, {expected}: it seems to be in mm/N or µm/N, or response_unit of impacts.csv is another"


def softness(frequency_hz: Array, values: np.ndarray) -> tuple[float, float]:
    """Return the size of a receptance (n,), m/N, and the mass that it would be of, kg: medians over the band.

    Medians: the lowest lines of an integrated acceleration may be of any size, and a mode's peak is no mass.
    """
    size, inertance = np.abs(values), (TURN * frequency_hz) ** 2 * np.abs(values)
    typical = float(np.median(inertance))
    return float(np.median(size)), 1.0 / typical if typical > 0.0 else np.inf
