"""What a run of snakemake says, from the records that it logs."""

import io
import logging
from types import SimpleNamespace

import pytest
from rich.console import Console

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


def begin(handler, job, words):
    tell(handler, "job_info", jobid=job, rule_msg=words, rule_name="rule")


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
