"""A run of the workflow on one batch as a research object: an RO-Crate by the profile Workflow Run Crate 0.5.

The crate holds what the run took and gave, the workflow, and one file that describes them in JSON-LD
(https://www.researchobject.org/workflow-run-crate). This module makes the description; it copies nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from metro import __version__

FILE, README = "ro-crate-metadata.json", "README.md"
WORKFLOW = "Snakefile"
CONTEXT = [
    "https://w3id.org/ro/crate/1.1/context",
    {"sha256": "https://w3id.org/ro/terms/workflow-run#sha256"},
]
PROFILES = (
    ("https://w3id.org/ro/wfrun/process/0.5", "Process Run Crate", "0.5"),
    ("https://w3id.org/ro/wfrun/workflow/0.5", "Workflow Run Crate", "0.5"),
    ("https://w3id.org/workflowhub/workflow-ro-crate/1.0", "Workflow RO-Crate", "1.0"),
)
BIOSCHEMAS = "https://bioschemas.org/profiles/{}/1.0-RELEASE"
FORMATS = {
    ".csv": "text/csv",
    ".html": "text/html",
    ".json": "application/json",
    ".md": "text/markdown",
    ".parquet": "application/vnd.apache.parquet",
    ".pdf": "application/pdf",
    ".ply": "model/ply",
    ".smk": "text/x-snakemake",
    ".txt": "text/plain",
    ".yaml": "application/yaml",
}

Entity = dict[str, Any]


@dataclass(frozen=True)
class CrateFile:
    """A file of the crate: its path there, bytes, SHA-256, and what it is in words."""

    path: str
    size: int
    sha256: str
    name: str = ""


@dataclass(frozen=True)
class Run:
    """What is known of a run.

    Attributes
    ----------
    batch, title : of the batch. source : measured, simulated or published.
    ended : time at which the report was written, ISO 8601.
    operator : who measured; "" where nobody says.
    raw, results, workflow : files that the run took and gave, and those of the workflow.
    packages : version by package that the results were made with.
    """

    batch: str
    title: str
    source: str
    ended: str
    operator: str
    raw: Sequence[CrateFile]
    results: Sequence[CrateFile]
    workflow: Sequence[CrateFile]
    packages: Mapping[str, str]


def metadata(run: Run) -> Entity:
    """Return the content of ``ro-crate-metadata.json``."""
    files = [_file(file) for file in (*run.raw, *run.results, *run.workflow)]
    program = next(file for file in files if file["@id"] == WORKFLOW)
    program["softwareRequirements"] = ", ".join(f"{name} {v}" for name, v in sorted(run.packages.items()))
    operator = [{"@id": "#operator", "@type": "Person", "name": run.operator}] if run.operator else []
    return {"@context": CONTEXT, "@graph": [*_root(run), *_workflow(run), *operator, _action(run), *files]}


def readme(title: str, batch: str) -> str:
    """Return what a person reads first in the crate."""
    return (
        f"# {title}\n\nThis folder is an RO-Crate of one run of metro {__version__}.\n\n"
        f"- `reports/report.pdf`: the report on the batch `{batch}`.\n"
        "- `reports/identified.json`, `reports/verdict.json`: the results for programs.\n"
        "- `raw/`: the files that the run was made from.\n"
        f"- `{WORKFLOW}`, `workflow/`: the workflow.\n"
        f"- `{FILE}`: the description of all this, in JSON-LD.\n"
    )


def _root(run: Run) -> list[Entity]:
    """Return the descriptor, the crate itself, the raw data as a data set, and what describes them."""
    files = [{"@id": file.path} for file in (*run.results, *run.workflow)]
    return [
        {
            "@id": FILE,
            "@type": "CreativeWork",
            "about": {"@id": "./"},
            "conformsTo": [
                {"@id": "https://w3id.org/ro/crate/1.1"},
                {"@id": "https://w3id.org/workflowhub/workflow-ro-crate/1.0"},
            ],
        },
        {
            "@id": "./",
            "@type": "Dataset",
            "name": run.title,
            "description": f"Run of metro {__version__} on the batch {run.batch} ({run.source} data): "
            "raw files, report, identified quantities, verdict and workflow.",
            "datePublished": run.ended,
            "license": {"@id": "#license"},
            "conformsTo": [{"@id": profile} for profile, _, _ in PROFILES],
            "hasPart": [{"@id": "raw/"}, *files],
            "mainEntity": {"@id": WORKFLOW},
            "mentions": {"@id": "#run"},
            **({"author": {"@id": "#operator"}} if run.operator else {}),
        },
        {
            "@id": "#license",
            "@type": "CreativeWork",
            "name": "Not stated",
            "description": "The batch states no licence of its data. Ask its authors before you share them.",
        },
        *(
            {"@id": profile, "@type": "CreativeWork", "name": name, "version": version}
            for profile, name, version in PROFILES
        ),
        {
            "@id": "raw/",
            "@type": "Dataset",
            "name": f"raw files of {run.batch}",
            "description": "The batch folder: batch.yaml, run table, records.",
            "exampleOfWork": {"@id": "#batch"},
            "hasPart": [{"@id": file.path} for file in run.raw],
        },
    ]


def _workflow(run: Run) -> list[Entity]:
    """Return the workflow with its parameters, language and programs."""
    return [
        {
            "@id": "#batch",
            "@type": "FormalParameter",
            "additionalType": "Dataset",
            "conformsTo": {"@id": BIOSCHEMAS.format("FormalParameter")},
            "name": "batch",
            "valueRequired": True,
        },
        {
            "@id": "#report",
            "@type": "FormalParameter",
            "additionalType": "File",
            "conformsTo": {"@id": BIOSCHEMAS.format("FormalParameter")},
            "name": "report",
        },
        {
            "@id": "#snakemake",
            "@type": "ComputerLanguage",
            "name": "Snakemake",
            "url": {"@id": "https://snakemake.readthedocs.io"},
            "identifier": {"@id": "https://doi.org/10.1093/bioinformatics/bts480"},
            "version": str(run.packages.get("snakemake", "9")),
        },
    ]


def _action(run: Run) -> Entity:
    """Return the run as an action."""
    action: Entity = {
        "@id": "#run",
        "@type": "CreateAction",
        "name": f"metro {__version__} on {run.batch}",
        "description": "Identify models, predict held-out runs, trace the residual to its causes, report.",
        "instrument": {"@id": WORKFLOW},
        "object": {"@id": "raw/"},
        "result": [{"@id": file.path} for file in run.results],
        "endTime": run.ended,
        "actionStatus": "http://schema.org/CompletedActionStatus",
    }
    return action | ({"agent": {"@id": "#operator"}} if run.operator else {})


def _file(file: CrateFile) -> Entity:
    """Return a file; the workflow is one with its own types."""
    ending = "." + file.path.rpartition(".")[2]
    entity: Entity = {
        "@id": file.path,
        "@type": "File",
        "name": file.name or file.path.rpartition("/")[2],
        "contentSize": str(file.size),
        "sha256": file.sha256,
        "encodingFormat": FORMATS.get(ending, "application/octet-stream"),
    }
    if file.path == WORKFLOW:
        entity |= {
            "@type": ["File", "SoftwareSourceCode", "ComputationalWorkflow"],
            "name": "metro",
            "description": "From raw files of cutting tests to identified models, verdicts and a report.",
            "version": __version__,
            "encodingFormat": "text/x-snakemake",
            "programmingLanguage": {"@id": "#snakemake"},
            "conformsTo": {"@id": BIOSCHEMAS.format("ComputationalWorkflow")},
            "input": {"@id": "#batch"},
            "output": {"@id": "#report"},
        }
    if file.path == README:
        entity["about"] = {"@id": "./"}
    if file.path.endswith("report.pdf"):
        entity["exampleOfWork"] = {"@id": "#report"}
    return entity
