"""Input broken as laboratories break it: refused or flagged, by name, and never read as a number."""

import corpus_all
import corpus_run
import pytest


def wrong_of(cases, kind, folder):
    """Run the cases of a kind of input; return what is wrong, a line each."""
    results = corpus_run.run([case for case in cases if case.kind == kind], folder)
    return "\n".join(f"{result.case.name}: {result.wrong}" for result in results if result.wrong)


@pytest.mark.parametrize("kind", corpus_all.kinds())
def test_every_fault_of_a_file_format_is_told(kind, tmp_path):
    assert not wrong_of(corpus_all.few(), kind, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", corpus_all.kinds())
def test_every_fault_of_a_kind_of_input_is_told(kind, tmp_path):
    assert not wrong_of(corpus_all.cases(), kind, tmp_path)


def test_the_few_cases_leave_out_no_fault_of_a_format_and_no_format_of_a_kind():
    every, few = corpus_all.cases(), corpus_all.few()
    assert {(case.form, case.fault) for case in few} == {(case.form, case.fault) for case in every}
    assert {(case.kind, case.form) for case in few} == {(case.kind, case.form) for case in every}
    assert len(few) < len(every) / 2


def test_the_corpus_is_as_large_as_it_is_said_to_be():
    assert len(corpus_all.cases()) >= 250
