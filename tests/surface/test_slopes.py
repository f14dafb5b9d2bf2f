"""Heights from slopes: Moody's worksheets of 1955, surfaces that are known, and the covariance by draws."""

from dataclasses import replace

import numpy as np
import pytest

from metro.surface.level_indices import level_indices
from metro.surface.slope_noise import slope_noise, suspects
from metro.surface.slopes import Levelled, Readings, level

ARCSEC = np.pi / 648000
# Readings in seconds of arc along the eight lines of a surface plate, feet 4 inches apart: J. C. Moody, How
# to calibrate surface plates in the plant, The Tool Engineer, October 1955, worksheets 1 to 8, with the two
# slips mended that B. Allen's corrections of 2018 name (the last but one of NE-SW, the ninth of NE-NW).
MOODY = {
    "NW-SE": "6.5 6.0 5.0 5.2 5.5 5.6 5.5 5.0 5.5 4.8 5.0 5.2 5.3 4.9 4.6 4.2 5.3 4.9 4.5 3.5",
    "NE-SW": "6.6 5.4 5.4 5.2 5.5 5.7 5.0 5.0 5.4 4.5 4.4 4.5 4.5 4.8 4.2 4.2 4.2 4.8 4.3 3.2",
    "NE-NW": "20.5 19.7 20.5 20.3 20.2 19.9 19.0 19.5 18.8 18.6 18.7 18.6 18.4 18.5 19.0 17.9",
    "NE-SE": "3.5 2.1 2.5 2.8 3.4 3.2 3.5 4.0 4.2 3.5",
    "SE-SW": "16.4 15 15.6 15.5 15.1 15.3 15.1 14.6 14 13.5 13.5 13.3 13.3 13.4 14 13.9",
    "NW-SW": "6 4.6 4.5 4.7 5.0 4.5 5.9 6 6 4.9",
    "E-W": "11.7 12.4 12.1 12.5 12.0 11.5 11.5 11.3 11.3 10.3 10.8 10.3 10 10.7 10.4 10.4",
    "N-S": "6.6 6.4 6.3 6.5 6.6 6.9 7.5 7.4 7.1 7",
}
# His last column, 1e-5 inch above the lowest station: station of 16 steps from west and 10 from south.
HIS = {
    (0, 10): 6.2, (16, 10): 2.9, (16, 0): 6.2, (0, 0): 2.9, (8, 5): 13.2, (8, 10): 15.3, (8, 0): 17.8,
    (16, 6): 0.0, (16, 5): 0.6, (0, 5): 2.1, (0, 4): 0.4, (9.6, 6): 12.8, (1, 0): 4.2, (15, 0): 9.7,
    (12, 10): 11.4, (16, 2): 3.3, (0, 9): 7.4, (4, 2.5): 9.7, (12, 2.5): 12.2,
}  # fmt: skip


def jack(across, up, diagonal, size, *, own_zeros=True):
    """Return feet and lines of a union jack of so many steps across, up and along each diagonal."""
    (w, h), ends, counts = size, [], [diagonal, diagonal, across, up, across, up, across, up]
    ends = [((0, h), (w, 0)), ((w, h), (0, 0)), ((w, h), (0, h)), ((w, h), (w, 0))]
    ends += [((w, 0), (0, 0)), ((0, h), (0, 0)), ((w, h / 2), (0, h / 2)), ((w / 2, h), (w / 2, 0))]
    lines = [np.linspace(*end, count + 1) for end, count in zip(ends, counts, strict=True)]
    first, second = (np.vstack([line[part] for line in lines]) for part in (np.s_[:-1], np.s_[1:]))
    return Readings(first, second, np.zeros(sum(counts)), np.repeat(np.arange(8) * own_zeros, counts))


def of_surface(readings, surface, zeros=(0.0,) * 8, noise=0.0, seed=0):
    """Return readings of a surface z(x, y) in m."""
    step = np.linalg.norm(readings.second - readings.first, axis=1)
    slope = (surface(*readings.second.T) - surface(*readings.first.T)) / step
    random = np.random.default_rng(seed).standard_normal(len(step))
    return replace(readings, slope=slope + np.asarray(zeros)[readings.line] + noise * random)


def off_plane(places, z):
    base = np.linalg.qr(np.column_stack([np.ones(len(z)), places]))[0]
    return z - base @ (base.T @ z)


def bowl(x, y):
    return 3e-6 * (x**2 - 0.7 * x * y + 2.0 * y**2) - 1e-6 * x + 4e-6


def moody(lines=8):
    # His diagonals are 20 feet long and his sides 16 and 10, which no rectangle is: the short sides are drawn
    # longer here, and their readings are made smaller, so that each foot has the rise that it had.
    plate = jack(16, 10, 20, (64.0, 48.0))
    step = np.linalg.norm(plate.second - plate.first, axis=1)
    rise = 4.0 * ARCSEC * np.concatenate([np.array(line.split(), float) for line in MOODY.values()])
    kept = plate.line < lines
    return Readings(plate.first[kept], plate.second[kept], (rise / step)[kept], plate.line[kept])


def his_heights(found):
    rows = [
        (*found.places[np.hypot(*(found.places - [4.0 * x, 4.8 * y]).T).argmin()], at)
        for (x, y), at in HIS.items()
    ]
    near = [np.hypot(*(found.places - [x, y]).T).argmin() for x, y, _ in rows]
    theirs = np.array([height for *_, height in rows])
    ours = found.heights[near] / 1e-5
    plane = np.column_stack([np.ones(len(rows)), np.array(rows)[:, :2]])
    return off_plane(plane[:, 1:], theirs - ours)


def test_moodys_worksheets_of_1955_are_met_to_all_their_digits():
    """His method uses six lines, whose loops close by themselves: least squares must give his heights."""
    found = level(moody(6))
    assert (found.dof, len(found.places)) == (0, 89)
    # both are printed to 0.1: their difference, less the plane between the two references, is rounding
    assert np.abs(his_heights(found)).max() < 0.06


def test_the_two_centre_lines_are_two_closures_and_move_no_height_of_moodys_by_more():
    found = level(moody())
    assert found.dof == 2
    assert (
        0.2 < np.abs(his_heights(found)).max() < 0.5
    )  # his closure errors are 1.9 and 1.0 seconds, over 16 feet


@pytest.mark.parametrize("own_zeros", [True, False])
def test_a_known_surface_comes_back_whatever_the_zeros(own_zeros):
    zeros = 1e-4 * np.arange(8.0)
    found = level(of_surface(jack(6, 4, 8, (1.2, 0.8), own_zeros=own_zeros), bowl, zeros))
    assert found.heights == pytest.approx(off_plane(found.places, bowl(*found.places.T)), abs=1e-12)
    assert np.abs(found.residuals).max() < 1e-12
    assert found.dof == (2 if own_zeros else 7)  # closed forms: n + 8 zeros less n − 7 stations and a plane


def test_a_tilted_face_under_a_level_of_a_wrong_zero_is_flat():
    flat = level(
        of_surface(jack(6, 4, 8, (1.2, 0.8), own_zeros=False), lambda x, y: 1e-3 * x - 2e-3 * y, (3e-4,))
    )
    assert np.abs(flat.heights).max() < 1e-12


def test_the_covariance_is_that_of_the_heights_of_many_draws():
    plate = jack(6, 4, 8, (1.2, 0.8))
    found = level(plate)
    gain = np.column_stack([level(replace(plate, slope=one)).heights for one in np.eye(len(plate.slope))])
    drawn = gain @ np.random.default_rng(2).standard_normal((len(plate.slope), 20000))
    sd = np.sqrt(np.diag(found.cofactor))
    assert drawn.std(axis=1) == pytest.approx(sd, rel=0.03)
    pair = found.cofactor[0, -1] / (sd[0] * sd[-1])
    assert np.corrcoef(drawn[0], drawn[-1])[0, 1] == pytest.approx(pair, abs=0.03)


@pytest.mark.parametrize(
    ("kept", "reason"),
    [
        (lambda plate: plate.line == 2, "one straight line, which shows straightness"),
        (lambda plate: np.isin(plate.line, (2, 4)), "line 2 at 0, line 4 at 0"),
        (lambda plate: (plate.line < 5) | (plate.line == 5) & (plate.second[:, 1] > 0), "found line 5 at 1$"),
    ],
    ids=["one line", "two sides that do not meet", "a line with one end alone"],
)  # fmt: skip
def test_what_gives_no_flatness_is_refused_with_the_reason(kept, reason):
    plate = jack(6, 4, 8, (1.2, 0.8))
    some = kept(plate)
    with pytest.raises(ValueError, match=reason):
        level(Readings(plate.first[some], plate.second[some], plate.slope[some], plate.line[some]))


def test_stations_that_are_marked_half_a_millimetre_apart_are_one():
    plate = jack(6, 4, 8, (1.2, 0.8))
    moved = replace(plate, first=plate.first + 4e-4 * (plate.line == 3)[:, None])
    assert len(level(moved).places) == len(level(plate).places) == len(plate.slope) - 7


def noisy(sigma=1e-6, seed=1, *, own_zeros=False):
    return of_surface(jack(10, 6, 12, (1.0, 0.6), own_zeros=own_zeros), bowl, noise=sigma, seed=seed)


def test_noise_is_the_declared_one_unless_the_loops_contradict_it_or_none_is_declared():
    readings = noisy()
    found = level(readings)
    assert slope_noise(found, readings.slope, 1.2e-6).source == "declared standard deviation"
    for declared in (0.2e-6, np.nan):
        noise = slope_noise(found, readings.slope, declared)
        assert (noise.source, noise.dof) == ("closure of the loops", 7)
        assert noise.sigma == pytest.approx(1e-6, rel=0.6)  # 95 % of the scatters by seven degrees of freedom
    rounded = replace(
        readings, slope=np.zeros(len(readings.slope)) + 1e-5 * (np.arange(len(readings.slope)) > 200)
    )
    assert slope_noise(level(rounded), rounded.slope, np.nan).sigma >= 0.0
    alone = level(moody(6))
    assert np.isnan(slope_noise(alone, moody(6).slope, np.nan).sigma)


def test_no_scatter_is_less_than_the_last_digit():
    """A face that slopes by whole figures of the instrument leaves residuals of nothing."""
    readings = of_surface(jack(6, 4, 8, (1.2, 0.8)), bowl)
    digits = replace(readings, slope=np.round(readings.line + 1.0) * 1e-5)
    noise = slope_noise(level(digits), digits.slope, np.nan)
    assert noise.source == "last digit of the readings"
    assert noise.sigma == pytest.approx(1e-5 / np.sqrt(12))


def test_a_slip_of_one_reading_is_named_and_chance_is_not():
    readings = noisy()
    slipped = readings.slope.copy()
    slipped[30] += 2e-5
    found = level(replace(readings, slope=slipped))
    which, chance = suspects(found)
    assert 30 in which
    assert chance < 0.05
    named = 0
    for seed in range(100):
        chance_alone = noisy(seed=seed)
        found = level(chance_alone)
        named += len(suspects(found)[0]) > 0
    assert named <= 10  # five are expected of 100, and more than ten have a probability of 1 %


def truth_of(readings, surface):
    found = level(replace(readings, slope=np.zeros(len(readings.slope))))
    heights = off_plane(found.places, surface(*found.places.T))
    return level_indices(replace(found, heights=heights), np.nan, np.inf)


@pytest.mark.parametrize("flat", [True, False])
def test_the_intervals_of_the_indices_hold_the_truth(flat):
    """Twelve draws: fewer than 10 have a probability of 2 % where 95 % hold."""
    surface = (lambda x, y: 0.0 * x * y) if flat else bowl
    plate = jack(6, 4, 8, (1.0, 0.6), own_zeros=False)
    truth = truth_of(plate, surface)
    held = dict.fromkeys(truth, 0)
    for seed in range(12):
        readings = of_surface(plate, surface, noise=1e-6, seed=seed)
        for name, index in level_indices(level(readings), 1e-6, np.inf).items():
            held[name] += index.low - 1e-12 <= truth[name].value <= index.high + 1e-12
            assert index.low <= index.corrected <= min(index.high, index.value)
    assert min(held.values()) >= 10, held


@pytest.mark.parametrize("name", ["fltt", "fltp", "fltv"])
def test_a_face_that_noise_alone_may_make_of_a_flat_one_may_be_flat(name):
    """Readings of nothing but noise exceed the 97.5 % quantile of an index, by draws made here, in 2.5 %.

    Up to that quantile the lower end is zero, whichever stations are the extreme ones, and well beyond not.
    """
    read = {"fltt": np.ptp, "fltp": np.max, "fltv": lambda z: -np.min(z)}[name]
    found, random = level(jack(6, 4, 8, (1.0, 0.6), own_zeros=True)), np.random.default_rng(5)
    root = np.linalg.cholesky(found.cofactor + 1e-9 * np.trace(found.cofactor) * np.eye(len(found.heights)))
    drawn = 1e-6 * random.standard_normal((20_000, len(root))) @ root.T
    most = np.quantile([read(each) for each in drawn], 0.975)
    for noise in drawn[:4]:
        for times, zero in ((0.93, True), (3.0, False)):
            heights = noise * times * most / read(noise)
            low = level_indices(replace(found, heights=heights), 1e-6, np.inf)[name].low
            assert (low == 0.0) == zero, (name, times, low)


def test_the_minimum_zone_of_a_saddle_is_that_of_its_four_corners():
    """z = c (x² − y²) over a square: the middles of two edges against those of two others, a width of 2 c."""
    plate = of_surface(jack(4, 4, 6, (2.0, 2.0)), lambda x, y: 1e-6 * ((x - 1) ** 2 - (y - 1) ** 2))
    found = level(plate)
    indices = level_indices(found, 1e-8, np.inf)
    assert indices["minimum_zone"].value == pytest.approx(2e-6, rel=1e-9)
    assert indices["fltt"].value == pytest.approx(2e-6, rel=1e-9)
    # the widths of both intervals are some times the noise of a height, 1e-8 rad over steps of 0.4 m
    assert 0 < indices["minimum_zone"].high - indices["minimum_zone"].low < 6e-8


def test_unknown_noise_gives_no_interval():
    found = level(moody(6))
    assert isinstance(found, Levelled)
    assert np.isnan(level_indices(found, np.nan, np.inf)["fltt"].high)
