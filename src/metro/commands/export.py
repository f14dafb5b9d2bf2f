"""``metro export``: a batch's results in the formats of others."""

from __future__ import annotations

import datetime
import shutil
from pathlib import Path

from metro.batch.processed import read_batch, read_json, write_json
from metro.batch.provenance import FILE as PROVENANCE
from metro.batch.provenance import sha256
from metro.batch.whole_folder import whole_folder
from metro.batch.writing import write_atomically
from metro.commands.calls import wrong_call
from metro.commands.which import batch_name, raw_folder
from metro.commands.workflow_file import workflow_file
from metro.dataset.results import quantities
from metro.exporting.crate import FILE, README, WORKFLOW, CrateFile, Run, metadata, readme
from metro.exporting.dsi import dsi_document

RESULTS = {
    "report.pdf": "report",
    "report.html": "report as a page",
    "identified.json": "identified quantities with 95 % intervals",
    "verdict.json": "verdicts, decisions and recommended cuts",
    PROVENANCE: "hashes of all that the report was made from",
}


CRATE, DSI = "ro-crate", "d-si"


def export(given: str, form: str, out: Path, processed: Path, reports: Path) -> str:
    """Export a batch; return what was written, in words.

    Parameters
    ----------
    given : the batch. form : ``ro-crate`` or ``d-si``. out : folder or file to write.

    Raises
    ------
    CallError
        There is no such batch or form, or the target is there already.
    """
    if form not in (CRATE, DSI):
        raise wrong_call("--as", f"found {form!r}, expected {CRATE} or {DSI}")
    name = batch_name(given, processed, reports)
    if out.exists():
        raise wrong_call("--out", f"{out} is there already: choose another name")
    if form == DSI:
        return _dsi(name, reports / name, out)
    return _crate(name, processed / name, reports / name, out)


def _dsi(name: str, reports: Path, out: Path) -> str:
    content = read_json(reports / "identified.json")
    listed = [each for key, block in content.items() if key != "format" for each in quantities(block, key)]
    text, left_out = dsi_document(name, listed)
    write_atomically(out, lambda stream: stream.write(text.encode()))
    more = f" Left out, because D-SI has no name for the unit: {', '.join(left_out)}." if left_out else ""
    return f"{out} holds {text.count('<si:real>')} quantities of {name}.{more}"


def _crate(name: str, processed: Path, reports: Path, out: Path) -> str:
    raw, workflow = raw_folder(name), workflow_file().resolve()
    batch = read_batch(processed)
    manifest, results = batch.manifest, [file for file in RESULTS if (reports / file).is_file()]
    taken = {
        f"raw/{path.relative_to(raw).as_posix()}": path for path in sorted(raw.rglob("*")) if path.is_file()
    }
    given = {f"reports/{file}": reports / file for file in results}
    rules = sorted((workflow.parent / "workflow/rules").glob("*.smk"))
    program = {WORKFLOW: workflow} | {f"workflow/rules/{path.name}": path for path in rules}
    with whole_folder(out) as folder:
        for place, path in (taken | given | program).items():
            (folder / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, folder / place)
        title = str(manifest.get("title") or name)
        write_atomically(folder / README, lambda stream: stream.write(readme(title, name).encode()))
        ended = datetime.datetime.fromtimestamp((reports / results[0]).stat().st_mtime, datetime.UTC)
        run = Run(
            batch=name,
            title=title,
            source=str(manifest.get("source") or "measured"),
            ended=ended.isoformat(timespec="seconds"),
            operator=str((manifest.get("measurement") or {}).get("operator") or ""),
            raw=[_described(folder, place) for place in taken],
            results=[_described(folder, place, RESULTS[place.rpartition("/")[2]]) for place in given],
            workflow=[_described(folder, place) for place in (*program, README)],
            packages=read_json(reports / PROVENANCE).get("packages") or {},
        )
        write_json(folder / FILE, metadata(run))
    return f"{out} is an RO-Crate of {name}: {len(taken)} raw files, {len(given)} results, the workflow."


def _described(folder: Path, place: str, name: str = "") -> CrateFile:
    path = folder / place
    return CrateFile(place, path.stat().st_size, sha256(path), name)
