"""What is left over, in words."""

import pytest

from metro.report.phrases import plain, residual_words, sentence


def place(axis, label, relative, excess=None, significant=True):
    return {
        "axis": axis, "label": label, "relative": relative, "excess": excess or 100 * relative,
        "amplitude": 100 * relative, "significant": significant,
    }  # fmt: skip


def test_orders_are_told_by_what_makes_them():
    entries = [
        place("y", "order 3", 0.2),
        place("x", "order 6", 0.1),
        place("x", "order 1", 0.05),
        place("z", "mean", 0.02),
        place("z", "order 4", 0.01),
    ]
    assert residual_words(entries, 3) == (
        "at the tooth passing and its harmonics (orders 3, 6; most along y, 20 % of the signal at order 3); "
        "once per revolution (x 5.0 % of the signal); a constant offset (z 2.0 % of the signal); "
        "between the harmonics of the tooth passing (z 1.0 % of the signal)"
    )


def test_what_changes_along_a_run_is_no_constant_offset():
    told = residual_words(
        [place("z", "mean, along the run", 0.02), place("x", "order 1, once per orbit", 0.01)], 3
    )
    assert told == (
        "the mean, changing along the run (z 2.0 % of the signal); "
        "once per revolution, changing once per orbit (x 1.0 % of the signal)"
    )


def test_what_is_not_significant_is_not_told():
    assert residual_words([place("x", "order 1", 0.5, significant=False)], 3) == ""


def test_axes_stand_in_the_order_of_their_size():
    entries = [place("x", "all", 0.1, 2.0), place("z", "all", 0.7, 9.0)]
    assert residual_words(entries, 0) == "over the whole record (z 70 % and x 10 % of the signal)"


def test_sentences_of_the_verdict_lose_their_jargon():
    told = "order 8 in y (28 % of the signal there); mean in x (2 % of the signal there) and 66 more places"
    assert plain(told) == (
        "8 times per revolution in y (28 %); a constant offset in x (2 %) and smaller parts at 66 more places"
    )
    assert plain(f"repeats spread over the session, to characterise the remaining error: {told}") == (
        "repeats spread over the session, to characterise the remaining error"
    )
    assert plain("a test beside run c08") == "a test beside run c08"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("effects need tests.", "Effects need tests."),
        ("position 1: turned", "Position 1: turned."),
        ("x is the feed", "x is the feed."),
        ("k_x is not known", "k_x is not known."),
    ],
)
def test_a_note_becomes_a_sentence_and_symbols_stay(text, told):
    assert sentence(text) == told


def test_units_are_set_as_in_print():
    assert plain("it can be detected from 12 um/min on") == "it can be detected from 12 µm/min on"
    assert plain("a column thrust_um") == "a column thrust_um"


def test_of_many_kinds_only_the_largest_are_named():
    entries = [place("z", f"wave {k} over the face", 1.0 / (k + 1)) for k in range(30)]
    told = residual_words(entries, 3)
    assert told.startswith("wave 0 over the face (z ")
    assert told.endswith(", and smaller parts of 26 other kinds")
    assert told.count(";") == 3
    assert residual_words(entries[:5], 3).endswith(", and smaller parts of 1 other kind")
    assert "smaller" not in residual_words(entries[:4], 3)
