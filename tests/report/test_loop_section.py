"""The closed loop in the report: what became of each effect that was tried."""

from metro.report.content import Table
from metro.report.sections.loop import _candidates


def outcomes(**candidate):
    (table,) = _candidates([{"effect": "tool_wear", "verdict": "rejected", **candidate}], "N")
    assert isinstance(table, Table)
    return table.rows[0][-1]


def test_the_outcome_does_not_say_the_p_value_that_has_a_column():
    said = "not significant: p = 0.4 over the identification runs (q = 1 over all effects tried)"
    assert outcomes(p_value=0.4, why_not=said) == "rejected: not significant"
    assert outcomes(why_not=said) == f"rejected: {said}"


def test_any_other_reason_is_given_in_full():
    said = "no better prediction of left-out conditions: gain 1.2, 3 needed"
    assert outcomes(p_value=0.001, why_not=said) == f"rejected: {said}"
