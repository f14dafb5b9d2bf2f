"""The command line: what people call, and the stage commands that the workflow calls."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from metro import __version__
from metro.commands.completion import batches, effects, observables
from metro.commands.hidden import Style
from metro.commands.project_calls import export, new_batch, run
from metro.commands.stage_calls import campaign, identify, ingest, loop, predict, report, verdict
from metro.watch.call import watch

STAGES = "Stages, in their order (called by snakemake)"


class Readable(TyperGroup):
    """Commands that report an error of the user's making in words: exit code 2 of a wrong call, else 1."""

    def invoke(self, ctx: Any) -> Any:
        """Call the command."""
        try:
            return super().invoke(ctx)
        except Exception as error:
            from metro.batch.findings import ContractError
            from metro.codehash import ChangedCodeError
            from metro.commands.calls import CallError
            from metro.formats import FormatError

            if not isinstance(error, ContractError | FormatError | ChangedCodeError):
                raise
            typer.echo(str(error), err=True)
            raise typer.Exit(2 if isinstance(error, CallError) else 1) from None


app = typer.Typer(
    cls=Readable,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Closed-loop metrology for robotic machining: predict, compare, and trace the residual to its "
    "cause.",
    epilog="`metro run` brings every report up to date. Exit codes: 0 fine, 1 the input or a report is not "
    "as it should be, 2 the call itself is wrong. Tab completion: `metro --install-completion`.",
)

Cells = Annotated[Path, typer.Option(help="Folder of the cells' descriptions (CELL.yaml).")]
Root = Annotated[Path, typer.Option(help="Folder of all batches' canonical tables.")]
Results = Annotated[Path, typer.Option(help="Folder of all batches' results.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]


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


@app.command()
def check(
    folders: Annotated[list[str], typer.Argument(help="Batches: their names, or folders of raw files.")],
    cells: Cells = Path("config/cells"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Look at the tables and the first rows of each file alone.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Check batches against the data contract, before anything is computed.

    Prints what can be computed, what is missing for more, and every error with its file, row and column;
    alike errors of many rows as one. Every file is read as the pipeline reads it, and nothing is changed: a
    batch that passes ends with a report. The exit code is 1 when a batch has an error, 2 when a folder is
    none.

    Example: `metro check data/raw/*`
    """
    from metro.commands.check import check_batches
    from metro.commands.which import holdout
    from metro.stages.contradictions import contradictions
    from metro.stages.whole import check_whole

    one = partial(check_whole, cells=cells, holdout=holdout(), quick=quick, also=contradictions)
    raise typer.Exit(check_batches(folders, one, as_json))


app.command("new-batch")(new_batch)


@app.command("import")
def import_(
    files: Annotated[
        list[Path], typer.Argument(help="Files of any program: records, FRFs, scans, profiles.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="The batch's folder, which must not be there yet: data/raw/NAME.")
    ] = None,
    given: Annotated[
        list[str] | None, typer.Option("--set", "--run-column", help="An answer: KEY=VALUE, unit.force=N.")
    ] = None,
    cells: Cells = Path("config/cells"),
) -> None:
    """Look at files that nobody has described, and make a batch of them.

    Shows columns, units and courses; proposes how the files are read; asks what decides a number and no file
    says, or lists these questions where nobody can answer. Writes the folder with a comment at all that was
    guessed, and checks it.

    Example: `metro import cuts.mat --set unit.force=N --run-column axial_depth_mm={record}`
    """
    from metro.commands.import_files import import_files
    from metro.stages.contradictions import contradictions
    from metro.stages.whole import check_whole

    one = partial(check_whole, cells=cells, also=contradictions)
    raise typer.Exit(import_files(files, out, given or [], one))


@app.command()
def simulate(
    name: Annotated[str, typer.Argument(help="The batch's name: small letters, digits, hyphens.")],
    *,
    kind: Annotated[
        str,
        typer.Option(
            help="What is measured: force, joint_force, deformation, waviness, flatness, lobes; "
            "or study, 72 faces of eight configurations.",
            autocompletion=observables,
        ),
    ] = "force",
    effect: Annotated[
        list[str] | None,
        typer.Option(
            help="An effect to hide: NAME, its size drawn, or NAME:PARAMETER=VALUE,…", autocompletion=effects
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of everything that is drawn.")] = 0,
    style: Annotated[Style, typer.Option(help="How it is measured.")] = Style.a,
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
    write(name, kind=kind, effects=effect or [], seed=seed, style=style, as_json=as_json, **folders)


app.command()(run)


@app.command()
def status(
    snakefile: Annotated[
        Path | None, typer.Option(help="The workflow: of this folder, else of the checkout of metro.")
    ] = None,
    reports: Results = Path("reports"),
    as_json: AsJson = False,
) -> None:
    """Say which batches are up to date, which stages the others need, and every verdict.

    Asks snakemake, in the folder in which it is called; takes seconds and changes nothing.

    Example: `metro status`
    """
    from metro.commands.status import status_command

    status_command(snakefile, reports, as_json)


@app.command()
def explain(
    batch: Annotated[
        str, typer.Argument(help="The batch: its name, or a folder of it.", autocompletion=batches)
    ],
    observable: Annotated[
        str, typer.Argument(help="Only this observable, with all candidates.", autocompletion=observables)
    ] = "",
    processed: Root = Path("data/processed"),
    reports: Results = Path("reports"),
    as_json: AsJson = False,
) -> None:
    """Print what is on the first page of a report: verdicts, causes, what to trust, what to measure next.

    Example: `metro explain kr160-side deformation`
    """
    from metro.commands.explain import explain as explained

    explained(batch, observable, processed, reports, as_json)


@app.command("next")
def next_runs(
    batch: Annotated[
        str, typer.Argument(help="The batch: its name, or a folder of it.", autocompletion=batches)
    ],
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

    They decide between explanations, describe the residual, show effects that these runs cannot reveal, or
    narrow the intervals of parameters. Repeats the search of the loop stage, and takes as long.

    Example: `metro next side-milling-17 --limit axial_depth_mm=0.5:4 --out next.csv`
    """
    from metro.commands.next_runs import at_work, checked_call
    from metro.stages.next_runs import next_runs as plan

    folders = {"processed": processed, "reports": reports}
    name = checked_call(batch, observable, limit or [], **folders)
    with at_work(f"{name}: planning runs, as long as a loop takes"):
        plan(name, observable, most=runs, limits=limit or [], out=out, seed=seed, as_json=as_json, **folders)


app.command()(watch)


@app.command()
def propose(
    batch: Annotated[
        str, typer.Argument(help="The batch: its name, or a folder of it.", autocompletion=batches)
    ],
    *,
    write: Annotated[
        Path | None, typer.Option(help="Write the proposal here, as a draft of an effect with its tests.")
    ] = None,
    processed: Root = Path("data/processed"),
    reports: Results = Path("reports"),
    as_json: AsJson = False,
) -> None:
    """Propose a term for what stays unexplained in the cutting force: formula, parameters, evidence.

    Searches a grammar of terms that physics admits, by the gates of the loop, on identification runs alone.
    Nothing is added to a model: you read the draft, test it, and accept it by installing it.

    Example: `metro propose side-milling-17 --write effects/speed`
    """
    from metro.commands.next_runs import at_work
    from metro.commands.propose import checked_call
    from metro.stages.propose import propose as search

    folders = {"processed": processed, "reports": reports}
    name = checked_call(batch, **folders)
    with at_work(f"{name}: searching for a term, up to a minute"):
        search(name, write=write, as_json=as_json, **folders)


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

    ask(sql, processed, reports, as_json, as_csv)


@app.command()
def verify(
    batch: Annotated[
        list[str] | None,
        typer.Argument(
            help="Batches: their names, or folders of results; all, if none.", autocompletion=batches
        ),
    ] = None,
    raw: Annotated[Path | None, typer.Option(help="Raw files, where not in data/raw/BATCH.")] = None,
    processed: Annotated[
        Path | None, typer.Option(help="Canonical tables, where not in data/processed/BATCH.")
    ] = None,
    config: Annotated[Path, typer.Option(help="The settings in force.")] = Path("config/config.yaml"),
    as_json: AsJson = False,
) -> None:
    """Recompute the hashes from raw files to report, and say what changed since the reports were made.

    The exit code is 1 when a file differs. Other code, settings or packages are listed; they change nothing
    in a report that exists already.

    Example: `metro verify kr160-side`
    """
    from metro.commands.verify import verify_command

    raise typer.Exit(verify_command(batch or [], raw, processed, config, as_json))


app.command()(export)


@app.command("frf-export")
def frf_export(
    batch: Annotated[
        str, typer.Argument(help="The batch: its name, or a folder of it.", autocompletion=batches)
    ],
    out: Annotated[Path, typer.Argument(help="The universal file that is written, e.g. my-batch.uff.")],
    position: Annotated[
        str, typer.Option(help="Position of the tests; needed where there are several.")
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Write a batch's FRFs as a universal file (datasets 58b), for other programs of modal analysis.

    Example: `metro frf-export trimule-helical trimule.uff`
    """
    from metro.commands.which import processed_folder
    from metro.stages.frf_export import frf_export as write

    summary = write(processed_folder(batch), out, position)
    typer.echo(json.dumps({"file": str(out), "told": summary}) if as_json else "\n".join(summary))


for stage in (ingest, identify, predict, loop, verdict, report, campaign):
    app.command(rich_help_panel=STAGES)(stage)
