"""The wheel and the source archive: built, installed elsewhere, and used outside the checkout."""

import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from checkout import Checkout

ROOT = Path(__file__).resolve().parents[2]
PARTS = ("src", "virtual_cell", "proof", "field", "workflow", "profiles", "config")
FILES = ("pyproject.toml", "README.md", "LICENSE", "Snakefile", "MANIFEST.in")

pytestmark = pytest.mark.workflow


def call(command, **more):
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Return a copy of what a package is built from, so that nothing is built in the checkout."""
    folder = tmp_path_factory.mktemp("source")
    for name in PARTS:
        shutil.copytree(
            ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info")
        )
    for name in FILES:
        shutil.copy(ROOT / name, folder)
    return folder


@pytest.fixture(scope="module")
def archive(source, tmp_path_factory):
    """Return the unpacked source archive."""
    out = tmp_path_factory.mktemp("sdist")
    build = f"from setuptools.build_meta import build_sdist; print(build_sdist({str(out)!r}))"
    name = call([sys.executable, "-c", build], cwd=source).splitlines()[-1]
    with tarfile.open(out / name) as packed:
        packed.extractall(out, filter="data")
    return out / name.removesuffix(".tar.gz")


@pytest.fixture(scope="module")
def installed(archive, tmp_path_factory):
    """Return a folder with the package, installed from a wheel that was built from the source archive."""
    target = tmp_path_factory.mktemp("installed")
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--no-index",
    ]
    call([*pip, "--target", str(target), str(archive)])
    return target


@pytest.fixture
def metro(installed, tmp_path):
    """Return a function that calls the installed command in an empty folder that has one small batch."""
    Checkout(tmp_path).add_batch("alpha")
    environment = {**os.environ, "PYTHONPATH": str(installed), "OPENBLAS_NUM_THREADS": "1"}

    def call_metro(*arguments):
        program = "from metro.cli import app; app()"
        return call([sys.executable, "-c", program, *arguments], cwd=tmp_path, env=environment)

    return call_metro


def test_the_source_archive_has_what_a_package_is_built_from(archive):
    workflow = ("Snakefile", "workflow/Snakefile", "workflow/rules/loop.smk")
    for name in (*workflow, "config/config.yaml", "config/cells/kr160.yaml"):
        assert (archive / name).is_file(), name


def test_the_package_is_the_installed_one_and_brings_its_workflow(installed, tmp_path):
    seen = "import metro; from metro.commands.workflow_file import workflow_file as f\n"
    seen += "print(metro.__file__, f())"
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    module, workflow = call([sys.executable, "-c", seen], cwd=tmp_path, env=environment).split()
    assert Path(module).is_relative_to(installed)
    assert Path(workflow) == (installed / "share/metro/Snakefile").resolve()
    rules = {path.name for path in (installed / "share/metro/workflow/rules").iterdir()}
    assert rules == {path.name for path in (ROOT / "workflow/rules").iterdir()}
    captions = {path.name for path in (installed / "share/metro/workflow/report").iterdir()}
    assert captions == {path.name for path in (ROOT / "workflow/report").iterdir()}


def test_it_checks_runs_and_exports_a_batch_in_a_folder_of_its_own(metro, tmp_path):
    assert "alpha" in metro("check", "alpha", "--json")
    metro("run", "alpha", "--cores", "1")
    assert (tmp_path / "reports/alpha/report.pdf").read_bytes().startswith(b"%PDF")
    metro("export", "alpha", "--out", "alpha.crate")
    assert (tmp_path / "alpha.crate/ro-crate-metadata.json").is_file()
    assert not (tmp_path / "Snakefile").exists()


def test_it_simulates(metro, tmp_path):
    metro("simulate", "try-1", "--seed", "3")
    assert (tmp_path / "data/raw/try-1/batch.yaml").is_file()
