"""Recorded KUKA RSI telegrams: dropped, late, repeated and torn ones, and what is wrong with a recording."""

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.registry import read, sniff
from metro.signals.quality import sampling

AXES = range(1, 7)


def element(tag, values):
    return f"<{tag} " + " ".join(f'A{i}="{value}"' for i, value in zip(AXES, values, strict=True)) + "/>"


def telegram(cycle, torque="GearTorque", delay=0, start=4000):
    """The telegram of an interpolation cycle of 4 ms; every value tells its cycle and its axis."""
    actual = [f"{10 * i + cycle / 1000:.6f}" for i in AXES]
    commanded = [f"{10 * i + cycle / 1000 + 0.5:.6f}" for i in AXES]
    torques = [f"{-100 * i - cycle:.6f}" for i in AXES]
    pose = '<RIst X="1250.5" Y="-10.25" Z="1000.0" A="1.5" B="90.0" C="-45.5"/>'
    angles = element("AIPos", actual) + element("ASPos", commanded)
    last = f'<Delay D="{delay}"/><IPOC>{start + 4 * cycle}</IPOC>'
    return f'<Rob Type="KUKA">{pose}{angles}{element(torque, torques)}{last}</Rob>'


def recorded(tmp_path, telegrams, between="\n", name="log.rsi"):
    path = tmp_path / name
    path.write_text(between.join(telegrams))
    return path


def notes(table):
    return {note.check: note for note in table.attrs["notes"]}


def failure(path, call=read):
    with pytest.raises(FormatError) as caught:
        call(path, "robot")
    assert caught.value.path == path
    return caught.value.message


@pytest.mark.parametrize(
    "between", ["\n", "", "\r\n", "\n12:00:00.123 \n", '<Sen Type="x"><IPOC>1</IPOC></Sen>']
)
@pytest.mark.parametrize("name", ["log.rsi", "log.xml", "log.txt"])
def test_telegrams_become_a_robot_log_whatever_stands_between_them(tmp_path, between, name):
    path = recorded(tmp_path, [telegram(k) for k in range(50)], between, name)
    sniff(path, "robot")
    table, cycle = read(path, "robot"), np.arange(50)
    np.testing.assert_allclose(table["t_s"], 4.0 + 0.004 * cycle, rtol=1e-15)
    for i in AXES:
        np.testing.assert_allclose(table[f"q{i}_deg"], 10 * i + cycle / 1000, rtol=1e-14)
        np.testing.assert_allclose(table[f"q{i}_set_deg"], 10 * i + cycle / 1000 + 0.5, rtol=1e-14)
        np.testing.assert_array_equal(table[f"tau{i}_nm"], -100.0 * i - cycle)
    assert table.attrs["notes"] == []


@pytest.mark.parametrize("joints", [4, 7])
def test_an_arm_has_as_many_axes_as_the_first_telegram(tmp_path, joints):
    def axes(text, tag):
        start, end = text.index(f"<{tag} "), text.index("/>", text.index(f"<{tag} "))
        values = " ".join(f'A{i}="{i}"' for i in range(1, joints + 1))
        return f"{text[:start]}<{tag} {values}{text[end:]}"

    telegrams = [telegram(k) for k in range(20)]
    for tag in ("AIPos", "ASPos", "GearTorque"):
        telegrams = [axes(text, tag) for text in telegrams]
    table = read(recorded(tmp_path, telegrams), "robot")
    assert len(table.columns) == 1 + 3 * joints
    np.testing.assert_array_equal(table[f"q{joints}_set_deg"], float(joints))


def test_a_telegram_may_spread_over_lines(tmp_path):
    path = recorded(tmp_path, [telegram(k).replace("><", ">\n  <") for k in range(9)])
    assert len(read(path, "robot")) == 9


def test_dropped_telegrams_stay_gaps_in_time_and_the_quality_check_counts_them(tmp_path):
    kept = [k for k in range(60) if k not in (7, 8, 9, 30)]
    table = read(recorded(tmp_path, [telegram(k) for k in kept]), "robot")
    np.testing.assert_allclose(table["t_s"], 4.0 + 0.004 * np.array(kept), rtol=1e-15)
    gaps = next(finding for finding in sampling(table["t_s"].to_numpy(), 250.0) if finding.check == "gaps")
    assert not gaps.ok
    assert gaps.message.startswith("2 gaps, the longest 16 ms, 4 samples missing")


def test_late_telegrams_are_put_in_order_and_counted(tmp_path):
    order = list(range(40))
    order[10], order[11], order[12] = 12, 10, 11
    order[30], order[31] = 31, 30
    table = read(recorded(tmp_path, [telegram(k) for k in order]), "robot")
    np.testing.assert_array_equal(table["tau1_nm"], -100.0 - np.arange(40))
    note = notes(table)["late packets"]
    assert (note.value, note.ok) == (3, True)
    assert "by up to 8 ms" in note.message


def test_repeated_telegrams_are_left_out_and_counted(tmp_path):
    order = [*range(20), 19, 5]
    table = read(recorded(tmp_path, [telegram(k) for k in order]), "robot")
    np.testing.assert_array_equal(table["tau1_nm"], -100.0 - np.arange(20))
    assert notes(table)["repeated packets"].value == 2


def test_torn_telegrams_are_lost_and_counted_and_their_neighbours_are_not(tmp_path):
    telegrams = [telegram(k) for k in range(30)]
    telegrams[4] = telegrams[4][:150]
    telegrams[9] = telegrams[9].replace("<ASPos", "<ASP\x00")
    telegrams[29] = telegrams[29][:-3]
    for between in ("\n", ""):
        table = read(recorded(tmp_path, telegrams, between), "robot")
        kept = [k for k in range(30) if k not in (4, 9, 29)]
        np.testing.assert_array_equal(table["tau1_nm"], -100.0 - np.array(kept))
        note = notes(table)["torn packets"]
        assert (note.value, note.ok) == (3, False)


def test_late_answers_that_the_controller_counted_are_noted(tmp_path):
    table = read(recorded(tmp_path, [telegram(k, delay=k // 10) for k in range(50)]), "robot")
    note = notes(table)["late answers"]
    assert (note.value, note.ok) == (4, False)


def test_motor_currents_are_taken_as_they_stand_and_that_is_noted(tmp_path):
    table = read(recorded(tmp_path, [telegram(k, "MACur") for k in range(9)]), "robot")
    np.testing.assert_array_equal(table["tau2_nm"], -200.0 - np.arange(9))
    assert not notes(table)["torque unit"].ok
    both = [telegram(k).replace("<Delay", element("MACur", [1] * 6) + "<Delay") for k in range(9)]
    table = read(recorded(tmp_path, both), "robot")
    assert table["tau2_nm"][8] == -208.0
    assert "torque unit" not in notes(table)


def without(text, tag):
    start = text.index(f"<{tag} ")
    return text[:start] + text[text.index("/>", start) + 2 :]


@pytest.mark.parametrize(
    ("spoil", "parts"),
    [
        (
            lambda t: [without(x, "ASPos") for x in t],
            ["telegram 1 on line 1", "lacks the element ASPos", "found"],
        ),
        (
            lambda t: [without(x, "GearTorque") for x in t],
            ["lacks the element GearTorque or Torque or MACur", "AIPos"],
        ),
        (
            lambda t: [*t[:5], t[5].replace('A3="30.005000"', 'A3="3o"'), *t[6:]],
            ["telegram 6 on line 6, column q3_deg", "'3o'", "a number"],
        ),
        (
            lambda t: [*t[:-1], t[-1].replace('A3="', 'B3="')],
            ["telegram 20 on line 20, column q3_deg", "nothing or NaN in the last row", "a finite number"],
        ),
        (
            lambda t: [without(x, "AIPos") if k % 3 else x for k, x in enumerate(t)],
            ["telegram 2 on line 2, column q1_deg", "nothing", "13 of 20 rows", "rate of the slowest"],
        ),
        (
            lambda t: [x.replace("<IPOC>4012", "<IPOC>soon") for x in t],
            ["telegram 4 on line 4, IPOC", "'soon'", "whole milliseconds"],
        ),
        (
            lambda t: [*t, telegram(0, start=10)],
            ["telegram 21 on line 21", "found IPOC 10 after 4076", "1 s at most", "two starts"],
        ),
        (
            lambda t: [*t, t[3].replace('A3="-303', 'A3="-99')],
            ["telegram 21", "found IPOC 4012 a second time with other values", "one packet per stamp"],
        ),
        (lambda t: [x[:-6] for x in t], ["no whole telegram <Rob …>…</Rob>", "20 torn", "a robot log"]),
        (lambda t: t[:5], ["found 5 rows", "at least 8"]),
    ],
)
def test_what_is_wrong_with_a_recording_is_said_with_its_place(tmp_path, spoil, parts):
    message = failure(recorded(tmp_path, spoil([telegram(k) for k in range(20)])))
    assert [part for part in parts if part not in message] == []


def test_the_place_of_a_fault_is_that_in_the_file_also_where_telegrams_were_put_in_order(tmp_path):
    telegrams = [telegram(k) for k in (*range(10), 11, 10, *range(12, 20))]
    telegrams[11] = telegrams[11].replace("<AIPos", "<AIPos2")
    table = read(recorded(tmp_path, telegrams), "robot")
    late, lost = table.attrs["notes"]
    assert (late.check, lost.check, lost.value, lost.ok) == ("late packets", "missing values", 1.0, False)
    assert "telegram 12 on line 12, column q1_deg" in lost.message
    np.testing.assert_allclose(np.diff(table["t_s"])[[8, 9, 10]], [0.004, 0.008, 0.004])


def test_another_xml_file_is_not_a_recording(tmp_path):
    path = recorded(tmp_path, ["<profile/>"], name="log.xml")
    assert "does not start as a KUKA RSI recording" in failure(path)


def test_a_recording_is_a_robot_log_and_nothing_else(tmp_path):
    path = recorded(tmp_path, [telegram(k) for k in range(9)])
    with pytest.raises(FormatError, match="found a KUKA RSI recording file, expected a force record"):
        read(path, "force")


def test_sniff_does_not_read_on(tmp_path):
    spoilt = [telegram(k) for k in range(60)]
    spoilt[50] = spoilt[50].replace('A3="', 'A3="x')
    sniff(recorded(tmp_path, spoilt), "robot")
    spoilt[5] = spoilt[50]
    assert "expected a number" in failure(recorded(tmp_path, spoilt), sniff)
