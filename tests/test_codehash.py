"""The hash of a stage's code changes with the code that the stage runs, and with nothing else."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from metro import codehash, syntax

FILES = {
    "__init__.py": "",
    "units.py": '"""Factors."""\nMM = 1e-3\n',
    "stages/__init__.py": "",
    "stages/weigh.py": "def weigh():\n    from metro.scales import balance\n    return balance.read()\n",
    "stages/rest.py": "import json\nfrom metro.units import MM\n",
    "scales/__init__.py": "",
    "scales/balance.py": "from .spring import read\nfrom metro.effects.effect import Effect\n",
    "scales/spring.py": "from ..units import MM\n\ndef read():\n    return MM\n",
    "scales/unused.py": "X = 1\n",
    "scales/templates/page.typ": "= Weight\n",
    "effects/__init__.py": "",
    "effects/library.py": "X = 1\n",
    "scales/joint.py": "from metro.effects.library import X\n",
    "effects/effect.py": "class Effect: ...\n",
    "effects/drift.py": "X = 1\n",
}


@pytest.fixture(autouse=True)
def cache(tmp_path_factory, monkeypatch):
    """Return the folder in which syntax is kept: an empty one."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    forget()
    yield folder
    forget()


def forget():
    """Be as a process that has just begun."""
    for known in (syntax.of_file, syntax._known, syntax._kept):
        known.cache_clear()


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return a package of a few modules in which the hash looks for its stages."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(codehash, "ROOT", tmp_path)
    return tmp_path


def changed(package, name, text, stage="weigh"):
    """Tell whether the stage's hash changes when a file gets another text."""
    before = codehash.code_hash(stage)
    (package / name).parent.mkdir(parents=True, exist_ok=True)
    (package / name).write_text(text)
    forget()
    return codehash.code_hash(stage) != before


def test_it_is_a_sha256_and_the_same_every_time(package):
    assert codehash.code_hash("weigh") == codehash.code_hash("weigh")
    assert len(bytes.fromhex(codehash.code_hash("weigh"))) == 32


def test_the_stage_itself_counts(package):
    assert changed(package, "stages/weigh.py", "def weigh():\n    return 1\n")


def test_modules_imported_inside_functions_and_relatively_count_however_deep(package):
    assert changed(package, "units.py", "MM = 2e-3\n")


def test_a_renamed_variable_is_a_change(package):
    assert changed(package, "scales/spring.py", "from ..units import MM as M\n\ndef read():\n    return M\n")


def test_the_package_of_an_imported_module_counts(package):
    assert changed(package, "scales/__init__.py", "X = 1\n")


def test_modules_that_are_not_imported_do_not_count(package):
    assert not changed(package, "scales/unused.py", "X = 2\n")
    assert not changed(package, "scales/balance.py", "X = 2\n", stage="rest")


def test_comments_layout_and_docstrings_do_not_count(package):
    text = (
        '"""How to weigh."""\n# a comment\n\ndef weigh():\n    """Weigh."""\n'
        + FILES["stages/weigh.py"].split("\n", 1)[1]
    )
    assert not changed(package, "stages/weigh.py", text)


def test_a_string_that_is_no_docstring_counts(package):
    assert changed(package, "stages/weigh.py", FILES["stages/weigh.py"] + 'X = "text"\n')


def test_the_library_of_effects_counts_whole_where_it_is_asked_for_effects(package):
    assert not changed(package, "effects/drift.py", "X = 2\n")  # one class of it was imported
    with_library = FILES["stages/weigh.py"] + "import metro.scales.joint\n"
    (package / "stages" / "weigh.py").write_text(with_library)
    assert changed(package, "effects/drift.py", "X = 3\n")
    assert changed(package, "effects/brand_new.py", "X = 1\n")
    assert not changed(package, "effects/another.py", "X = 1\n", stage="rest")


@pytest.mark.parametrize("stage", ["ingest", "predict", "verdict", "report", "campaign"])
def test_a_change_of_an_effect_re_runs_by_itself_only_what_applies_effects(stage):
    modules = codehash.imported_modules(f"metro.stages.{stage}")
    assert "metro.effects.library" not in modules
    assert "metro.effects.tool_runout" not in modules


def test_files_that_are_not_python_count_with_the_package_that_holds_them(package):
    assert changed(package, "scales/templates/page.typ", "= Mass\n")
    assert not changed(package, "scales/templates/page.typ", "= Force\n", stage="rest")


def test_compiled_files_do_not_count(package):
    assert not changed(package, "scales/__pycache__/balance.cpython-311.pyc", "x")


def test_the_name_of_a_module_counts_and_its_place_on_the_disk_does_not(
    package, tmp_path_factory, monkeypatch
):
    before = codehash.code_hash("weigh")
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "metro"
    shutil.copytree(package, elsewhere)
    monkeypatch.setattr(codehash, "ROOT", elsewhere)
    assert codehash.code_hash("weigh") == before


def test_a_stage_that_is_not_there_is_an_error(package):
    with pytest.raises(FileNotFoundError, match="stages/stand"):
        codehash.code_hash("stand")


def test_code_other_than_planned_is_refused(package):
    codehash.require_code("weigh", codehash.code_hash("weigh"))
    with pytest.raises(codehash.ChangedCodeError, match="call metro run again"):
        codehash.require_code("weigh", codehash.code_hash("rest"))


def real_stages():
    folder = Path(codehash.__file__).parent / "stages"
    return [
        stage
        for stage in ("ingest", "identify", "predict", "loop", "verdict", "report", "campaign")
        if (folder / f"{stage}.py").exists()
    ]


def parsed(monkeypatch):
    """Return a list that every source that is parsed is added to."""
    read, parse = [], ast.parse

    def counted(source, *args, **kwargs):
        read.append(source)
        return parse(source, *args, **kwargs)

    monkeypatch.setattr(syntax.ast, "parse", counted)
    return read


def test_all_stages_of_the_package_are_hashed_with_each_module_read_once(monkeypatch):
    read = parsed(monkeypatch)
    hashes = {stage: codehash.code_hash(stage) for stage in real_stages()}
    assert 50 < len(read) <= len(list(Path(codehash.__file__).parent.rglob("*.py")))
    assert len(set(hashes.values())) == len(hashes)


def test_the_next_call_parses_what_changed_and_nothing_else(package, monkeypatch):
    first, read = codehash.code_hash("weigh"), parsed(monkeypatch)
    forget()
    assert codehash.code_hash("weigh") == first
    assert read == []
    assert changed(package, "units.py", "MM = 2e-3\n")
    assert read == [b"MM = 2e-3\n"]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"3.11 a": 1}', '{"3.11 a": ["b", [["c"]]]}'])
def test_a_damaged_cache_is_written_anew(package, cache, text):
    first = codehash.code_hash("weigh")
    kept = cache / "metro/syntax.json"
    whole = kept.read_bytes()
    kept.write_text(text)
    forget()
    assert codehash.code_hash("weigh") == first
    assert kept.read_bytes() == whole


def test_without_a_place_for_the_cache_the_hash_is_the_same(package, cache, monkeypatch):
    first = codehash.code_hash("weigh")
    (cache / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache / "file"))
    forget()
    assert codehash.code_hash("weigh") == first


def test_hashing_all_stages_costs_no_more_than_parsing_the_package_twice():
    # Each in a process of its own: in one that holds much, the collector's rounds are counted, too.
    timed = (
        "import ast, sys, time; from metro import codehash; start = time.process_time(); "
        "{}; print(time.process_time() - start)"
    )
    hashed = timed.format("[codehash.code_hash(stage) for stage in sys.argv[1:]]")
    parsed = timed.format("[ast.parse(path.read_bytes()) for path in codehash.ROOT.rglob('*.py')]")

    def spent(code):
        run = subprocess.run([sys.executable, "-c", code, *real_stages()], capture_output=True, check=True)
        return float(run.stdout)

    # The least of three: what else the machine does can only add.
    assert min(spent(hashed) for _ in range(3)) < 2.0 * min(spent(parsed) for _ in range(3))


def test_what_only_a_type_checker_imports_does_not_count(package):
    typed = "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    from metro.scales import unused\n"
    (package / "units.py").write_text(typed)
    forget()
    assert not changed(package, "scales/unused.py", "X = 2\n")


def test_what_a_module_finds_by_itself_counts_where_that_module_does(package):
    (package / "stages/list.py").parent.mkdir(exist_ok=True)
    (package / "stages/list.py").write_text("from metro.observables.catalogue import names\n")
    for name in ("__init__", "catalogue", "force/__init__", "force/description", "force/observable"):
        (package / "observables" / f"{name}.py").parent.mkdir(parents=True, exist_ok=True)
        (package / "observables" / f"{name}.py").write_text("X = 1\n")
    assert changed(package, "observables/force/description.py", "X = 2\n", stage="list")
    assert not changed(package, "observables/force/observable.py", "X = 2\n", stage="list")
