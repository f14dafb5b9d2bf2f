"""Impacts of a batch become modes: repeats, channels that are there twice, windows, universal files."""

import numpy as np
import pandas as pd
import pytest
import yaml

from metro.batch.processed import read_table
from metro.dynamics.hits import Hit, gate
from metro.formats.uff import FRF, Function
from metro.formats.uff_writer import universal_file
from metro.observables.stability.lines import clear_of_drift, clear_of_noise
from metro.observables.stability.modal_test import observe_modes
from metro.observables.stability.receptance import arranged, from_files
from metro.stages.ingest import ingest

NATURAL, ZETA, STIFFNESS = np.array([30.0, 62.0]), np.array([0.03, 0.02]), np.array([4e6, 9e6])
SHAPES = np.array([[1.0, 1.0], [0.6, -0.7], [-0.3, 0.8]])
FREQUENCY = 0.01953125 * np.arange(512, 4609)
HIT_COLUMNS = ("test", "position", "reference", "response", "replicate", "response_unit", "t_s")
NO_HIT = pd.DataFrame(columns=[*HIT_COLUMNS, "force_n", "response_si"])


def receptance(response, reference=0, noise=0.0, seed=0, frequency=FREQUENCY):
    ratio = frequency[:, None] / NATURAL
    modal = 1 / (STIFFNESS * (1 - ratio**2 + 2j * ZETA * ratio))
    exact = modal @ (SHAPES[response] * SHAPES[reference])
    rng = np.random.default_rng(seed)
    sd = noise * np.sqrt(np.mean(np.abs(exact) ** 2) / 2)
    return exact + sd * (rng.normal(size=len(exact)) + 1j * rng.normal(size=len(exact)))


def frf_rows(values, response="1x", reference="1x", replicate=1, frequency=FREQUENCY):
    place = {"test": "t", "position": "1", "reference": reference, "response": response}
    columns = {"frequency_hz": frequency, "real_m_n": values.real, "imag_m_n": values.imag}
    return pd.DataFrame({**place, "replicate": replicate, **columns})


def observed(*rows, hit=NO_HIT, hammer=None):
    return observe_modes({"hit": hit, "frf": pd.concat(rows)}.__getitem__, hammer or {})


def test_a_channel_that_is_there_twice_is_left_out_and_named():
    first, second = receptance(0, noise=0.01), receptance(1, noise=0.01, seed=1)
    test = observed(frf_rows(first), frf_rows(second, "2x"), frf_rows(first.copy(), "3x"))
    assert set(test.used["response"]) == {"1x", "2x"}
    assert test.notes == ["position 1, 1x to 3x: left out, the same data as 1x to 1x"]


def test_a_pair_and_its_reciprocal_may_be_equal():
    h11, h12, h22 = receptance(0), receptance(1), receptance(1, 1)
    test = observed(frf_rows(h11), frf_rows(h12, "2x"), frf_rows(h12, "1x", "2x"), frf_rows(h22, "2x", "2x"))
    assert len(test.used.groupby(["reference", "response"])) == 4
    assert test.notes == []
    np.testing.assert_allclose(test.modes["stiffness_n_m"], STIFFNESS, rtol=1e-4)


def test_shapes_and_their_likeness_are_those_of_the_structure():
    rows = [frf_rows(receptance(i, noise=0.003, seed=i), f"{i + 1}x") for i in range(3)]
    test = observed(*rows)
    shapes = test.shapes.pivot_table(index="response", columns="frequency_hz", values="real").to_numpy()
    np.testing.assert_allclose(shapes, SHAPES, atol=0.02)
    assert np.abs(test.shapes["imag"]).max() < 0.02
    between = (SHAPES[:, 0] @ SHAPES[:, 1]) ** 2 / np.prod((SHAPES**2).sum(axis=0))
    found = test.alike["mac"].to_numpy().reshape(2, 2)
    np.testing.assert_allclose(found, [[1.0, between], [between, 1.0]], atol=0.02)


def test_repeated_frf_files_tell_the_error():
    rows = [frf_rows(receptance(0, noise=0.05, seed=i), replicate=i + 1) for i in range(4)]
    test = observed(*rows)
    for value, sd, true in (
        ("frequency_hz", "frequency_sd_hz", NATURAL),
        ("damping", "damping_sd", ZETA),
        ("stiffness_n_m", "stiffness_sd", STIFFNESS),
    ):
        assert np.all(np.abs(test.modes[value] - true) < 4 * test.modes[sd])
    # four times as many data as in one: half the deviation
    alone = observed(rows[0]).modes
    assert np.all(test.modes["damping_sd"] < alone["damping_sd"])


def test_a_repeat_on_other_lines_is_left_out_and_named():
    other = FREQUENCY[::2]
    test = observed(
        frf_rows(receptance(0)),
        frf_rows(receptance(0, frequency=other), replicate=2, frequency=other),
    )
    assert test.notes == ["position 1, 1x to 1x: 1 FRFs on other lines than the first were left out"]
    assert len(test.modes) == 2


def test_each_response_comes_with_what_the_modes_leave_of_it():
    test = observed(frf_rows(receptance(0, noise=0.02)), frf_rows(receptance(1, noise=0.04, seed=1), "2x"))
    for (_, response), rows in test.used.groupby(["reference", "response"]):
        measured = rows["real_m_n"] + 1j * rows["imag_m_n"]
        modal = rows["modal_real_m_n"] + 1j * rows["modal_imag_m_n"]
        left = np.linalg.norm(modal - measured) / np.linalg.norm(measured)
        assert rows["error"].to_numpy() == pytest.approx(left)
        assert left == pytest.approx({"1x": 0.02, "2x": 0.04}[response], rel=0.05)


def test_the_diagram_is_kept_with_the_poles_that_recur():
    test = observed(frf_rows(receptance(0, noise=0.01)))
    recurring = test.stabilisation[test.stabilisation["recurs"]]
    for natural in NATURAL:
        near = recurring[np.abs(recurring["frequency_hz"] / natural - 1) < 0.01]
        assert near["order"].nunique() > 10


def hits(window_s=None, references=(0,), rate=1024.0, seconds=4.0):
    """Three blows on each reference, recorded at three points; through a window where one is given."""
    n = int(rate * seconds)
    t = np.arange(n) / rate
    s = 2j * np.pi * np.fft.rfftfreq(2 * n, 1 / rate)
    w = 2 * np.pi * NATURAL
    modal = w**2 / STIFFNESS / (s[:, None] ** 2 + 2 * ZETA * w * s[:, None] + w**2)
    window = np.exp(-t / window_s) if window_s else np.ones(n)
    rng, parts = np.random.default_rng(0), []
    for reference in references:
        for replicate in (1, 2, 3):
            width = 0.006 * (1 + reference)  # a softer tip: lines above are not excited
            force = np.where(
                (t > 0.02) & (t < 0.02 + width), 300 * np.sin(np.pi * (t - 0.02) / width) ** 2, 0.0
            )
            for point, shape in enumerate(SHAPES):
                h = modal @ (shape * SHAPES[reference]) * s**2
                motion = np.fft.irfft(np.fft.rfft(force, 2 * n) * h)[:n]
                motion = motion * window + 1e-3 * motion.std() * rng.normal(size=n)
                place = {
                    "test": "t",
                    "position": "1",
                    "reference": f"{reference + 1}x",
                    "response": f"{point + 1}x",
                }
                columns = {
                    "t_s": t,
                    "force_n": force * window + 0.1 * rng.normal(size=n),
                    "response_si": motion,
                }
                parts.append(
                    pd.DataFrame({**place, "replicate": replicate, "response_unit": "m/s2", **columns})
                )
    return pd.concat(parts, ignore_index=True)


def pairs(references, responses):
    rows = [frf_rows(receptance(0), o, i) for i in references for o in responses]
    return list(from_files(pd.concat(rows), []))


def test_the_inputs_of_an_output_stand_side_by_side():
    group, inputs = arranged(pairs(["1x", "4x"], ["1x", "2x", "3x"]))
    assert inputs == 2
    assert [item.pair for item in group[:3]] == ["1x to 1x", "4x to 1x", "1x to 2x"]


def test_of_a_roving_hammer_the_response_is_the_input():
    group, inputs = arranged(pairs(["1x", "2x", "3x"], ["1x", "4x"]))
    assert inputs == 2
    assert [item.pair for item in group[:3]] == ["1x to 1x", "1x to 4x", "2x to 1x"]


def test_pairs_that_are_not_a_whole_table_are_outputs_of_their_own():
    group = pairs(["1x", "4x"], ["1x", "2x", "3x"])[:-1]
    assert arranged(group) == (group, 1)


NO_FRF = frf_rows(receptance(0)).iloc[:0]


def test_references_that_excite_different_bands_are_fitted_together():
    test = observed(NO_FRF, hit=hits(references=(0, 1)))
    assert len(test.used.groupby(["reference", "response"])) == 6
    lines = test.used.groupby(["reference", "response"])["frequency_hz"]
    assert lines.min().nunique() == lines.max().nunique() == 1
    assert lines.max().max() < 2 / 0.012  # where the spectrum of the softer tip has its first zero
    np.testing.assert_allclose(test.modes["damping"], ZETA, rtol=0.01)


def test_the_lines_fitted_are_independent():
    """Of a record that the gate has shortened, lines closer than one over the length kept say the same."""
    table = hits()
    test = observed(NO_FRF, hit=table)
    kept = [
        gate(Hit(rows["force_n"].to_numpy(), rows["response_si"].to_numpy(), 1024.0))[2] / 1024.0
        for _, rows in table.groupby(["response", "replicate"])
    ]
    assert max(kept) < 4.0  # the whole record
    lines = test.used.loc[test.used["response"] == "1x", "frequency_hz"]
    assert np.diff(lines).min() >= 1 / max(kept)


def test_a_declared_exponential_window_is_taken_off_the_damping():
    hammer = {"window": "exponential", "time_constant_s": 0.5}
    test = observed(NO_FRF, hit=hits(0.5), hammer=hammer)
    np.testing.assert_allclose(test.modes["damping"], ZETA, rtol=0.005)
    np.testing.assert_allclose(test.modes["stiffness_n_m"], STIFFNESS, rtol=0.01)


def test_an_exponential_window_without_its_time_is_named():
    test = observed(frf_rows(receptance(0)), hammer={"window": "exponential"})
    assert test.notes == [
        "instruments.hammer: exponential window without time_constant_s: its damping stays in"
    ]


def test_a_universal_file_of_many_pairs_goes_from_the_batch_to_the_modes(tmp_path):
    folder = tmp_path / "modal"
    folder.mkdir()
    functions = [
        Function(
            FRF, "1x", f"{point + 1}x", "m/s2", FREQUENCY, -((2 * np.pi * FREQUENCY) ** 2) * receptance(point)
        )
        for point in range(3)
    ]
    (folder / "test.uff").write_bytes(universal_file(functions))
    manifest = {"format": 1, "batch": "modal", "source": "measured", "cell": "none"}
    (folder / "batch.yaml").write_text(yaml.safe_dump(manifest))
    (folder / "impacts.csv").write_text(
        "test,position,reference,response,replicate,kind,file,response_unit\nt,1,,,,,test.uff,\n"
    )
    out = tmp_path / "processed"
    ingest(folder, tmp_path, out, {}, "c0de")
    frf = read_table(out / "frf.parquet")
    assert list(frf["response"].unique()) == ["1x", "2x", "3x"]
    test = observe_modes(lambda name: read_table(out / f"{name}.parquet"), {})
    np.testing.assert_allclose(test.modes["frequency_hz"], NATURAL, rtol=1e-6)
    np.testing.assert_allclose(test.modes["stiffness_n_m"], STIFFNESS, rtol=1e-4)


def test_a_row_that_names_a_pair_takes_that_pair_out_of_the_file(tmp_path):
    folder = tmp_path / "modal"
    folder.mkdir()
    functions = [
        Function(FRF, "1x", f"{point + 1}x", "m", FREQUENCY, receptance(point)) for point in range(3)
    ]
    (folder / "test.uff").write_bytes(universal_file(functions, binary=False))
    manifest = {"format": 1, "batch": "modal", "source": "measured", "cell": "none"}
    (folder / "batch.yaml").write_text(yaml.safe_dump(manifest))
    (folder / "impacts.csv").write_text(
        "test,position,reference,response,replicate,kind,file,response_unit\nt,1,1x,2x,,frf,test.uff,\n"
    )
    ingest(folder, tmp_path, tmp_path / "processed", {}, "c0de")
    frf = read_table(tmp_path / "processed" / "frf.parquet")
    assert list(frf["response"].unique()) == ["2x"]
    np.testing.assert_allclose(frf["real_m_n"], functions[1].values.real, rtol=1e-11)


def test_a_resonance_low_in_the_band_is_no_drift():
    """Of an integrated acceleration the first lines rise; a lightly damped mode stands by itself."""
    frequency = np.arange(60.0, 1260.0)

    def receptance(hz, damping, stiffness):
        ratio = frequency / hz
        return 1.0 / (stiffness * (1.0 - ratio**2 + 2j * damping * ratio))

    mode = receptance(256.0, 0.02, 2e7)[:, None]
    drift = (2e-7 * (60.0 / frequency) ** 4 * 30)[:, None]
    assert clear_of_drift(frequency, mode).all()
    clear = clear_of_drift(frequency, mode + drift)
    first = frequency[clear][0]
    assert 60.0 < first < 230.0
    assert clear[frequency >= first].all()


def test_a_drift_is_not_sought_beyond_a_quarter_of_the_band():
    frequency = np.arange(1.0, 1001.0)
    level = np.where(frequency < 400.0, 1.0, 1e-3)[:, None] * np.ones(1, dtype=complex)
    clear = clear_of_drift(frequency, level)
    assert frequency[clear][0] == 251.0
    assert clear[frequency >= 251.0].all()


@pytest.mark.parametrize("first", [0.5, 2.0])
def test_a_first_mode_far_above_the_others_is_no_drift(first):
    """A fundamental at 3000 times the median of the band, on an integrated acceleration with drift below."""
    frequency = np.arange(first, 1000.0, 0.5)

    def receptance(hz, damping, stiffness):
        ratio = frequency / hz
        return 1.0 / (stiffness * (1.0 - ratio**2 + 2j * damping * ratio))

    structure = receptance(20.0, 0.01, 1e5) + receptance(400.0, 0.01, 5e8)
    assert np.abs(structure).max() > 3000 * np.median(np.abs(structure))
    rng = np.random.default_rng(0)
    drift = 3e-5 * (2.0 / frequency) ** 4 * (rng.normal(size=len(frequency)) + 1j)
    for values in (structure, structure + drift):
        clear = clear_of_drift(frequency, values[:, None])
        assert clear[frequency > 17.0].all()
    test = observed(frf_rows(structure + drift, frequency=frequency))
    assert test.modes["frequency_hz"].iloc[0] == pytest.approx(20.0, rel=1e-3)


def test_of_a_free_structure_the_first_mode_is_above_its_mass_line():
    """The receptance of a free mass falls by 1/omega² from the first line on, by far above the first mode."""
    frequency = np.arange(0.25, 1000.0, 0.25)
    ratio = frequency / 112.0
    values = -1.0 / (5.0 * (2 * np.pi * frequency) ** 2) + 1.0 / (2e7 * (1.0 - ratio**2 + 2e-3j * ratio))
    clear = clear_of_drift(frequency, values[:, None])
    assert clear[frequency > 105.0].all()


def test_a_fundamental_of_a_few_lines_is_no_drift():
    frequency = np.arange(1.0, 1001.0)
    ratio, other = frequency / 5.0, frequency / 400.0
    values = 1e-4 / (1 - ratio**2 + 0.02j * ratio) + 2e-9 / (1 - other**2 + 0.02j * other)
    assert np.abs(values).max() > 3000 * np.median(np.abs(values))
    assert clear_of_drift(frequency, values[:, None]).all()


def test_a_line_that_stands_out_of_the_mass_line_does_not_end_the_drift():
    frequency = np.arange(0.25, 1000.0, 0.25)
    ratio = frequency / 112.0
    values = -1.0 / (5.0 * (2 * np.pi * frequency) ** 2) + 1.0 / (2e7 * (1.0 - ratio**2 + 2e-3j * ratio))
    values[20] *= 12.0
    first = frequency[clear_of_drift(frequency, values[:, None])][0]
    assert 10.0 < first < 105.0


def test_where_a_file_has_coherence_it_tells_the_lines():
    frequency = FREQUENCY
    coherence = np.where((frequency > 20.0) & (frequency < 80.0), 0.99, 0.2)
    rows = frf_rows(receptance(0)).assign(coherence=coherence)
    test = observed(rows)
    assert test.used["frequency_hz"].min() == pytest.approx(20.0, abs=0.1)
    assert test.used["frequency_hz"].max() == pytest.approx(80.0, abs=0.1)
    np.testing.assert_allclose(test.modes["frequency_hz"], NATURAL, rtol=1e-6)


def test_frfs_that_end_at_different_lines_are_all_used():
    short = FREQUENCY[:-500]
    test = observed(frf_rows(receptance(0)), frf_rows(receptance(1, frequency=short), "2x", frequency=short))
    assert set(test.used["response"]) == {"1x", "2x"}
    assert len(test.notes) == 1
    assert "the 3597 that all have are fitted" in test.notes[0]


@pytest.mark.parametrize(
    ("highest_hz", "left_out"), [(200.0, "its FRF file"), (1000.0, "its hammer records")]
)
def test_of_a_record_and_a_file_of_one_pair_the_record_is_used_unless_its_band_is_too_narrow(
    highest_hz, left_out
):
    """A hammer that excites less than half of what the files have would take their modes away."""
    record = hits()
    record = record[record["response"] == "1x"]
    frequency = np.arange(10.0, highest_hz, 0.25)
    file = frf_rows(receptance(0, noise=0.002, frequency=frequency), frequency=frequency)
    test = observed(file, hit=record)
    (note,) = [note for note in test.notes if "of the same pair" in note]
    assert note.startswith(f"position 1, 1x to 1x: {left_out}")
    reached = test.used["frequency_hz"].max()
    assert reached > 0.9 * highest_hz if left_out == "its hammer records" else reached < 400.0


def test_an_frf_on_lines_of_its_own_is_named():
    other = FREQUENCY[:-1] + 0.4 * np.diff(FREQUENCY)
    rows = [frf_rows(receptance(i), f"{i + 1}x") for i in (0, 1)]
    test = observed(*rows, frf_rows(receptance(2, frequency=other), "3x", frequency=other))
    assert set(test.used["response"]) == {"1x", "2x"}
    assert test.notes == [
        "position 1, direction x: 1x to 3x: not used, on other lines than the 2 others; export all FRFs with "
        "the same lines"
    ]


def test_records_of_unequal_length_are_all_used():
    table = hits()
    keep = (table["response"] != "2x") | (table["t_s"] < 3.0)
    test = observed(NO_FRF, hit=table[keep])
    assert set(test.used["response"]) == {"1x", "2x", "3x"}
    assert any("shorter than the longest record" in note for note in test.notes)
    np.testing.assert_allclose(test.modes["damping"], ZETA, rtol=0.01)


def test_a_response_across_the_blow_without_one_along_it_is_named():
    test = observed(frf_rows(receptance(0)), frf_rows(receptance(1), "2y", "3x"))
    assert len(test.notes) == 1
    assert test.notes[0].startswith("position 1, 3x to 2y: not used: force and response have different")


def test_one_line_that_stands_out_of_the_noise_by_chance_does_not_open_the_band():
    rng = np.random.default_rng(3)
    frequency = np.arange(0.5, 200.0, 0.5)
    omega = 2 * np.pi * frequency
    mode = 1 / (1 - (frequency / 60) ** 2 + 0.1j * frequency / 60)
    noise = 0.02 + 30 / omega  # of an integrated acceleration
    hits = [mode + noise * (rng.normal(size=len(omega)) + 1j * rng.normal(size=len(omega))) for _ in range(5)]
    hits = np.stack(hits)
    hits[:, 0] = 100.0 + rng.normal(size=5)
    variance = np.var(hits, axis=0, ddof=1)[:, None] / 5
    clear = np.flatnonzero(clear_of_noise(hits.mean(axis=0)[:, None], variance))
    assert 5.0 < frequency[clear[0]] < 60.0
    assert frequency[clear[-1]] > 75.0


def test_a_free_mass_has_no_mode_and_the_note_says_so():
    test = observed(frf_rows(-1e-5 / FREQUENCY**2 + 0j, "2x"))
    assert test.modes.empty
    assert test.alike.empty
    assert test.notes[-1].endswith("no mode is seen in these hits: no pole recurs over the model orders")


def test_a_reversed_sensor_gives_modes_without_stiffness_and_a_note():
    rows = [frf_rows(-receptance(i, noise=0.003, seed=i), f"{i + 1}x") for i in range(3)]
    test = observed(*rows)
    np.testing.assert_allclose(test.modes["frequency_hz"], NATURAL, rtol=1e-3)
    assert test.modes["stiffness_n_m"].isna().all()
    assert not test.modes["used"].any()
    (note,) = test.notes
    assert note.startswith("position 1, direction x: 1x to 1x has the wrong sign in all its modes")
    assert "scale: -1" in note
