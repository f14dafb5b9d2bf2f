"""What a run of snakemake says, from the records that it logs."""

import io
import logging
import re
from types import SimpleNamespace

import pytest
from rich.console import Console

from metro.batch.alike import alike_as_one
from metro.progress import STREAM, ProgressHandler, show_progress


@pytest.fixture
def said():
    """Return a handler, and the text that it writes to."""
    text = io.StringIO()
    return ProgressHandler(Console(file=text, soft_wrap=True)), text


def tell(handler, event=None, level=logging.INFO, msg="", **told):
    record = logging.LogRecord("snakemake", level, "", 0, msg, None, None)
    vars(record).update(told, **({"event": event} if event else {}))
    handler.handle(record)


def begin(handler, job, words, rule="rule", **wildcards):
    tell(handler, "job_info", jobid=job, rule_msg=words, rule_name=rule, wildcards=wildcards)


def end(handler, job, done, total=12):
    tell(handler, "job_finished", job_id=job)
    tell(handler, "progress", done=done, total=total)


def fail(handler, job, *logs):
    tell(handler, "job_error", logging.ERROR, jobid=job, rule_name="rule", log=list(logs))


def test_a_line_for_each_finished_step(said):
    handler, text = said
    tell(handler, msg="Building DAG of jobs...")
    tell(handler, "run_info", msg="Job stats:\n job count")
    begin(handler, 3, "alpha: reading [the] files")
    assert text.getvalue() == ""
    end(handler, 3, 1)
    end(handler, 7, 2)
    assert text.getvalue().splitlines() == [
        " 1 of 12 steps  alpha: reading [the] files  (0 s)",
        " 2 of 12 steps    (0 s)",
    ]


def test_the_causes_of_failures_come_last_but_not_of_what_went_well_in_the_end(said, tmp_path):
    handler, text = said
    (tmp_path / "a.log").write_text("runs.csv: row 3: found [x]\n")
    for job, words in ((1, "alpha: reading"), (2, "beta: reading")):
        begin(handler, job, words)
        fail(handler, job, tmp_path / "a.log")
    tell(handler, "error", logging.ERROR, 'RuleException:\nCalledProcessError in file "x", line 3')
    begin(handler, 2, "beta: reading")
    end(handler, 2, 1)
    tell(handler, level=logging.ERROR, msg="Exiting because a job execution failed.")
    tell(handler, level=logging.ERROR, msg="At least one job did not complete successfully.")
    handler.close()
    assert [line for line in text.getvalue().splitlines() if line] == [
        "failed: alpha: reading",
        "failed: beta: reading",
        " 1 of 12 steps  beta: reading  (0 s)",
        "At least one job did not complete successfully.",
        "alpha: reading: failed",
        "runs.csv: row 3: found [x]",
        f"({tmp_path / 'a.log'})",
    ]


def test_a_step_without_a_log_is_told_all_the_same(said, tmp_path):
    handler, text = said
    fail(handler, 5, tmp_path / "none.log")
    handler.close()
    assert "its log is empty" in text.getvalue()


@pytest.mark.parametrize(
    "msg", ["Nothing to be done (all is there).", "Group job 1 (alpha) has been submitted with SLURM jobid 4"]
)
def test_what_a_user_wants_to_be_told_is_said(said, msg):
    handler, text = said
    tell(handler, msg=msg)
    assert text.getvalue().strip() == msg


@pytest.mark.parametrize("asked", ["dryrun", "verbose", "debug_dag", "printshellcmds", None])
def test_only_the_handler_of_the_terminal_is_replaced_and_only_in_an_ordinary_run(asked):
    logger, text = logging.Logger("own"), io.StringIO()
    terminal, file = logging.StreamHandler(text), logging.StreamHandler(io.StringIO())
    terminal.name, file.name = STREAM, "DefaultLogFileHandler"
    logger.addHandler(terminal)
    logger.addHandler(file)
    flags = dict.fromkeys(("dryrun", "verbose", "debug_dag", "printshellcmds"), False)
    show_progress(logger, SimpleNamespace(**flags | ({asked: True} if asked else {})))
    assert file in logger.handlers
    assert (terminal in logger.handlers) == bool(asked)
    logger.warning("careful")
    assert text.getvalue() == "careful\n"


@pytest.fixture
def terminal():
    """Return a handler that writes to a terminal, and what it has written since it was last asked."""
    text = io.StringIO()
    handler = ProgressHandler(Console(file=text, soft_wrap=True, force_terminal=True, width=200))
    place = [0]

    def written():
        plain = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text.getvalue()[place[0] :])
        place[0] = len(text.getvalue())
        return plain

    yield handler, written
    handler.close()


def test_the_bar_stands_from_the_first_step_on_and_names_what_is_at_work(terminal):
    handler, written = terminal
    tell(handler, "run_info", msg="Job stats", stats={"ingest": 2, "loop": 1, "campaign": 1, "total": 4})
    assert written() == ""
    begin(handler, 1, "alpha: checking", "ingest", batch="alpha")
    shown = written()
    assert "0 of 4 steps" in shown
    assert "0:00:00" in shown
    assert "alpha: ingest" in shown
    begin(handler, 2, "beta: checking", "ingest", batch="beta")
    begin(handler, 3, "alpha: tracing", "loop", batch="alpha")
    assert "alpha: ingest, beta: ingest and 1 more" in written()
    end(handler, 1, 1, total=4)
    written()
    fail(handler, 2)
    written()
    begin(handler, 4, "the summary", "campaign")
    shown = written()
    assert "1 of 4 steps" in shown
    assert "alpha: loop, summary" in shown
    assert "beta: ingest" not in shown


def test_steps_count_by_the_time_that_they_take(terminal):
    handler, _ = terminal
    tell(handler, "run_info", msg="Job stats", stats={"ingest": 1, "loop": 1, "all": 1, "total": 3})
    begin(handler, 1, "", "ingest", batch="a")
    (bar,) = handler._bar.tasks
    end(handler, 1, 1, total=3)
    after_ingest = bar.percentage
    begin(handler, 2, "", "loop", batch="a")
    end(handler, 2, 2, total=3)
    assert 0 < after_ingest < 10
    assert bar.percentage == 100


def test_a_log_that_says_the_same_of_many_rows_is_told_in_a_line(tmp_path):
    text = io.StringIO()
    handler = ProgressHandler(Console(file=text, soft_wrap=True), alike_as_one)
    lines = [f'runs.csv: row {row} (r{row}): column scan: "s{row}.csv" is not there' for row in range(2, 28)]
    (tmp_path / "a.log").write_text("\n".join(lines))
    begin(handler, 1, "alpha: reading")
    fail(handler, 1, tmp_path / "a.log")
    handler.close()
    assert [line for line in text.getvalue().splitlines() if "runs.csv" in line] == [
        'runs.csv: rows 2–27: column scan: "s2.csv" (and 25 more) is not there'
    ]
