"""The command line: what people call, and the stage commands that the workflow calls."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from metro import __version__
from metro.codehash import ChangedCodeError, require_code

STAGES = "Stages, in their order (called by snakemake)"

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Closed-loop metrology for robotic machining: predict, compare, trace what is left to its cause.",
    epilog="`snakemake` brings every report up to date; these commands look at one batch.",
)

Cells = Annotated[Path, typer.Option(help="Folder of the cells' descriptions (<cell>.yaml).")]
Processed = Annotated[
    Path, typer.Option(help="Folder of the batch's canonical tables.", exists=True, file_okay=False)
]
Reports = Annotated[Path, typer.Option(help="Folder of the batch's results: reports/<batch>.")]
Settings = Annotated[str, typer.Option(help="What config.yaml says to this stage, as JSON.")]
Code = Annotated[str, typer.Option(help="Hash of the code that the workflow was planned with.")]


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f"metro {__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Hold the options that come before the command."""


@contextmanager
def readable_errors() -> Iterator[None]:
    """Print an error of the user's making as one block without a traceback, and exit with code 1."""
    try:
        yield
    except Exception as error:
        from metro.batch.findings import ContractError
        from metro.formats import FormatError

        if not isinstance(error, ContractError | FormatError | ChangedCodeError):
            raise
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from None


def _run(stage: str, settings: str, code: str, **folders: Any) -> None:
    """Run a stage with the code that the workflow was planned with, or not at all."""
    with readable_errors():
        require_code(stage, code)
        function = getattr(import_module(f"metro.stages.{stage}"), stage)
        function(**folders, settings=json.loads(settings), code=code)


@app.command()
def check(
    folders: Annotated[list[Path], typer.Argument(help="Batch folders, e.g. data/raw/my-batch.")],
    cells: Cells = Path("config/cells"),
) -> None:
    """Check batches against the data contract, before anything is computed.

    Prints what is there, what can be computed from it, what is missing for the rest, and every error with its
    file, row and column. Takes seconds and changes nothing. The exit code is 1 when a batch has an error.
    """
    from metro.batch.check import check_command

    raise typer.Exit(max(check_command(folder, cells) for folder in folders))


@app.command("new-batch")
def new_batch(
    name: Annotated[str, typer.Argument(help="The batch's name: small letters, digits, hyphens.")],
    root: Annotated[Path, typer.Option(help="Where the batch's folder is made.")] = Path("data/raw"),
) -> None:
    """Write a commented template of a batch, to be filled in with your measurement."""
    from metro.batch.template import new_batch as write

    with readable_errors():
        folder = write(root, name)
        typer.echo(f"{folder} is there. Fill it in, then call: metro check {folder}")


@app.command("frf-export")
def frf_export(
    processed: Annotated[
        Path,
        typer.Argument(
            help="The batch's canonical tables: data/processed/<batch>.", exists=True, file_okay=False
        ),
    ],
    out: Annotated[Path, typer.Argument(help="The universal file that is written, e.g. my-batch.uff.")],
    position: Annotated[
        str, typer.Option(help="Position of the tests; needed where there are several.")
    ] = "",
) -> None:
    """Write a batch's FRFs as a universal file (datasets 58b), for other programs of modal analysis."""
    from metro.stages.frf_export import frf_export as write

    with readable_errors():
        typer.echo("\n".join(write(processed, out, position)))


@app.command(rich_help_panel=STAGES)
def ingest(
    folder: Annotated[Path, typer.Argument(help="The batch's folder.", exists=True, file_okay=False)],
    cells: Cells,
    out: Annotated[Path, typer.Option(help="Folder that the canonical tables are written to.")],
    settings: Settings,
    code: Code,
) -> None:
    """Check and read a batch's raw files; write canonical tables with one frame, one sign, named units."""
    _run("ingest", settings, code, folder=folder, cells=cells, out=out)


@app.command(rich_help_panel=STAGES)
def identify(processed: Processed, settings: Settings, code: Code) -> None:
    """Identify the models from the identification runs: force coefficients, modes, stiffness."""
    _run("identify", settings, code, processed=processed)


@app.command(rich_help_panel=STAGES)
def predict(processed: Processed, settings: Settings, code: Code) -> None:
    """Predict with the base models what was measured on the held-out runs."""
    _run("predict", settings, code, processed=processed)


@app.command(rich_help_panel=STAGES)
def loop(processed: Processed, reports: Reports, settings: Settings, code: Code) -> None:
    """Trace what the prediction leaves over to its causes, and say how far each explains it."""
    _run("loop", settings, code, processed=processed, reports=reports)


@app.command(rich_help_panel=STAGES)
def report(processed: Processed, reports: Reports, settings: Settings, code: Code) -> None:
    """Write the batch's report as PDF."""
    _run("report", settings, code, processed=processed, reports=reports)


@app.command(rich_help_panel=STAGES)
def campaign(
    reports: Annotated[
        list[Path], typer.Argument(help="The batches' result folders.", exists=True, file_okay=False)
    ],
    out: Annotated[Path, typer.Option(help="Folder that the summary is written to.")],
    settings: Settings,
    code: Code,
) -> None:
    """Summarise all batches: one PDF and one table."""
    _run("campaign", settings, code, reports=reports, out=out)
