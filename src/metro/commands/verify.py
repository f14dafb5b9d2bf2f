"""``metro verify``: whether a report is still that of the files, code and settings that are here now."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from metro.batch import provenance
from metro.batch.cell import read_cell, stations_path
from metro.batch.discover import batch_files
from metro.batch.findings import ContractError, Finding
from metro.batch.provenance import Difference, compare, hashes, made_by, processed_hashes, sha256
from metro.codehash import code_hash
from metro.commands.calls import wrong_call
from metro.commands.output import print_json
from metro.commands.which import PROCESSED, RAW, REPORTS, REPORTS_FILE, names, raw_roots, reports_folder
from metro.units import JSON
from metro.workflow import Plan

RECORDED = {"raw", "processed", "results", "stages", "metro", "python", "packages"}
# Files that are part of a batch by their name alone: nothing has to name them.
BY_NAME = {
    f"{stem}{suffix}"
    for stem in ("runs", "impacts", "loads", "mass", "touches", "payload", "published", "cell")
    for suffix in (".csv", ".parquet", ".yaml")
}


def verify_command(
    given: Sequence[str], raw: Path | None, processed: Path | None, config: Path, as_json: bool
) -> int:
    """Print what changed since reports were made; return the exit code, 1 where a file differs.

    Parameters
    ----------
    given : batches, each by its name or a folder of it; none: all that have results.
    raw, processed : folders of one batch, where they are not in the usual places.
    """
    import typer

    if len(given) != 1 and (raw or processed):
        raise wrong_call("--raw" if raw else "--processed", "is the folder of one batch: name that batch")
    all_of_them = given or [str(REPORTS / name) for name in names([REPORTS], REPORTS_FILE)]
    if not all_of_them:
        raise ContractError([Finding("error", str(REPORTS), "holds no results yet: call metro run")])
    folders = [reports_folder(one) for one in all_of_them]  # a wrong name before anything is computed
    contents: list[JSON] = []
    for folder in folders:
        try:
            contents.append(_compared(folder, raw, processed, config))
        except ContractError as error:
            if len(folders) == 1:
                raise
            contents.append({"batch": folder.resolve().name, "unchanged": False, "error": str(error)})
    if as_json:
        print_json(contents[0] if len(given) == 1 else contents)
    else:
        for folder, content in zip(folders, contents, strict=True):
            typer.echo("\n".join(_lines(folder, content)))
    return int(not all(content["unchanged"] for content in contents))


def _compared(reports: Path, raw: Path | None, processed: Path | None, config: Path) -> JSON:
    """Return what became of one report, in the form for programs."""
    name = reports.resolve().name
    raw = raw or next((root / name for root in raw_roots(config) if (root / name).is_dir()), RAW / name)
    made, differences = verify(reports, raw, processed or PROCESSED / name, config)
    return {
        "batch": name,
        "unchanged": not any(difference.in_files for difference in differences),
        "provenance_sha256": sha256(reports / provenance.FILE),
        "recorded": made,
        "differences": [asdict(difference) for difference in differences],
    }


def _lines(reports: Path, content: JSON) -> list[str]:
    """Return the lines that say what became of one report, for people."""
    if "error" in content:
        return [content["error"]]
    differences = [Difference(**one) for one in content["differences"]]
    made = content["recorded"]
    counts = ", ".join(f"{len(made[kind])} {kind}" for kind in ("raw", "processed", "results"))
    same = f"the files are those it was made of: {counts}"
    return [
        *(f"{one.kind:<10}{one.change:<9}{one.name}{_values(one)}" for one in differences),
        f"{reports}: {same if content['unchanged'] else 'files changed since the report was made'}",
        f"SHA-256 of {provenance.FILE}: {content['provenance_sha256']}",
    ]


def verify(reports: Path, raw: Path, processed: Path, config: Path) -> tuple[JSON, list[Difference]]:
    """Recompute every hash of a report's provenance.

    Parameters
    ----------
    reports, raw, processed : the batch's folders.
    config : config.yaml, for the settings in force and the folder of cells; where it is not there, settings
        are not compared, and cells are looked for in ``config/cells``.

    Returns
    -------
    made : content of ``provenance.json``.
    differences : what is not as it was: files first, then code, settings and packages.

    Raises
    ------
    ContractError
        There is no ``provenance.json``, it is damaged, or the raw folder is not there.
    """
    file = reports / provenance.FILE
    if not file.is_file():
        message = "is not there: the report was not finished, or made by an earlier version; call metro run"
        raise ContractError([Finding("error", str(file), message)])
    if not raw.is_dir():
        message = "is not there: name the folder of the raw files with --raw"
        raise ContractError([Finding("error", str(raw), message)])
    made, plan = _recorded(file), _plan(config)
    return made, [
        *_raw(made["raw"], raw),
        *_cell(raw, processed, Path(plan.cells)),
        *compare("processed", made["processed"], processed_hashes(processed)),
        *compare("result", made["results"], hashes(reports, made["results"])),
        *_stages(made["stages"], processed, plan),
        *compare("package", _versions(made), _versions(_here())),
    ]


def _recorded(file: Path) -> JSON:
    """Return the content of ``provenance.json``; one that was damaged is an error in words."""
    try:
        made: JSON = json.loads(file.read_text(encoding="utf-8"))
        if set(made) >= RECORDED:
            return made
    except (ValueError, TypeError):
        pass
    message = "is damaged, nothing can be compared with it: remove it and call metro run"
    raise ContractError([Finding("error", str(file), message)])


def _raw(was: dict[str, str], folder: Path) -> list[Difference]:
    """Compare the raw files that were read, and look for files that would be read now."""
    there = {str(path.relative_to(folder)) for path in batch_files(folder)}
    return compare("raw", was, hashes(folder, {*was, *(there & BY_NAME)}))


def _cell(raw: Path, processed: Path, cells: Path) -> Iterator[Difference]:
    """Compare a shared cell, and a cell's stations, with what was read: no raw file need hold them."""
    path = processed / "batch.json"
    was = json.loads(path.read_text(encoding="utf-8"))["cell"] if path.is_file() else {}
    name = str(was.get("cell", ""))
    if not name:
        return
    now, source, _ = read_cell(raw, cells, name)
    if not (raw / "cell.yaml").is_file() and json.loads(json.dumps(now, default=str)) != was:
        yield Difference("cell", name, "changed" if source else "missing", _short(was), _short(now))
    stations = stations_path(now, source)
    if stations is not None and not _same_stations(stations, processed / "stations.parquet"):
        yield Difference("cell", stations.name, "changed" if stations.is_file() else "missing", "", "")


def _same_stations(now: Path, was: Path) -> bool:
    """Return whether the table of stations has the rows that ingest read."""
    import pandas as pd

    from metro.batch.processed import COLUMNS
    from metro.batch.tables import read_table

    if not (now.is_file() and was.is_file()):
        return False
    frames = [read_table(now.parent, "stations", now.stem)[0].frame, pd.read_parquet(was)]
    columns = list(COLUMNS["stations"])
    first, second = (frame.reindex(columns=columns).astype(str).to_numpy().tolist() for frame in frames)
    return bool(first == second)


def _stages(recorded: JSON, processed: Path, plan: Plan) -> Iterator[Difference]:
    """Compare the code of every stage, and its settings where there are some to compare with.

    A stage may have run again since the report was made: where its results came out the same, the report is
    of that run as well.
    """
    made = {stage: made_by(processed, stage) or one for stage, one in recorded.items()}
    yield from compare("code", {s: m["code"] for s, m in made.items()}, {s: code_hash(s) for s in made})
    if plan.config:
        was = {stage: json.dumps(m["settings"], sort_keys=True) for stage, m in made.items()}
        yield from compare("settings", was, {stage: plan.settings(stage) for stage in made})


def _plan(config: Path) -> Plan:
    """Return the settings in force, without looking for batches."""
    from metro.batch.config import load_config

    content = load_config(config) if config.is_file() else {}
    return Plan({}, content, content.get("cells", "config/cells"))


def _versions(made: JSON) -> dict[str, str]:
    return {"python": made["python"], "metro": made["metro"], **made["packages"]}


def _here() -> JSON:
    import platform

    from metro import __version__

    return {"python": platform.python_version(), "metro": __version__, "packages": provenance.packages()}


def _values(one: Difference) -> str:
    """Say from what to what: hashes by their beginning."""
    if one.kind == "cell" or not (one.was or one.now):
        return ""
    short = 12 if one.kind in {"raw", "processed", "result", "code"} else None
    return f"  {one.was[:short] or '–'} → {one.now[:short] or '–'}"


def _short(content: JSON) -> str:
    return json.dumps(content, sort_keys=True, default=str)
