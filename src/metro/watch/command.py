"""``metro watch``: the loop around the looks, and what it prints."""

from __future__ import annotations

import json
import time
from pathlib import Path

import typer

from metro.commands.which import raw_folder
from metro.watch.arrivals import POLL_S
from metro.watch.judgement import Judgement
from metro.watch.page import write_page
from metro.watch.watcher import Watcher

EARLIER = 5  # judgements of an earlier watch that are shown when it begins again


def watch(
    folder: str, processed: Path, reports: Path, *, once: bool, page: bool, as_json: bool = False
) -> int:
    """Watch a batch folder until the user stops it; return the exit code.

    Parameters
    ----------
    folder : of raw files, or the batch's name. processed, reports : folders of all batches.
    once : judge what is there, and end. page : write ``watch.html`` beside the report.

    Returns
    -------
    code : 1 where a file that was judged now differs or cannot be used, else 0.
    """
    raw = raw_folder(folder)
    name = raw.resolve().name
    watcher = Watcher(raw, processed / name, reports / name)
    earlier = watcher.journal.judgements
    if page:
        path = write_page(reports / name, name, earlier)
        _note(f"Page: {path}", as_json)
    code = 0
    try:
        if not once:
            for each in earlier[-EARLIER:]:
                _note(f"Judged before: {line(each)}", as_json)
            _note(_beginning(watcher, raw), as_json)
        while True:
            for each in watcher.look():
                typer.echo(json.dumps(each.content, ensure_ascii=False) if as_json else in_words(each))
                code |= int(each.status in ("differs", "error"))
                if page:
                    write_page(reports / name, name, watcher.journal.judgements)
            if once and not watcher.waiting:
                break
            time.sleep(POLL_S)
    except KeyboardInterrupt:
        _note("Stopped; the next call goes on from here.", as_json)
    return code


def line(one: Judgement) -> str:
    """Return the first line on a file."""
    run = f" ({one.run})" if one.run else ""
    return f"{one.at[11:19]}  {one.file}{run}: {one.headline}. {one.advice}".rstrip()


def in_words(one: Judgement) -> str:
    """Return the line on a file and its reasons."""
    return "\n".join([line(one), *(f"          {reason}" for reason in one.reasons)])


def _beginning(watcher: Watcher, raw: Path) -> str:
    force = watcher.done.force
    if force is None:
        return f"Watching {raw}; force records are not compared: {watcher.done.lacking}."
    effects = ", ".join(each.name.replace("_", " ") for each in force.fitted.candidate.effects)
    model = f"the force model with {effects}" if effects else "the force model"
    return f"Watching {raw}; new records are compared with {model}. Stop with Ctrl-C."


def _note(text: str, as_json: bool) -> None:
    """Print what is no judgement, where a program would not take it for one."""
    typer.echo(text, err=as_json)
