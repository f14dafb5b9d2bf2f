"""Where everything came from: limits of the models, settings, code, source files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator

from metro import __version__
from metro.observables.catalogue import assumptions, title
from metro.report.content import Bullets, Heading, Item, Paragraph, Section, Table
from metro.report.numbers import number
from metro.report.phrases import sentence
from metro.report.results import Results
from metro.report.sections.identity import identity
from metro.units import JSON

LONGEST, SHORT, DIGITS = 240, 16, 12
NOT_PREDICTED = ("lobes", "pose")  # what is identified by a model, and may be tested on nothing


def provenance(results: Results) -> Section:
    """Write limits of the models, code and settings of every stage, versions, source files."""
    parts = _limits(results), identity(results), _approval(), _code(results), _sources(results)
    return Section("Provenance", [item for part in parts for item in part])


def _limits(results: Results) -> list[Item]:
    """Say what the models assume that predict, and those that only identified something."""
    notes = [*_of_modes(results)]
    known = {name: results.identified.get(name) for name in NOT_PREDICTED if name not in results.verdicts()}
    notes += [f"{sentence(title(n)).rstrip('.')}: {sentence(assumptions(n))}" for n, v in known.items() if v]
    for observable in results.verdicts():
        own = [str(note) for note in results.loop_record(observable).get("notes") or []]
        limit = [] if results.batch.manifest.get("source") == "published" else [assumptions(observable)]
        text = " ".join(sentence(note) for note in [*limit, *own] if note)
        notes.append(f"{sentence(title(observable)).rstrip('.')}: {text}")
    return [Heading("Limits of the models"), Bullets(notes, small=True)] if notes else []


def _of_modes(results: Results) -> Iterator[str]:
    """Say what modes assume, and which frequencies they do not reach."""
    used = results.tables.get("frf_used")
    if not results.identified.get("modes"):
        return
    reach = "the frequencies that were measured"
    if used is not None and len(used):
        low, high = used["frequency_hz"].min(), used["frequency_hz"].max()
        reach = f"the band of the frequency responses that were used, {number(low)} to {number(high)} Hz"
    yield (
        "Modes: linear and viscously damped, the same at every amplitude and speed. Outside "
        f"{reach}, nothing is known of them; a mode there, as of the tool, may lower the stability boundary."
    )


def _code(results: Results) -> list[Item]:
    rows = [
        [stage, str(made.get("code", ""))[:DIGITS], _settings(made.get("settings"))]
        for stage, made in results.stages.items()
    ]
    whole = _of_all(results)
    listed = f"{whole}: of the list of the source files, as sha256sum writes it"
    rows.append(["sources", whole[:DIGITS], listed])
    caption = (
        f"Made with metro {__version__}. Hash of each stage's code (first {DIGITS} digits; provenance.json "
        "has all) and its settings."
    )
    versions = ", ".join(f"{name} {number}" for name, number in sorted(results.packages.items()))
    packages = [Paragraph(f"Packages: {versions}.", "note")] if versions else []
    table = Table(["stage", "hash", "settings"], rows, caption, [1, 2, 6], small=True)
    return [Heading("Code and settings"), table, *packages]


def _settings(made: JSON | None) -> str:
    return ", ".join(f"{key}: {json.dumps(value)}" for key, value in sorted((made or {}).items())) or "–"


def _approval() -> list[Item]:
    """Leave room for the names of those who answer for the report."""
    rows = [[role, "", "", ""] for role in ("measured", "evaluated", "approved")]
    return [
        Heading("Approval"),
        Table(["", "name", "date", "signature"], rows, "", [1, 2, 1, 2], tall=True),
    ]


def _of_all(results: Results) -> str:
    """SHA-256 over the lines of all source files, in the order of their names."""
    lines = [f"{digest}  {name}\n" for name, digest in sorted(results.sources.items())]
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def _sources(results: Results) -> list[Item]:
    if not results.sources:
        return [Heading("Source files"), Paragraph("The processed tables name no source files.")]
    shown = [[name, digest[:DIGITS]] for name, digest in sorted(results.sources.items())[:LONGEST]]
    abreast = 4 if max(len(name) for name, _ in shown) <= SHORT else 3
    height = -(-len(shown) // abreast)
    shown += [["", ""]] * (abreast * height - len(shown))
    rows = [[cell for part in range(abreast) for cell in shown[part * height + i]] for i in range(height)]
    caption = f"The {len(results.sources)} source files and the first {DIGITS} digits of the SHA-256 of each."
    caption += f" The first {LONGEST} files." if len(results.sources) > LONGEST else ""
    header = ["file", "SHA-256"] * abreast
    table = Table(header, rows, caption, [1.2, 1] * abreast, small=True)
    return [Heading("Source files"), table]
