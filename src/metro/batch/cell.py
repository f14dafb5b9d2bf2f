"""cell.yaml: the machine, as the batch itself, or the folder of shared cells, describes it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from metro.batch.arm import counts, with_joints
from metro.batch.documents import Likeness, read_yaml, schema_findings
from metro.batch.entries import UNKNOWN, without_entries
from metro.batch.findings import Finding, Severity, errors, linked_outside, misspelt
from metro.units import JSON

FILE = "cell.yaml"
CELLS = Path("config/cells")  # unless config.yaml or the command line says otherwise
CHECKOUT = Path(__file__).parents[3]  # where this package is used from a checkout
ROUNDED = 0.001  # of moments of inertia that are declared with three digits


def shared_cells(cells: Path, checkout: Path = CHECKOUT) -> Path:
    """Return the folder of shared cells: as named, else, if relative, the one in the checkout."""
    return next((folder for folder in (cells, checkout / cells) if folder.is_dir()), cells)


def cells_findings(cells: Path) -> list[Finding]:
    """Report a folder of shared cells, as `shared_cells` has it, that was asked for and is not there.

    The default folder may be missing: where there is no checkout, no cells are shared.
    """
    if cells == CELLS or cells.is_dir():
        return []
    return [Finding("error", str(cells), "is not a folder, expected that of the shared cells")]


def read_cell(folder: Path, cells: Path, name: str) -> tuple[JSON, Path | None, list[Finding]]:
    """Read and validate the description of a batch's machine.

    Parameters
    ----------
    folder : the batch, whose own ``cell.yaml`` goes before.
    cells : folder of the shared cells, with files ``<cell>.yaml``; of the checkout where it is not here.
    name : the cell that the manifest names.

    Returns
    -------
    cell : the description without what an error refuses; ``{"cell": name}`` for a machine of which nothing
        is known.
    source : the file that it comes from; None where nothing is known.
    findings : what is wrong, missing or assumed.
    """
    cells = shared_cells(cells)
    own, shared = folder / FILE, cells / f"{name}.yaml"
    plain = Path(name).name == name and "\0" not in name  # else it would lead out of the folder of cells
    source = own if own.exists() else shared if plain and shared.is_file() else None
    if source is None:
        near = misspelt(name, sorted(path.stem for path in cells.glob("*.yaml")))
        note = f"nothing is known of cell {name} (rigid): neither {FILE} nor {shared} is there"
        if name == UNKNOWN:
            note = f"no machine is named: it is taken to be rigid, and to have no arm (describe it in {FILE})"
        note += f' (did you mean "{near}"?)' if near else ""
        severity: Severity = "warning" if near else "note"
        return {"cell": name}, None, [Finding(severity, "batch.yaml", note, column="cell")]
    file = FILE if source is own else str(shared)
    outside = linked_outside(folder, own, FILE) if source is own else []
    content, findings = ({}, outside) if outside else read_yaml(source, file)
    if findings:
        return {"cell": name}, source, findings
    findings = schema_findings(content, "cell", file, _unknown_key)
    if content.get("cell", name) != name:
        message = f'found "{content["cell"]}", expected the cell that batch.yaml names, "{name}"'
        findings.append(Finding("error", file, message, column="cell"))
    if not findings and content.get("arm"):
        arm, more = with_joints(content["arm"], source.parent, file)
        content = {**content, "arm": arm}
        findings += [*more, *_bodies(arm, file)]
    if not findings:
        findings += counts(content, file)
    stations = content.get("stations")
    if isinstance(stations, str) and (Path(stations).is_absolute() or ".." in Path(stations).parts):
        message = f'found "{stations}", expected a table beside {source.name}'
        findings.append(Finding("error", file, message, column="stations"))
    if content.get("joint_stiffness_nm_rad") and not content.get("arm"):
        message = "is of no use without arm.dh or arm.urdf, which says where the joints are"
        findings.append(Finding("warning", file, message, column="joint_stiffness_nm_rad"))
    return without_entries(content, (finding.column for finding in errors(findings))), source, findings


def _bodies(arm: JSON, file: str) -> Iterator[Finding]:
    """Check masses and moments of inertia of an arm's links and of what its flange carries."""
    links = arm.get("links") or []
    if arm.get("head") and not links:
        message = "is of no use without arm.links: the mass of the tip takes those of all bodies"
        yield Finding("warning", file, message, column="arm.head")
    named = [(f"arm.links[{i}]", body) for i, body in enumerate(links)]
    for name, body in [*named, *([("arm.head", arm["head"])] if arm.get("head") else [])]:
        if "inertia_kg_m2" not in body:
            continue
        xx, yy, zz, xy, xz, yz = body["inertia_kg_m2"]
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if moments[0] < 0 or 2.0 * moments[2] > moments.sum() * (1.0 + ROUNDED):
            message = (
                f"found principal moments of {', '.join(f'{m:.4g}' for m in moments)}, expected none below "
                "zero and none above the sum of the other two, as every body has them"
            )
            yield Finding("error", file, message, column=f"{name}.inertia_kg_m2")


def stations_path(cell: JSON, source: Path | None) -> Path | None:
    """Return where a cell's table of stations is, beside the file that names it; None where it has none."""
    stations = cell.get("stations")
    return source.parent / stations if source is not None and isinstance(stations, str) else None


def _unknown_key(_path: tuple[str, ...], like: Likeness) -> Severity:
    """Return how severe an unknown key is: fields may be added, but a misspelt one must not pass."""
    return "error" if like else "warning"
