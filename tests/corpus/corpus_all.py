"""All cases, and the table of them."""

from collections import Counter

import corpus_bytes
import corpus_channels
import corpus_runs
import corpus_tests
import corpus_text
import corpus_values
import corpus_yaml


def cases():
    """Return every case of the corpus; no two of one kind and format have one name."""
    modules = (
        corpus_bytes,
        corpus_text,
        corpus_yaml,
        corpus_runs,
        corpus_values,
        corpus_tests,
        corpus_channels,
    )
    found = [case for module in modules for case in module.cases()]
    twice = [name for name, count in Counter(case.name for case in found).items() if count > 1]
    assert not twice, twice
    return found


def few():
    """Return a case of every fault in every file format, the kinds of input in turn, and one of each
    format of a kind.

    One reader of a format, and one of all tables, serves several kinds: what it refuses of one, it refuses of
    the others.
    """
    alike = {}
    for case in cases():
        alike.setdefault((case.form, case.fault), []).append(case)
    chosen = [some[turn % len(some)] for turn, some in enumerate(alike.values())]
    there = {(case.kind, case.form) for case in chosen}
    lacking = {(case.kind, case.form): case for case in cases() if (case.kind, case.form) not in there}
    return [*chosen, *lacking.values()]


def kinds():
    """Return the kinds of input, in the order of their first case."""
    return list(dict.fromkeys(case.kind for case in cases()))
