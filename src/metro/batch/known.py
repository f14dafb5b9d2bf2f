"""known: the parameters of the effects that a manifest declares, by the names that their models go by."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from metro.batch.documents import without_comma
from metro.batch.findings import Finding, Severity, shown, suggestion
from metro.units import JSON

# Effect → its forms, each with all the parameters that it needs: those of the library of effects, which this
# package does not import.
FORMS: dict[str, tuple[tuple[str, ...], ...]] = {
    "charge_drift": (("slope_n_s",), ("time_constant_s",)),
    "chip_size_effect": (("exponent",),),
    "clock_offset": (("offset_ms",),),
    "dynamometer_resonance": (("frequency_hz", "damping"),),
    "dynamometer_rotation": (("angle_deg",),),
    "entry_transient": (("amplitude_um", "length_mm"),),
    "fixture_bow": (("xx_um", "xy_um", "yy_um"),),
    "flange_rotation": (("share",),),
    "friction_reversal": (("joint", "torque_nm"),),
    "friction_warmup": (("joint", "slope_nm_s"),),
    "gear_ripple": (("joint", "order", "torque_nm", "phase_deg"),),
    "joint_backlash": (("joint", "angle_mdeg"),),
    "missing_mode": (("frequency_hz", "damping", "stiffness_n_um", "axis"),),
    "mode_coupling": (("angle_deg",),),
    "orbit_stiffness": (("amplitude", "phase_deg"),),
    "path_vibration": (("frequency_hz", "amplitude_um"), ("frequency_hz", "amplitude_um", "phase_deg")),
    "payload_error": (("mass_kg", "com_mm"),),
    "pitch_error": (("pitch_deg",),),
    "process_damping": (("coefficient_n_mm",),),
    "spindle_speed_softening": (("change_per_krpm",),),
    "spindle_tilt": (("about_x_mrad", "about_y_mrad"),),
    "stiffness_hardening": (("joint", "cubic"),),
    "stiffness_scale": (("factor",), ("factor", "joint")),
    "thermal_growth": (("um_per_min",),),
    "tool_deflection": (("kx_n_um", "ky_n_um"),),
    "tool_offset_error": (("dx_mm", "dy_mm", "dz_mm"),),
    "tool_runout": (("radius_um", "angle_deg"),),
    "tool_wear": (("edge_growth_per_m",),),
}
# The contract says in words what these are told by: a name of another program's is not a misspelt one.
UNNAMED = {"entry_transient", "flange_rotation", "spindle_speed_softening"}
JOINTS = (1, 2, 3, 4, 5, 6, "all")


def known_findings(known: JSON, file: str) -> Iterator[Finding]:
    """Check what is declared of each effect: the names of its parameters, and their values.

    A name too many is a warning, since fields may be added; one that stands where a parameter is missing is
    an error.

    Parameters
    ----------
    known : effect → parameter → value.
    file : the manifest's name in messages.
    """
    for effect, values in known.items():
        forms = FORMS.get(effect, ())
        names = list(dict.fromkeys(name for form in forms for name in form))
        whole = any(set(form) <= set(values) for form in forms)
        strange = [name for name in values if name not in names] if forms else []
        expected = f"expected {' or '.join(', '.join(form) for form in forms)}"
        for name in strange:
            severity: Severity = "warning" if whole or effect in UNNAMED else "error"
            message = f"is not a parameter of {effect}{suggestion(name, names)}, {expected}"
            yield Finding(severity, file, message, column=f"known.{effect}.{name}")
        if forms and not whole and (not strange or effect in UNNAMED):
            missing = ", ".join(name for name in forms[0] if name not in values)
            message = f"lacks {missing}, {expected}: else the base model is not told of it"
            yield Finding("warning", file, message, column=f"known.{effect}")
        for name in (name for name in names if name in values):
            if fault := _fault(name, values[name]):
                yield Finding("error", file, fault, column=f"known.{effect}.{name}")


def _fault(name: str, value: Any) -> str | None:
    """Say what is wrong with the value of a parameter."""
    if name == "joint":
        expected = "" if value in JOINTS and not isinstance(value, bool) else "a joint, 1 to 6, or all"
    elif name == "axis":
        expected = "" if value in ("x", "y") else "x or y"
    else:
        entries = value if isinstance(value, list) else [value]
        sound = entries and all(isinstance(e, int | float) and not isinstance(e, bool) for e in entries)
        expected = "" if sound else f"a number, or a list of them{without_comma(value)}"
    return f"found {shown(value)}, expected {expected}" if expected else None
