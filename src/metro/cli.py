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
from metro.commands.completion import batches, observables

STAGES = "Stages, in their order (called by snakemake)"

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Closed-loop metrology for robotic machining: predict, compare, trace what is left to its cause.",
    epilog="`snakemake` brings every report up to date. Exit codes: 0 fine, 1 the input or a report is not "
    "as it should be, 2 the call itself is wrong. Tab completion: `metro --install-completion`.",
)

Cells = Annotated[Path, typer.Option(help="Folder of the cells' descriptions (<cell>.yaml).")]
Processed = Annotated[
    Path, typer.Option(help="Folder of the batch's canonical tables.", exists=True, file_okay=False)
]
Reports = Annotated[Path, typer.Option(help="Folder of the batch's results: reports/<batch>.")]
Settings = Annotated[str, typer.Option(help="What config.yaml says to this stage, as JSON.")]
Root = Annotated[Path, typer.Option(help="Folder of all batches' canonical tables.")]
Results = Annotated[Path, typer.Option(help="Folder of all batches' results.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
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
        from metro.codehash import ChangedCodeError
        from metro.formats import FormatError

        if not isinstance(error, ContractError | FormatError | ChangedCodeError):
            raise
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from None


def _run(stage: str, settings: str, code: str, **folders: Any) -> None:
    """Run a stage with the code that the workflow was planned with, or not at all."""
    from metro.batch.at_work import job_at_work
    from metro.codehash import require_code

    with job_at_work(Path.cwd()), readable_errors():
        require_code(stage, code)
        function = getattr(import_module(f"metro.stages.{stage}"), stage)
        function(**folders, settings=json.loads(settings), code=code)


@app.command()
def check(
    folders: Annotated[list[Path], typer.Argument(help="Batch folders, e.g. data/raw/my-batch.")],
    cells: Cells = Path("config/cells"),
    as_json: AsJson = False,
) -> None:
    """Check batches against the data contract, before anything is computed.

    Prints what is there, what can be computed from it, what is missing for the rest, and every error with its
    file, row and column. Takes seconds and changes nothing. The exit code is 1 when a batch has an error.

    Example: `metro check data/raw/*`
    """
    if as_json:
        from metro.commands.check import check_as_json

        raise typer.Exit(check_as_json(folders, cells))
    from metro.batch.check import check_command

    raise typer.Exit(max(check_command(folder, cells) for folder in folders))


@app.command("new-batch")
def new_batch(
    name: Annotated[str, typer.Argument(help="The batch's name: small letters, digits, hyphens.")],
    root: Annotated[Path, typer.Option(help="Where the batch's folder is made.")] = Path("data/raw"),
    as_json: AsJson = False,
) -> None:
    """Write a commented template of a batch, to be filled in with your measurement.

    Example: `metro new-batch side-milling-17`
    """
    from metro.batch.template import new_batch as write

    with readable_errors():
        folder = write(root, name)
        if as_json:
            typer.echo(json.dumps({"batch": name, "folder": str(folder)}))
            return
        typer.echo(f"{folder} is there. Fill it in, then call: metro check {folder}")


@app.command()
def simulate(
    name: Annotated[str, typer.Argument(help="The batch's name: small letters, digits, hyphens.")],
    *,
    kind: Annotated[
        str,
        typer.Option(
            help="What is measured: force, joint_force, deformation, waviness, flatness, lobes.",
            autocompletion=observables,
        ),
    ] = "force",
    effect: Annotated[
        list[str] | None,
        typer.Option(help="An effect to hide: NAME, its size drawn, or NAME:PARAMETER=VALUE,…"),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of everything that is drawn.")] = 0,
    style: Annotated[str, typer.Option(help="How it is measured: a or b.")] = "a",
    root: Annotated[Path, typer.Option(help="Where the batch's folder is made.")] = Path("data/raw"),
    truth: Annotated[Path, typer.Option(help="Folder for the file that says what is hidden.")] = Path(
        "truth"
    ),
    as_json: AsJson = False,
) -> None:
    """Write a batch of the virtual cell, in which effects of your choice are hidden, to try everything on.

    Example: `metro simulate try-1 --effect tool_runout:radius_um=12,angle_deg=40 --seed 3`
    """
    from metro.commands.simulate import simulate as write

    folders = {"root": root, "truth": truth}
    with readable_errors():
        write(name, kind=kind, effects=effect or [], seed=seed, style=style, as_json=as_json, **folders)


@app.command()
def status(
    snakefile: Annotated[Path, typer.Option(help="The workflow.")] = Path("Snakefile"),
    reports: Results = Path("reports"),
    as_json: AsJson = False,
) -> None:
    """Say which batches are up to date, which stages the others need, and every verdict.

    Asks snakemake, in the folder in which it is called; takes seconds and changes nothing.

    Example: `metro status`
    """
    from metro.commands.status import status_command

    with readable_errors():
        status_command(snakefile, reports, as_json)


@app.command()
def explain(
    batch: Annotated[str, typer.Argument(help="Name of the batch.", autocompletion=batches)],
    observable: Annotated[
        str, typer.Argument(help="Only this observable, with all candidates.", autocompletion=observables)
    ] = "",
    processed: Root = Path("data/processed"),
    reports: Results = Path("reports"),
    as_json: AsJson = False,
) -> None:
    """Tell what the first page of a batch's report tells: verdicts, errors, candidates, what to measure next.

    Example: `metro explain kr160-side deformation`
    """
    from metro.commands.explain import explain as tell

    with readable_errors():
        tell(batch, observable, processed, reports, as_json)


@app.command("next")
def next_runs(
    batch: Annotated[str, typer.Argument(help="Name of the batch.", autocompletion=batches)],
    *,
    observable: Annotated[str, typer.Option(help="Only this observable.", autocompletion=observables)] = "",
    runs: Annotated[int, typer.Option(min=1, help="Most runs, per observable.")] = 12,
    limit: Annotated[list[str] | None, typer.Option(help="What may be set: COLUMN=LOW:HIGH.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the runs here, as rows of a runs.csv.")] = None,
    seed: Annotated[int, typer.Option(help="Of the order in which the runs are cut.")] = 0,
    processed: Root = Path("data/processed"),
    reports: Results = Path("reports"),
    as_json: AsJson = False,
) -> None:
    """Plan the few runs that would decide what a batch leaves open, in an order drawn at random.

    They tell apart what is undetermined, describe what is left, show what cannot be seen, or tighten what
    makes predictions unsure. Repeats the search of the loop stage, and takes as long.

    Example: `metro next side-milling-17 --limit axial_depth_mm=0.5:4 --out next.csv`
    """
    from metro.stages.next_runs import next_runs as plan

    folders = {"processed": processed, "reports": reports}
    with readable_errors():
        plan(batch, observable, most=runs, limits=limit or [], out=out, seed=seed, as_json=as_json, **folders)


@app.command()
def query(
    sql: Annotated[
        str, typer.Argument(help="One SELECT (DuckDB's SQL); without it, the views are listed.")
    ] = "",
    processed: Root = Path("data/processed"),
    reports: Results = Path("reports"),
    as_json: AsJson = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print comma-separated values.")] = False,
) -> None:
    """Ask all batches at once, with SQL over their tables, identified quantities, effects and verdicts.

    Example: `metro query "SELECT batch, effect, parameter, value, lo, hi FROM effects"`
    """
    from metro.commands.query import query as ask

    with readable_errors():
        ask(sql, processed, reports, as_json, as_csv)


@app.command()
def verify(
    reports: Annotated[
        Path, typer.Argument(help="The batch's results: reports/<batch>.", exists=True, file_okay=False)
    ],
    raw: Annotated[Path | None, typer.Option(help="Raw files, where not in data/raw/<batch>.")] = None,
    processed: Annotated[
        Path | None, typer.Option(help="Canonical tables, where not in data/processed/<batch>.")
    ] = None,
    config: Annotated[Path, typer.Option(help="The settings in force.")] = Path("config/config.yaml"),
    as_json: AsJson = False,
) -> None:
    """Recompute the hashes from raw files to report, and say what changed since the report was made.

    The exit code is 1 when a file differs. Other code, settings or packages are told; they change nothing in
    a report that is there.

    Example: `metro verify reports/kr160-side`
    """
    from metro.commands.verify import verify_command

    with readable_errors():
        raise typer.Exit(verify_command(reports, raw, processed, config, as_json))


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
    as_json: AsJson = False,
) -> None:
    """Write a batch's FRFs as a universal file (datasets 58b), for other programs of modal analysis.

    Example: `metro frf-export data/processed/trimule-helical trimule.uff`
    """
    from metro.stages.frf_export import frf_export as write

    with readable_errors():
        told = write(processed, out, position)
        typer.echo(json.dumps({"file": str(out), "told": told}) if as_json else "\n".join(told))


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
    *,
    reports: Annotated[
        list[Path] | None, typer.Argument(help="The batches' result folders.", exists=True, file_okay=False)
    ] = None,
    processed: Annotated[
        Path, typer.Option(help="Folder that holds the batches' canonical tables: data/processed.")
    ],
    out: Annotated[Path, typer.Option(help="Folder that the summary is written to.")],
    unfinished: Annotated[
        list[str] | None, typer.Option(help="A batch that failed, and the log that says why: BATCH=LOG.")
    ] = None,
    settings: Settings,
    code: Code,
) -> None:
    """Summarise all batches: one PDF, one table, and what became of parameters from batch to batch."""
    logs = dict(each.split("=", 1) for each in unfinished or [])
    _run("campaign", settings, code, reports=reports or [], processed=processed, out=out, unfinished=logs)
