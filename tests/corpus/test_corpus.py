"""Input broken as laboratories break it: refused or flagged, by name, and never read as a number."""

import corpus_all
import corpus_run
import pytest


@pytest.mark.parametrize("kind", corpus_all.kinds())
def test_every_fault_of_a_kind_of_input_is_told(kind, tmp_path):
    cases = [case for case in corpus_all.cases() if case.kind == kind]
    wrong = [f"{r.case.name}: {r.wrong}" for r in corpus_run.run(cases, tmp_path) if r.wrong]
    assert not wrong, "\n".join(wrong)


def test_the_corpus_is_as_large_as_it_is_said_to_be():
    assert len(corpus_all.cases()) >= 250
