"""The march with effects of the boundary in it, against the multipliers of the model that has them too."""

from dataclasses import replace

import numpy as np
import pytest

from metro.dynamics.lobes import spectral_radius, stability_boundary
from metro.dynamics.system import Cut, Structure
from virtual_cell.flexible import Machine
from virtual_cell.hidden import BOUNDARY_EFFECTS
from virtual_cell.milling import in_millimetres
from virtual_cell.modes import Modes
from virtual_cell.recipes import boundary
from virtual_cell.regeneration import Trials, march

X, Y = boundary.MODES
STRUCTURE = Structure(
    np.array([0, 1]),
    *(np.concatenate([getattr(m, name) for m in (X, Y)]) for name in ("omega", "damping", "stiffness")),
)
ENTRY = np.radians(99.0)  # that of the recipe, to a step of the march
PLAIN = Cut(boundary.TEETH, ENTRY, np.pi, boundary.LAW.ktc, boundary.LAW.krc)
RPM = np.array([2800.0, 4400.0])


def growth(history, per_turn, after):
    change = np.abs(history.tip[:, per_turn:] - history.tip[:, :-per_turn]).max(axis=2)
    largest = np.log(change.reshape(len(change), -1, per_turn).max(axis=2))
    return [np.polyfit(np.arange(after, largest.shape[1]), row[after:], 1)[0] for row in largest]


@pytest.mark.parametrize(("turned", "ploughing"), [(0.0, 0.0), (0.5, 0.0), (0.0, 1.5e7)])
def test_vibration_dies_out_as_fast_as_the_multipliers_say(turned, ploughing):
    structure = STRUCTURE.turned(turned)
    cut = Cut(PLAIN.teeth, ENTRY, np.pi, PLAIN.ktc, PLAIN.krc, ploughing)
    depth = 0.85 * stability_boundary(structure, cut, RPM).depth
    trials = Trials(
        (X, Y), boundary.LAW, PLAIN.teeth, 1e-3, RPM, depth,
        immersion=(ENTRY, np.pi), turned=turned, ploughing=ploughing,
    )  # fmt: skip
    expected = PLAIN.teeth * np.log(spectral_radius(structure, cut, RPM, depth))
    np.testing.assert_allclose(growth(march(trials, 30, 240), 240, 10), expected, atol=0.025)


def test_the_tests_lie_on_either_side_of_the_boundary():
    done = boundary.cut_tests({})
    model = stability_boundary(STRUCTURE, PLAIN, np.array(boundary.RPM))
    for rpm, depth in zip(boundary.RPM, model.depth, strict=True):
        here = done.rpm == rpm
        if done.unstable[here].any():
            shallow = done.depth[here][~done.unstable[here]].max()
            deep = done.depth[here][done.unstable[here]].min()
            assert shallow / 1.15 < depth < 1.15 * deep
    heard = done.chatter_hz()
    told = model.chatter_hz[np.searchsorted(boundary.RPM, done.rpm)]
    near = np.abs(np.log(heard / told)[np.isfinite(heard)]) < 0.08
    assert near.mean() > 0.8


def test_softening_and_a_missing_mode_change_the_modes_that_are_marched():
    rpm = np.array([2000.0, 4000.0])
    hidden = {
        "spindle_speed_softening": {"change_per_krpm": -0.05},
        "missing_mode": {"frequency_hz": 250.0, "damping": 0.03, "stiffness_n_um": 10.0, "axis": "y"},
    }
    machine = boundary.MACHINE
    for name, parameters in hidden.items():
        machine = BOUNDARY_EFFECTS[name].apply(machine, parameters)
    x, y = machine.modes_at(rpm, np.zeros(2))
    np.testing.assert_allclose(x.stiffness[:, 0], 9e6 * np.array([0.9, 0.8]))
    mass = x.stiffness / x.omega**2
    assert mass[0] == pytest.approx(mass[1])
    np.testing.assert_allclose(y.stiffness[:, 1], 10e6 * np.array([0.9, 0.8]))
    np.testing.assert_allclose(y.omega[:, 1], 2 * np.pi * 250.0 * np.sqrt([0.9, 0.8]))


def test_chatter_that_is_locked_to_the_turns_is_called_chatter():
    """Of two teeth each second one cuts for two, so that every turn is as the one before."""
    modes = (
        Modes(np.array([373.7]), np.array([0.035]), np.array([7.9e6])),
        Modes(np.array([294.0, 416.7]), np.array([0.033, 0.018]), np.array([7.5e6, 15.1e6])),
    )
    law = in_millimetres((1212.0, 537.0, 199.0), (0.0, 0.0, 0.0), (0.0, 0.0))
    machine = Machine(modes, law, 20e-3, 2, 82e-6, 5.93e-3, "up")
    programme = replace(boundary.PROGRAMME, rpm=(3490.0,), held_out=(), depths=(1.5e-3, 2.5e-3), beside=1)
    done = boundary.cut_tests({}, machine, programme)
    assert done.unstable.tolist() == [False, True]
    last = done.history.tip[1, -20 * done.per_turn :].reshape(20, done.per_turn, 2)
    assert np.ptp(last, axis=0).max() < 0.05 * machine.feed
    assert done.chatter_hz()[1] == pytest.approx(3.5 * 2 * 3490.0 / 60.0, rel=0.01)
    runout = replace(machine, runout=0.1 * machine.feed)  # then nobody can tell it from what the runout does
    assert boundary.cut_tests({}, runout, programme).unstable.tolist() == [False]
