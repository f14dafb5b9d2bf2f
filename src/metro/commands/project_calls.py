"""Commands as they are declared: to begin a batch, to run the workflow, and to hand on what it gave."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from metro.commands.completion import batches


def new_batch(
    name: Annotated[str, typer.Argument(help="The batch's name: small letters, digits, hyphens.")],
    root: Annotated[Path, typer.Option(help="Where the batch's folder is made.")] = Path("data/raw"),
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
) -> None:
    """Write a commented template of a batch, to be filled in with your measurement.

    Example: `metro new-batch side-milling-17`
    """
    from metro.batch.template import new_batch as write
    from metro.commands.calls import require_name

    require_name(name)
    folder = write(root, name)
    if as_json:
        typer.echo(json.dumps({"batch": name, "folder": str(folder)}))
        return
    typer.echo(f"{folder} is there. Fill it in, then call: metro check {folder}")


def run(
    batch: Annotated[
        list[str] | None, typer.Argument(help="Batches: their names, or folders of raw files; all, if none.")
    ] = None,
    *,
    snakefile: Annotated[
        Path | None, typer.Option(help="The workflow: of this folder, else the one that came with metro.")
    ] = None,
    cores: Annotated[int, typer.Option(min=0, help="Cores to use; 0: all.")] = 0,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would run.")] = False,
) -> None:
    """Bring reports up to date in any folder that has batches in data/raw.

    Calls snakemake with the workflow that came with metro: the folder needs no Snakefile and no settings.

    Example: `metro run side-milling-17`
    """
    from metro.commands.run import run as call

    raise typer.Exit(call(batch or [], snakefile, cores, dry_run))


def export(
    batch: Annotated[
        str, typer.Argument(help="The batch: its name, or a folder of it.", autocompletion=batches)
    ],
    out: Annotated[Path, typer.Option(help="The folder of the crate, or the XML file.")],
    *,
    form: Annotated[
        str, typer.Option("--as", help="ro-crate: the whole run, as a folder; d-si: the quantities, as XML.")
    ] = "ro-crate",
    processed: Annotated[Path, typer.Option(help="Folder of all batches' canonical tables.")] = Path(
        "data/processed"
    ),
    reports: Annotated[Path, typer.Option(help="Folder of all batches' results.")] = Path("reports"),
) -> None:
    """Export a batch for other programs: the run as an RO-Crate, or its quantities as D-SI.

    The crate follows the profile Workflow Run Crate 0.5 and holds raw files, report and workflow. D-SI is
    what digital calibration certificates embed.

    Example: `metro export kr160-side --out kr160-side.crate`
    """
    from metro.commands.export import export as write

    typer.echo(write(batch, form, out, processed, reports))
