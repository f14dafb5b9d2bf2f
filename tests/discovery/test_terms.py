"""Terms of the force model against waveforms that are changed by hand, sample by sample."""

from dataclasses import replace

import numpy as np
import pytest

from metro.discovery.example import HIGHEST, Workshop, made
from metro.effects.varying import values_of, varies
from metro.observables.force.shapes import Shape
from metro.observables.force.terms import Bend, Depth, Factor, Lag, Layer, Push, Tooth, Wave

BETA = np.array([8e8, 3e8, 2e8, 2e4, 2e4, 5e3])
SHOP = Workshop(
    radius=5e-3,
    helix=0.5,
    tooth_angles=(0.0, np.pi),
    coefficients=tuple(BETA.tolist()),
    rows=(
        ("slot", 0.06e-3, 1.5e-3, 0.0, np.pi, 80.0, 0.2, 0.8),
        ("up", 0.09e-3, 1.0e-3, 0.0, 1.1, 100.0, 0.9, 0.8),
    ),
)
ANGLE = 2.0 * np.pi * np.arange(720) / 720
PHASE = np.array([0.7])


def waveform(values, block):
    """Samples (blocks, 3, angles) over a revolution, summed up order by order."""
    by_order = values.reshape(block.repeats, 3, -1)
    total = np.repeat(by_order[..., :1], len(ANGLE), axis=-1)
    for order in range(1, HIGHEST + 1):
        cosine, sine = by_order[..., 2 * order - 1, None], by_order[..., 2 * order, None]
        total = total + np.sqrt(2.0) * (cosine * np.cos(order * ANGLE) + sine * np.sin(order * ANGLE))
    return total


def predicted(model, block):
    matrix, offset = model.design(block, PHASE, BETA)
    one = offset + matrix @ BETA
    (other,) = model.predictions(block, PHASE[None], BETA)
    assert one == pytest.approx(other, abs=1e-9 * np.abs(one).max())
    return one


@pytest.fixture(scope="module")
def blocks():
    return made(SHOP.base, SHOP, seed=1)


@pytest.mark.parametrize(
    "term",
    [
        Factor(("ktc",), (Shape("linear", "travel", 0.5),), 0.0),
        Factor(("ktc",), (Shape("logarithm", "speed", 3000.0),), 0.0, power=True),
        Depth((Shape("decay", "time", length=0.2),), 0.0),
        Layer(0.3e-3, 0.0),
        Tooth(1, ("ktc", "kte"), (), 0.0),
        Wave(1, 0.0, 0.0),
        Push("x", (Shape("step", "travel", length=0.5),), 0.0),
        Bend("y", -1.0, 10.0, 0.0),
        Lag("xyz", 0.0),
        Lag("x", 0.0, 0.7),
    ],
)
def test_a_term_of_no_size_changes_nothing(term, blocks):
    for block in blocks:
        before = predicted(SHOP.base, block)
        assert predicted(SHOP.base.with_term(term), block) == pytest.approx(
            before, abs=1e-9 * np.abs(before).max()
        )


def test_a_factor_multiplies_its_coefficients_by_a_power_of_the_speed(blocks):
    term = Factor(("ktc", "krc"), (Shape("logarithm", "speed", 3000.0),), -0.4, power=True)
    for block, row in zip(blocks, SHOP.rows, strict=True):
        scaled = BETA * np.where(np.arange(6) < 2, (row[5] * 60.0 / 3000.0) ** -0.4, 1.0)
        matrix, _ = SHOP.base.design(block, PHASE, BETA)
        assert predicted(SHOP.base.with_term(term), block) == pytest.approx(matrix @ scaled)


def test_a_factor_follows_the_time_in_the_record(blocks):
    term = Factor(("ktc", "krc", "kac", "kte", "kre", "kae"), (Shape("decay", "time", length=0.3),), 0.5)
    block = blocks[0]
    middles = 0.8 * (np.arange(4) + 0.5) / 4
    expected = predicted(SHOP.base, block).reshape(4, -1) * (1.0 + 0.5 * np.exp(-middles / 0.3))[:, None]
    assert predicted(SHOP.base.with_term(term), block) == pytest.approx(expected.ravel())


def test_a_depth_is_that_of_a_deeper_cut(blocks):
    block = blocks[0]
    found = predicted(SHOP.base.with_term(Depth((), 20e-6)), block)
    deeper = replace(block.setting, cut=replace(block.setting.cut, axial_depth=1.52e-3))
    expected = predicted(SHOP.base, replace(block, setting=deeper))
    change = np.abs(expected - predicted(SHOP.base, block)).max()
    assert np.abs(found - expected).max() < 0.02 * change


def test_a_layer_at_the_top_and_the_rest_make_the_whole(blocks):
    block = blocks[1]
    both = SHOP.base.with_term(Layer(0.4e-3, 0.3)).with_term(Layer(0.6e-3, 0.3, top=False))
    matrix, _ = SHOP.base.design(block, PHASE, BETA)
    assert predicted(both, block) == pytest.approx(matrix @ (BETA * [1.3, 1.3, 1.3, 1.0, 1.0, 1.0]))
    alone = predicted(SHOP.base.with_term(Layer(0.4e-3, 0.3)), block) - predicted(SHOP.base, block)
    part = np.linalg.norm(alone) / np.linalg.norm(predicted(SHOP.base, block))
    assert 0.05 < part < 0.3


def test_all_teeth_together_are_the_tool(blocks):
    block, columns = blocks[0], ("ktc", "krc", "kac", "kte", "kre", "kae")
    model = SHOP.base
    for tooth in range(2):
        model = model.with_term(Tooth(tooth, columns, (), 0.2))
    whole = predicted(SHOP.base, block)
    # a tooth alone has the chip of circular paths where others cut before it: equal to a few percent
    assert np.linalg.norm(predicted(model, block) - 1.2 * whole) < 0.02 * np.linalg.norm(whole)


def test_a_wave_multiplies_the_waveform_of_the_shear_force(blocks):
    block = blocks[0]
    shear = np.where(np.arange(6) < 3, BETA, 0.0)
    matrix, _ = SHOP.base.design(block, PHASE, BETA)
    # the model has tooth 0 at the angle of the spindle plus the phase
    wave = 1.0 + 0.2 * np.cos(ANGLE + PHASE) - 0.1 * np.sin(ANGLE + PHASE)
    expected = waveform(matrix @ shear, block) * wave + waveform(matrix @ (BETA - shear), block)
    found = waveform(predicted(SHOP.base.with_term(Wave(1, 0.2, -0.1)), block), block)
    lost = np.abs(waveform(matrix @ shear, block)).max()
    assert np.abs(found - expected).max() < 0.02 * lost  # of the highest order, which leaves the orders kept


def test_a_push_is_in_the_mean_of_its_axis_alone(blocks):
    term = Push("z", (Shape("step", "travel", length=0.5),), 7.0)
    for block, pushed in zip(blocks, (0.0, 7.0), strict=True):
        more = waveform(predicted(SHOP.base.with_term(term), block) - predicted(SHOP.base, block), block)
        assert more[:, 2] == pytest.approx(pushed)
        assert more[:, :2] == pytest.approx(0.0, abs=1e-9)


def test_a_bend_takes_a_share_of_what_is_beyond_the_preload(blocks):
    block = blocks[0]
    before = waveform(predicted(SHOP.base, block), block)
    preload = 0.3 * before[:, 1].max()
    after = waveform(predicted(SHOP.base.with_term(Bend("y", 1.0, preload, 0.25)), block), block)
    expected = before[:, 1] - 0.25 * np.maximum(before[:, 1] - preload, 0.0)
    assert np.abs(after[:, 1] - expected).max() < 0.02 * np.abs(before[:, 1]).max()
    assert after[:, [0, 2]] == pytest.approx(before[:, [0, 2]])


def test_a_lag_is_the_low_pass_of_the_time_signal(blocks):
    block, constant = blocks[0], 0.4e-3
    before = waveform(predicted(SHOP.base, block), block)[0, 0]
    step = 1.0 / (SHOP.rows[0][5] * len(ANGLE))
    state, read = before.mean(), []
    for force in np.tile(before, 6):  # y' = (x - y) / T, exactly over each step of a held force
        state = force + (state - force) * np.exp(-step / constant)
        read.append(state)
    after = waveform(predicted(SHOP.base.with_term(Lag("xyz", constant)), block), block)[0, 0]
    assert np.abs(after - np.array(read[-len(ANGLE) :])).max() < 0.02 * np.ptp(before)


def test_what_is_constant_does_not_vary():
    same = replace(SHOP, rows=tuple((*row[:5], 80.0, *row[6:]) for row in SHOP.rows))
    for shop, expected in ((SHOP, True), (same, False)):
        runs = made(shop.base, shop, seed=1)
        assert varies("speed", values_of("speed", shop.base, runs)) is expected
