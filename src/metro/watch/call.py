"""How ``metro watch`` is called: its options and its help; nothing heavy is imported before it is called."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def watch(
    folder: Annotated[str, typer.Argument(help="The batch: its folder of raw files, or its name.")],
    *,
    once: Annotated[bool, typer.Option("--once", help="Judge the files that are there, and end.")] = False,
    page: Annotated[
        bool, typer.Option("--page", help="Write reports/BATCH/watch.html too, which reloads itself.")
    ] = False,
    processed: Annotated[Path, typer.Option(help="Folder of all batches' canonical tables.")] = Path(
        "data/processed"
    ),
    reports: Annotated[Path, typer.Option(help="Folder of all batches' results.")] = Path("reports"),
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
) -> None:
    """Judge new files of a finished batch, each as soon as it is complete.

    A force record that a row of runs.csv names is compared with the batch's model: it is as predicted, or it
    is said by how much it differs, what that looks like, and whether to go on. Other files are checked. What
    was judged is kept in reports/BATCH/watch.json. The exit code of --once is 1 where a file differs or
    cannot be used.

    Example: `metro watch data/raw/side-milling-17 --page`
    """
    from metro.watch.command import watch as watch_folder

    raise typer.Exit(watch_folder(folder, processed, reports, once=once, page=page, as_json=as_json))
