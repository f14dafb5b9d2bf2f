"""Every effect of the library, put twice on a model: the second adds to the first and never replaces it."""

import math
from functools import cache
from types import SimpleNamespace

import elastic_arm
import face_batch
import numpy as np
import pytest
import wavy

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.helical import Helix
from metro.cutting.law import EdgeLaw
from metro.dynamics.stability_model import StabilityModel
from metro.dynamics.system import Cut as StabilityCut
from metro.dynamics.system import Structure
from metro.effects.library import library
from metro.observables.force.dynamometer import Recording, transfer
from metro.observables.force.model import ForceModel, ForceSetting
from metro.observables.joint_force.model import JointForceModel, TorqueRun, running

COEFFICIENTS = np.array([8e8, 3e8, 2e8, 2e4, 2e4, 5e3])
HIGHEST, MIDDLES = 12, (0.5, 1.5)
RPM = np.array([2400.0, 4800.0])


def force(model):
    """Order coefficients of a side cut by an arm that gives way, and of a hole that is milled helically."""
    side = Cut(0.1e-3, 3e-3, Engagement(0.0, 1.2))
    hole = Cut(0.05e-3, 2e-3, Engagement(0.0, math.pi))
    settings = [
        ForceSetting(side, 0.3, HIGHEST, Recording(MIDDLES, 1.0, 50.0, 0.0, 0.1, 0.2), 2.0, give=0.2e-3),
        ForceSetting(
            hole, 0.0, HIGHEST, Recording(MIDDLES, 1.0, 50.0, 0.9, 0.1, 0.2), 1.0, Helix(4e-3, 1e-3, 1e-5)
        ),
    ]
    orders = 2 * HIGHEST + 1
    means = np.tile(np.kron(np.eye(3), np.eye(orders)[:, :1]), (len(MIDDLES), 1))
    found = []
    for setting, nuisance in zip(settings, ([0.4], [0.4, 0.7]), strict=True):
        block = SimpleNamespace(setting=setting, zeros=means)
        matrix, offset = model.design(block, np.array(nuisance), COEFFICIENTS)
        found.append(matrix @ COEFFICIENTS + offset)
    return np.concatenate(found)


def joint_force(model):
    """Torques of an arm whose joints all turn, some of them round."""
    t = np.linspace(0.0, 3.0, 90)
    q = 0.3 + np.outer(np.sin(t), [0.2, -0.3, 0.25, 0.4, -0.2, 0.3]) + np.outer(t, [0.01] * 6)
    log = running(t, np.outer(np.sin(2.0 * t), [100.0, 150.0, 40.0]))
    run = TorqueRun(q, np.gradient(q, t, axis=0), t, t, np.full(90, t[1]), log, np.zeros((90, 6)))
    matrix, offset = model.design(SimpleNamespace(setting=run), np.zeros(0))
    return matrix[:, 0] + offset


def deformation(model):
    rng = np.random.default_rng(1)
    block = elastic_arm.cut(3, "identify", (0, 0, "down"), 1.0, truth={}, rng=rng)
    compliance = 1.0 / elastic_arm.STIFFNESS
    matrix, offset = model.design(block, np.zeros(0), compliance)
    return matrix @ compliance + offset


def waviness(model):
    found = []
    for path in (0, 1):
        matrix, offset = model.design(SimpleNamespace(setting=wavy.cut(path, 0.01)[0]), np.zeros(0))
        found.append(matrix[:, 0] + offset)
    return np.concatenate(found)


@cache
def faces():
    return face_batch.problem()


def flatness(model):
    """One face, the phases of whatever swings all the same."""
    block = faces().role("identify")[0]
    matrix, offset = model.design(block, np.array([0.3, 0.3]))
    return matrix @ np.full(matrix.shape[1], 1e-7) + offset


def lobes(model):
    return model.boundary(RPM)[0]


def model_of(observable):
    if observable == "flatness":
        return faces().base
    modes = Structure(
        np.array([0, 1]), 2 * np.pi * np.array([310.0, 390.0]), np.array([0.03, 0.04]), np.array([9e6, 7e6])
    )
    return {
        "force": lambda: ForceModel(Cutter(6e-3, 0.5, evenly_pitched(3)), EdgeLaw()),
        "joint_force": lambda: JointForceModel(elastic_arm.ARM),
        "deformation": lambda: elastic_arm.DeformationModel(elastic_arm.ARM),
        "waviness": lambda: wavy.WavinessModel(tuple(range(6))),
        "lobes": lambda: StabilityModel(modes, (StabilityCut(3, 1.7, np.pi, 8e8, 3e8),), 0.006),
    }[observable]()


PREDICTED = {
    "force": force,
    "joint_force": joint_force,
    "deformation": deformation,
    "waviness": waviness,
    "flatness": flatness,
    "lobes": lobes,
}


def added(a, b):
    return {name: np.add(a[name], b[name]).tolist() for name in a}


def multiplied(a, b):
    return {name: a[name] * b[name] for name in a}


def reciprocal(a, b):
    """Times of decay and stiffnesses in series: their reciprocals add up."""
    return {name: (1.0 / (1.0 / np.array(a[name]) + 1.0 / np.array(b[name]))).tolist() for name in a}


def phasor(size, angle):
    """Return what adds the vectors that two parameters are; all other parameters are the same in both."""

    def composed(a, b):
        total = sum(one[size] * np.exp(1j * math.radians(one[angle])) for one in (a, b))
        return {**a, size: abs(total), angle: math.degrees(np.angle(total))}

    return composed


def only(name, how=added):
    """Return what composes one parameter; all others are the same in both."""
    return lambda a, b: {**a, **how({name: a[name]}, {name: b[name]})}


def ripples(a, b):
    """Vectors of torque at the order and at twice it; order and mode are the same in both."""
    doubled = only("double_sine_nm")(only("double_cosine_nm")(a, b), b)
    return phasor("torque_nm", "phase_deg")(a, b) | {
        name: doubled[name] for name in doubled if "double" in name
    }


AMPLIFIED = {"order": 60.0, "mode_hz": 9.0, "mode_damping": 0.07}


def masses(a, b):
    mass = a["mass_kg"] + b["mass_kg"]
    moment = sum(one["mass_kg"] * np.array(one["com_mm"]) for one in (a, b))
    return {"mass_kg": mass, "com_mm": (moment / mass).tolist()}


# Effect → values of the first, of the second, and how both together are one; None: no values of one are.
COMPOSED = {
    "tool_end": ({"corner_radius_mm": 0.5}, {"corner_radius_mm": 0.7}, added),
    "charge_drift slope": ({"slope_n_s": [3.0, -2.0, 1.0]}, {"slope_n_s": [1.0, 4.0, 2.0]}, added),
    "charge_drift discharge": (
        {"time_constant_s": [2.0, 3.0, 5.0]},
        {"time_constant_s": [4.0, 1.0, 8.0]},
        reciprocal,
    ),
    "amplifier_filter": ({"corner_hz": 900.0, "order": 2.0}, {"corner_hz": 1500.0, "order": 3.0}, None),
    "chip_size_effect": ({"exponent": 0.1}, {"exponent": 0.25}, added),
    "chipped_tooth": (
        {"tooth": 1, "length_um": 20.0, "height_mm": 1.5},
        {"tooth": 1, "length_um": 15.0, "height_mm": 1.5},
        only("length_um"),
    ),
    "clock_offset": ({"offset_ms": 40.0}, {"offset_ms": -70.0}, added),
    "cubic_form": (
        {"uuu_um": 5.0, "uuv_um": -3.0, "uvv_um": 2.0, "vvv_um": 1.0},
        {"uuu_um": 2.0, "uuv_um": 4.0, "uvv_um": -6.0, "vvv_um": 3.0},
        added,
    ),
    "entry_exit_force": ({"tangential": 0.2, "radial": -0.1}, {"tangential": 0.1, "radial": 0.3}, added),
    "depth_yielding": ({"growth_per_mm": 0.1}, {"growth_per_mm": 0.05}, added),
    "dynamometer_crosstalk": (
        {
            "x_in_z_percent": 1.0,
            "y_in_z_percent": -2.0,
            "z_in_x_percent": 0.5,
            "z_in_y_percent": 3.0,
            "x_and_y_percent": -1.0,
            "y_gain_percent": 1.5,
        },
        {
            "x_in_z_percent": 0.5,
            "y_in_z_percent": 1.0,
            "z_in_x_percent": -2.0,
            "z_in_y_percent": 0.3,
            "x_and_y_percent": 2.0,
            "y_gain_percent": -1.0,
        },
        added,
    ),
    "dynamometer_resonance": (
        {"frequency_hz": [900.0, 1000.0, 1500.0], "damping": [0.03, 0.04, 0.05]},
        {"frequency_hz": [700.0, 1300.0, 1100.0], "damping": [0.05, 0.03, 0.02]},
        None,
    ),
    "dynamometer_rotation": ({"angle_deg": 3.0}, {"angle_deg": -5.0}, added),
    "entry_transient": (
        {"amplitude_um": 12.0, "length_mm": 15.0, "exit_um": -9.0},
        {"amplitude_um": -30.0, "length_mm": 15.0, "exit_um": 20.0},
        lambda a, b: only("amplitude_um")(only("exit_um")(a, b), b),
    ),
    "entry_transient with the force": (
        {"amplitude_um": 12.0, "length_mm": 15.0},
        {"amplitude_um": -30.0, "length_mm": 15.0},
        only("amplitude_um"),
    ),
    "fixture_bow": (
        {"xx_um": 5.0, "xy_um": -3.0, "yy_um": 2.0},
        {"xx_um": 1.0, "xy_um": 7.0, "yy_um": -4.0},
        added,
    ),
    "flange_rotation": ({"share": 0.2}, {"share": 0.3}, added),
    "friction_by_speed": ({"torque_nm_s": 200.0}, {"torque_nm_s": -500.0}, added),
    "friction_reversal": (
        {"torque_nm": 10.0, "presliding_mrad": 0.3},
        {"torque_nm": -25.0, "presliding_mrad": 0.3},
        only("torque_nm"),
    ),
    "friction_warmup": ({"slope_nm_s": 0.5}, {"slope_nm_s": 0.9}, added),
    "gear_ripple": (
        {"torque_nm": 8.0, "order": 60.0, "phase_deg": 20.0},
        {"torque_nm": 5.0, "order": 60.0, "phase_deg": 130.0},
        phasor("torque_nm", "phase_deg"),
    ),
    **{
        f"gear_ripple joint {joint}, amplified": (
            AMPLIFIED
            | {"torque_nm": 8.0, "phase_deg": 20.0, "double_sine_nm": 2.0, "double_cosine_nm": -1.0},
            AMPLIFIED
            | {"torque_nm": 5.0, "phase_deg": 130.0, "double_sine_nm": 0.5, "double_cosine_nm": 3.0},
            ripples,
        )
        for joint in range(1, 7)
    },
    "joint_backlash": (
        {"angle_mdeg": 5.0, "drag_nm": 4.0},
        {"angle_mdeg": 12.0, "drag_nm": 4.0},
        only("angle_mdeg"),
    ),
    "missing_mode": (
        {"frequency_hz": 250.0, "damping": 0.03, "stiffness_n_um": 9.0, "axis": 1.0},
        {"frequency_hz": 250.0, "damping": 0.03, "stiffness_n_um": 6.0, "axis": 1.0},
        only("stiffness_n_um", reciprocal),
    ),
    "mode_coupling": ({"angle_deg": 20.0}, {"angle_deg": 25.0}, added),
    "orbit_stiffness": (
        {"amplitude": 0.1, "phase_deg": 30.0},
        {"amplitude": 0.06, "phase_deg": 140.0},
        phasor("amplitude", "phase_deg"),
    ),
    "pass_levels": (
        {f"degree_{i}_um": 2.0 * i for i in range(1, 6)},
        {f"degree_{i}_um": 7.0 - i for i in range(1, 6)},
        added,
    ),
    "path_vibration": (
        {"frequency_hz": 6.0, "amplitude_um": 4.0},
        {"frequency_hz": 6.0, "amplitude_um": 3.0},
        only("amplitude_um"),
    ),
    "path_vibration faces": (
        {"frequency_hz": 1.7, "amplitude_um": 4.0},
        {"frequency_hz": 1.7, "amplitude_um": 3.0},
        only("amplitude_um"),
    ),
    "payload_error": (
        {"mass_kg": 3.0, "com_mm": [50.0, -20.0, 100.0]},
        {"mass_kg": -1.0, "com_mm": [10.0, 60.0, 30.0]},
        masses,
    ),
    "pitch_error": ({"pitch_deg": [0.5, -0.2, -0.3]}, {"pitch_deg": [-0.1, -0.3, 0.4]}, added),
    "process_damping": ({"coefficient_n_mm": 120.0}, {"coefficient_n_mm": 60.0}, added),
    "spindle_speed_softening": (
        {"change_per_krpm": -0.02, "at_krpm": 3.0, "exponent": 1.5, "share": [0.8, 0.3]},
        {"change_per_krpm": -0.03, "at_krpm": 3.0, "exponent": 1.5, "share": [0.8, 0.3]},
        lambda a, b: a | {"change_per_krpm": a["change_per_krpm"] + b["change_per_krpm"]},
    ),
    "spindle_tilt": (
        {"about_x_mrad": 0.5, "about_y_mrad": -0.3},
        {"about_x_mrad": -0.9, "about_y_mrad": 0.4},
        added,
    ),
    "stiffness_hardening": ({"cubic": 2e12}, {"cubic": 5e12}, added),
    "stiffness_scale": ({"factor": 0.8}, {"factor": 1.3}, multiplied),
    "thermal_growth": ({"um_per_min": 5.0}, {"um_per_min": -12.0}, added),
    "thermal_growth levelling off": (
        {"um_per_min": 5.0, "settles_s": 40.0},
        {"um_per_min": -12.0, "settles_s": 40.0},
        lambda a, b: a | {"um_per_min": a["um_per_min"] + b["um_per_min"]},
    ),
    "tip_drift": (
        {"x_um_per_run": 1.0, "y_um_per_run": 2.0},
        {"x_um_per_run": 3.0, "y_um_per_run": -5.0},
        added,
    ),
    "tip_give": ({"um_per_kn": 20.0}, {"um_per_kn": 35.0}, added),
    "tool_deflection": ({"kx_n_um": 9.0, "ky_n_um": 14.0}, {"kx_n_um": 20.0, "ky_n_um": 8.0}, reciprocal),
    "tool_offset_error": (
        {"dx_mm": 5.0, "dy_mm": -3.0, "dz_mm": 8.0},
        {"dx_mm": -1.0, "dy_mm": 9.0, "dz_mm": 2.0},
        added,
    ),
    "tool_runout": (
        {"radius_um": 9.0, "angle_deg": 40.0},
        {"radius_um": 5.0, "angle_deg": 170.0},
        phasor("radius_um", "angle_deg"),
    ),
    "tool_wear": ({"edge_growth_per_m": 0.1}, {"edge_growth_per_m": 0.25}, added),
    "uneven_teeth": ({"longer_um": [3.0, -2.0, -1.0]}, {"longer_um": [-1.0, 2.0, -1.0]}, added),
}
OWN = [effect for effect in library() if effect.apply.__module__.startswith("metro.")]
# Of the forms by joint those of the arm that is made here, which has six.
EACH = [
    (effect, observable)
    for effect in OWN
    for observable in effect.observables
    if effect.where.get("joint", "all") in {"all", *range(1, 7)}
]


def case(effect):
    """Return the values of an effect, by its name and form, or by its name alone."""
    key = f"{effect.name} {effect.form}"
    return COMPOSED[key] if key in COMPOSED else COMPOSED[effect.name]


def named(parameter):
    effect, observable = parameter
    return " ".join(filter(None, [effect.name, effect.form, observable]))


@pytest.mark.parametrize("each", EACH, ids=named)
def test_a_second_application_adds_to_the_first(each):
    effect, observable = each
    first, second, composed = case(effect)
    assert set(first) == set(second) == set(effect.names)
    predict, model = PREDICTED[observable], model_of(observable)
    alone, both = effect.apply(model, second), effect.apply(effect.apply(model, first), second)
    before, of_second, of_both = predict(model), predict(alone), predict(both)
    assert np.abs(of_second - before).max() > 1e-6 * np.abs(before).max()  # the model shows the effect
    change = np.abs(of_both - of_second).max()
    assert change > 1e-6 * np.abs(before).max()  # and the first one beneath the second
    if composed:
        at_once = predict(effect.apply(model, composed(first, second)))
        assert np.abs(of_both - at_once).max() < 1e-6 * change


def test_resonances_in_series_have_the_product_of_their_transfers():
    (effect,) = (effect for effect in OWN if effect.name == "dynamometer_resonance")
    first, second, _ = case(effect)

    def response(*values):
        model = model_of("force")
        for each in values:
            model = effect.apply(model, each)
        return transfer(model.sensor, Recording((0.5,), 1.0, 50.0), HIGHEST + 1)[0]

    product = response(first) @ response(second)
    np.testing.assert_allclose(response(first, second), product, rtol=1e-9, atol=1e-12)
    assert np.abs(product - response(second)).max() > 0.1


def test_a_model_that_has_nothing_of_an_effect_gets_exactly_its_values():
    """So a batch that declares nothing is fitted to the last digit as by an effect that replaces."""
    (effect,) = (effect for effect in OWN if effect.name == "tool_runout")
    cutter = effect.apply(model_of("force"), {"radius_um": 7.35, "angle_deg": 520.0}).cutter
    assert (cutter.runout_radius, cutter.runout_angle) == (7.35 * 1e-6, 520.0 * math.pi / 180.0)
