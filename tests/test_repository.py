"""Rules of the repository that no linter knows."""

import ast
import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted(
    path for top in ("src", "virtual_cell", "proof", "field") for path in ROOT.glob(f"{top}/**/*.py")
)
PYTHON = [*SOURCES, *sorted([*ROOT.glob("tests/**/*.py"), *ROOT.glob("benchmarks/**/*.py")])]

# Which rooms a room may import (docs/architecture.md). A module at the top of the package is its own room.
PHYSICS = {"cutting", "dynamics", "robot", "surface"}
BASE = {"spelling", "units", "joint_columns", "same", "__init__"}
ROOMS = {
    "units": set(),
    "joint_columns": set(),
    "same": set(),
    "__init__": {"loaded", "effects"},
    "syntax": set(),
    "codehash": {"syntax"},
    "structure": set(),
    "kriging": set(),
    "compiled": set(),
    "formats": set(),
    "batch": {"formats"},
    "signals": set(),
    "cutting": {"signals", "compiled"},
    "dynamics": {"signals", "cutting", "compiled"},
    "robot": {"signals"},
    "surface": {"signals", "compiled"},
    "observables": {"batch", "signals", "structure", "kriging", *PHYSICS},
    "effects": {"signals", "structure", "observables", *PHYSICS},
    "slips": {"batch", "signals", "cutting", "observables"},
    "loop": {"observables", "effects", "kriging", "compiled"},
    "discovery": {"cutting", "observables", "effects", "loop"},
    "wording": set(),
    "decisions": {"cutting", "signals"},
    "memory": set(),
    "report": {"batch", "observables", "cutting"},
    "stages": {
        "batch",
        "codehash",
        "formats",
        "signals",
        "observables",
        "effects",
        "loop",
        "discovery",
        "slips",
        "wording",
        "decisions",
        "memory",
        "report",
        "structure",
        *PHYSICS,
    },
    "progress": set(),
    "workflow": {"batch", "codehash"},
    "dataset": {"batch"},
    "loaded": {
        *("batch", "commands", "dataset", "report", "stages", "observables", "effects", "loop", "signals"),
        *PHYSICS,
    },
    "watch": {"batch", "commands", "stages", "observables", "effects", "loop", "cutting"},
    "importing": {"batch", "formats"},
    "exporting": set(),
    "spelling": set(),
    "commands": {
        *("importing", "exporting", "batch", "report", "dataset", "workflow", "codehash", "observables"),
    },
    "cli": {"stages", "commands", "batch", "formats", "codehash", "watch"},
}


def imported(path):
    """Return the dotted names that a module imports, relative ones resolved."""
    top = ROOT / "src" if path.is_relative_to(ROOT / "src") else ROOT
    package = path.relative_to(top).with_suffix("").parts[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else ()
            source = ".".join([*above, *filter(None, [node.module])])
            yield from (f"{source}.{alias.name}" for alias in node.names) if source == "metro" else (source,)


def room(dotted):
    """Return the room of the package that a dotted name belongs to; None for other packages."""
    package, _, rest = dotted.partition(".")
    if package != "metro":
        return None
    name = rest.partition(".")[0]
    known = (ROOT / "src/metro" / name).is_dir() or (ROOT / f"src/metro/{name}.py").is_file()
    return name if name and known else "__init__"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_module_has_one_idea_and_at_most_350_lines(path):
    assert len(path.read_text().splitlines()) <= 350


def test_a_room_imports_only_what_the_architecture_allows():
    wrong = []
    for path in sorted(ROOT.glob("src/metro/**/*.py")):
        own = path.relative_to(ROOT / "src/metro").with_suffix("").parts[0]
        allowed = ROOMS[own] | {own} | BASE
        wrong += [
            f"{path.relative_to(ROOT)} imports {name}"
            for name in imported(path)
            if room(name) not in {None, *allowed}
        ]
    assert wrong == []


def test_the_loop_knows_of_the_observables_nothing_but_what_a_problem_is():
    names = {name for path in ROOT.glob("src/metro/loop/**/*.py") for name in imported(path)}
    allowed = {"metro.observables.problem", "metro.observables.labelled", "metro.observables.quantity"}
    assert {name for name in names if name.startswith("metro.observables")} <= allowed


def test_who_shows_observables_knows_what_is_said_of_them_and_nothing_that_computes():
    shown = [path for room in ("report", "commands") for path in ROOT.glob(f"src/metro/{room}/**/*.py")]
    names = {name for path in shown for name in imported(path) if name.startswith("metro.observables")}
    assert names == {"metro.observables.catalogue"}


def test_the_simulator_and_the_package_share_no_code():
    assert not [
        path
        for path in ROOT.glob("virtual_cell/**/*.py")
        for name in imported(path)
        if name.split(".")[0] in {"metro", "proof", "field"}
    ]
    assert not [
        path
        for path in ROOT.glob("src/**/*.py")
        for name in imported(path)
        if name.split(".")[0] in {"virtual_cell", "proof", "field"}
    ]


def test_domain_code_neither_reads_nor_writes_files():
    opening = re.compile(
        r"\bopen\(|read_text|write_text|read_bytes|write_bytes|read_parquet|read_csv|to_parquet|to_csv"
    )
    rooms = (*PHYSICS, "signals", "effects", "loop", "memory", "observables")
    modules = [path for room in rooms for path in ROOT.glob(f"src/metro/{room}/**/*.py")]
    assert [path for path in modules if opening.search(path.read_text())] == []


def test_files_of_tests_have_names_of_their_own():
    """Pytest imports them by their names alone: of two with one name, the second is not run."""
    names = [path.name for path in (ROOT / "tests").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))


def test_every_effect_has_a_test():
    files = ROOT.glob("src/metro/effects/*.py")
    effects = {path.stem for path in files if re.search(r"^EFFECT = ", path.read_text(), re.MULTILINE)}
    assert "tool_runout" in effects
    tests = [path.read_text() for path in ROOT.glob("tests/**/test_*.py")]
    tested = " ".join(text for text in tests if "metro.effects" in text)
    assert {effect for effect in effects if not re.search(rf"\b{effect}\b", tested)} == set()


def test_nothing_is_silenced_or_left_for_later():
    marks = re.compile(
        "|".join(["# no" + "qa", "TO" + "DO", "FIX" + "ME", "# type" + r": ignore(?!.*# )", "X" * 3])
    )
    found = [f"{path}: {match[0]}" for path in PYTHON for match in marks.finditer(path.read_text())]
    assert found == []


def texts():
    """Return every text file of the repository that is, or may be, committed."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    suffixes = {
        ".py",
        ".md",
        ".yaml",
        ".yml",
        ".toml",
        ".smk",
        ".sh",
        ".typ",
        ".json",
        ".lock",
        ".cff",
        ".txt",
        "",
    }
    paths = [ROOT / name for name in listed.stdout.splitlines() if "data/raw" not in name]
    return [path for path in paths if path.is_file() and path.suffix in suffixes]


def test_no_file_names_a_place_on_one_machine():
    places = re.compile(
        "|".join(["/wo" + "rk/", "/tm" + r"p/\w", "/ro" + "ot/", "/ho" + r"me/\w", "/op" + r"t/\w"])
    )
    found = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path in texts()
        for match in places.finditer(path.read_text())
    ]
    assert found == []


def test_every_package_of_the_lock_is_pinned_with_a_hash_and_comes_from_no_address():
    lock = (ROOT / "requirements.lock").read_text()
    entries = re.split(r"^(?=[a-z0-9])", lock, flags=re.MULTILINE)[1:]
    assert len(entries) > 50
    assert [
        entry for entry in entries if not re.match(r"\S+==\S+ \\\n    --hash=sha256:[0-9a-f]{64}", entry)
    ] == []
    assert not re.search(r"://|--(index|extra-index|find-links|trusted-host)| @ |^-", lock, re.MULTILINE)


def test_the_lock_has_every_package_that_the_project_asks_for():
    import tomllib

    def name(requirement):
        return re.match(r"[\w.-]+", requirement)[0].lower().replace("_", "-").replace(".", "-")

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    asked = [*project["project"]["dependencies"], *project["project"]["optional-dependencies"]["dev"]]
    asked += project["build-system"]["requires"]
    locked = {
        name(line) for line in (ROOT / "requirements.lock").read_text().splitlines() if re.match(r"\w", line)
    }
    assert {name(requirement) for requirement in asked} <= locked


def test_the_version_is_the_same_everywhere():
    import tomllib

    from metro import __version__

    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == __version__
    assert f"version: {__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## {__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_every_link_between_the_pages_leads_somewhere():
    pages = [ROOT / "README.md", ROOT / "CHANGELOG.md", *ROOT.glob("docs/**/*.md")]
    links = [
        (page, link) for page in pages for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text())
    ]
    assert [f"{page.name}: {link}" for page, link in links if not (page.parent / link).exists()] == []


def test_the_bundled_batches_are_small():
    size = sum(path.stat().st_size for path in (ROOT / "data/raw").rglob("*") if path.is_file())
    assert size <= 20e6


def test_set_up_leaves_an_environment_alone_that_is_only_linked(tmp_path):
    """It belongs to another checkout: to make it anew would empty it under whoever works there."""
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs/package.py").write_text("")
    (tmp_path / "ours/scripts").mkdir(parents=True)
    (tmp_path / "ours/.venv").symlink_to(tmp_path / "theirs")
    script = tmp_path / "ours/scripts/setup.sh"
    script.write_text((ROOT / "scripts/setup.sh").read_text())
    done = subprocess.run(["bash", script], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "the checkout that it belongs to" in done.stderr
    assert (tmp_path / "theirs/package.py").exists()


@pytest.mark.skipif(
    not (ROOT / ".venv/made-from").exists() or (ROOT / ".venv").is_symlink(),
    reason="the environment is not that of set-up",
)
def test_set_up_finds_everything_in_place_with_its_environment_active():
    path = f"{ROOT / '.venv/bin'}:{os.environ['PATH']}"
    done = subprocess.run(
        [ROOT / "scripts/setup.sh"],
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
