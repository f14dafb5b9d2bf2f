"""Findings that differ only in their row are told as one."""

from metro.batch.alike import alike_as_one


def missing(row, file="r"):
    return f'runs.csv: row {row} (r{row}): column dynamometer: "force/{file}{row}.csv" is not there'


def test_many_rows_are_one_line_with_their_ranges_and_the_first_of_what_is_quoted():
    assert alike_as_one([missing(row) for row in (2, 3, 4, 9)]) == [
        'runs.csv: rows 2–4, 9: column dynamometer: "force/r2.csv" (and 3 more) is not there'
    ]


def test_what_is_the_same_in_every_row_is_not_said_to_be_more():
    lines = [f'runs.csv: row {row}: column pose: found "x", expected 1' for row in (5, 2, 3, 4)]
    assert alike_as_one(lines) == ['runs.csv: rows 2–5: column pose: found "x", expected 1']


def test_a_few_are_written_out():
    lines = [missing(row) for row in (2, 3, 4)]
    assert alike_as_one(lines) == lines


def test_other_files_columns_and_words_stay_apart_each_where_its_first_stood():
    other = [f"impacts.csv: row {row}: column file: found nothing" for row in range(2, 8)]
    lines = [
        "batch.yaml: line 3: tool: is missing",
        *(missing(row) for row in range(2, 8)),
        *other,
        "",
        "Traceback",
    ]
    assert alike_as_one(lines) == [
        "batch.yaml: line 3: tool: is missing",
        'runs.csv: rows 2–7: column dynamometer: "force/r2.csv" (and 5 more) is not there',
        "impacts.csv: rows 2–7: column file: found nothing",
        "",
        "Traceback",
    ]


def test_numbers_that_differ_outside_quotes_are_not_alike():
    lines = [f"runs.csv: row {row}: column order: found {row}" for row in range(2, 8)]
    assert alike_as_one(lines) == lines
