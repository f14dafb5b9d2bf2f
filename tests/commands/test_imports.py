"""A command imports nothing that it does not use: the import graph is looked at, not the clock."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Packages that take long to import.
HEAVY = {
    *(
        "duckdb",
        "jsonschema",
        "matplotlib",
        "numba",
        "numpy",
        "open3d",
        "pandas",
        "pyarrow",
        "rich",
        "rosbags",
    ),
    *("scipy", "snakemake", "statsmodels", "typst", "yaml"),
}
# Heavy packages → the modules that may have them, and no others, once they are imported. What a function
# imports does not count: it is there when it is used. (numpy comes with metro.units.)
MODULES = {
    (): (
        *("", "cli", "codehash", "batch.alike"),
        *(f"commands.{name}" for name in ("calls", "completion", "hidden", "output", "stage_calls")),
        *(f"commands.{name}" for name in ("which", "run", "workflow_file", "project_calls")),
    ),
    ("numpy",): ("commands.query", "commands.status", "commands.propose", "dataset.results", "dataset.views"),
    ("numpy", "yaml"): ("workflow", "commands.simulate", "commands.verify"),
    ("numpy", "pandas", "pyarrow"): (
        "commands.export",
        "commands.bars",
        "commands.explain",
        "stages.verdict",
    ),
    ("numpy", "pandas", "pyarrow", "yaml"): (
        *("commands.check", "commands.import_files", "commands.next_runs"),
        *(f"stages.{name}" for name in ("ingest", "predict", "campaign", "frf_export")),
    ),
    ("numba", "numpy", "pandas", "pyarrow", "yaml"): ("stages.identify", "stages.loop", "stages.report"),
}


def imported(statement):
    """Return the packages that a fresh interpreter has imported after a statement."""
    # numba asks SciPy for its version, which imports none of its parts and takes 3 ms
    parts = "[m for m in sys.modules if not re.fullmatch(r'scipy(\\.(_.*|version))?', m)]"
    tops = f"sorted({{name.partition('.')[0] for name in {parts}}})"
    script = f"import sys, json, re\n{statement}\nprint(json.dumps({tops}))"
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("allowed", MODULES)
def test_a_module_imports_no_heavy_package_that_is_not_listed(allowed):
    names = [".".join(filter(None, ("metro", module))) for module in MODULES[allowed]]
    assert imported(f"import {', '.join(names)}") & HEAVY <= set(allowed)


def test_every_command_and_stage_is_listed():
    commands = {f"commands.{path.stem}" for path in ROOT.glob("src/metro/commands/*.py")} - {
        "commands.__init__"
    }
    stages = {f"stages.{path.stem}" for path in ROOT.glob("workflow/rules/*.smk")}
    assert commands | stages <= {module for names in MODULES.values() for module in names}


def test_the_help_needs_nothing_but_what_draws_it():
    call = "import metro.cli\ntry:\n    metro.cli.app(['--help'])\nexcept SystemExit:\n    pass"
    assert imported(call) & HEAVY == {"rich"}


def test_a_list_of_what_is_imported_finds_what_is():
    assert imported("import scipy.stats") & HEAVY >= {"numpy", "scipy"}
