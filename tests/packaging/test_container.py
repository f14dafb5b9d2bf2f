"""The recipe of the container: what can be said of it without building it."""

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from checkout import Checkout

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def recipe():
    """Return the instructions of the Containerfile in order: name and arguments."""
    text = re.sub(r"^#.*\n", "", (ROOT / "Containerfile").read_text(), flags=re.MULTILINE)
    lines = text.replace("\\\n", " ").splitlines()
    return [(line.split(maxsplit=1)[0], line.split(maxsplit=1)[1]) for line in lines if line.strip()]


def copied(recipe):
    """Return what is copied into the image: source and place there, beside the working folder's name."""
    for name, arguments in recipe:
        if name == "COPY":
            *sources, place = shlex.split(arguments)
            yield from ((source, place) for source in sources)


def test_its_python_is_one_that_the_project_is_made_for(recipe):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    (image,) = [arguments for name, arguments in recipe if name == "FROM"]
    version = re.fullmatch(r"python:(\d+\.\d+)-slim-\w+", image)[1]
    assert project["project"]["requires-python"] == f">={version}"
    assert project["tool"]["mypy"]["python_version"] == version
    assert f"pip-compile with Python {version}\n" in (ROOT / "requirements.lock").read_text()


def test_it_installs_what_the_lock_pins_and_names_no_registry(recipe):
    (run,) = [arguments for name, arguments in recipe if name == "RUN" and "setup" in arguments]
    assert run.split()[0] == "scripts/setup.sh"
    assert (
        "--require-hashes --no-build-isolation -r requirements.lock"
        in (ROOT / "scripts/setup.sh").read_text()
    )
    text = (ROOT / "Containerfile").read_text()
    assert not re.search(r"://|index|find-links|trusted-host", text)


def test_it_runs_metro_and_not_as_root(recipe):
    last = dict(recipe)
    assert last["USER"] not in {"root", "0"}
    assert re.search(rf"useradd .*\b{last['USER']}\b", " ".join(arguments for _, arguments in recipe))
    assert last["ENTRYPOINT"] == '["metro"]'
    assert last["WORKDIR"] == "/data"
    names = [name for name, _ in recipe]
    assert names.index("USER") > max(at for at, name in enumerate(names) if name == "RUN")


@pytest.mark.workflow
def test_what_it_copies_is_there_and_is_enough_to_plan_a_batch(recipe, tmp_path):
    image = tmp_path / "image"
    for source, place in copied(recipe):
        path, target = ROOT / source, image / place
        assert path.exists(), source
        if path.is_dir():
            shutil.copytree(path, target, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        else:
            target.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target)
    (tmp_path / "data").mkdir()
    Checkout(tmp_path / "data").add_batch("alpha")
    program = "import metro; from metro.cli import app; print(metro.__file__, flush=True); app()"
    done = subprocess.run(
        [sys.executable, "-c", program, "run", "alpha", "--dry-run"],
        cwd=tmp_path / "data",
        env={**Checkout(image).environment, "PYTHONPATH": str(image / "src")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith(str(image))
    assert "alpha: writing the report" in done.stdout + done.stderr
    assert f"{image}/profiles/default" in done.stdout + done.stderr


def test_the_set_up_finds_every_file_that_it_reads(recipe):
    names = {Path(source).name for source, _ in copied(recipe)}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    (file,) = {project["project"]["readme"]}
    packages = {each.rstrip("*") for each in project["tool"]["setuptools"]["packages"]["find"]["include"]}
    assert {file, "pyproject.toml", "requirements.lock"} | packages - {"metro"} <= names
    installed = project["tool"]["setuptools"]["data-files"].values()
    assert {path.split("/")[0] for paths in installed for path in paths} <= names
