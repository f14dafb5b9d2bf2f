"""Names and titles are text: no shell, no Typst, no formula is made of them."""

import re
import subprocess
from pathlib import Path

import pytest

from metro.batch.discover import discover
from metro.batch.findings import BatchError
from metro.report import style
from metro.report.content import Bullets, Facts, Heading, Paragraph, Section, Table
from metro.report.document import Cover, compile_pdf

ROOT = Path(__file__).parents[2]
TYPST = '#read("content.json") #image("x") $x^2$ *b* @a <l> // c'


def test_typst_of_a_title_or_a_cell_prints_itself():
    import pypdfium2

    items = [
        Heading(TYPST),
        Paragraph(TYPST),
        Bullets([TYPST]),
        Facts([(TYPST, TYPST, TYPST)]),
        Table([TYPST], [[TYPST]], TYPST),
    ]
    pdf = pypdfium2.PdfDocument(compile_pdf(Cover(TYPST, TYPST, TYPST), [Section(TYPST, items)]))
    text = " ".join(page.get_textpage().get_text_bounded() for page in pdf)
    told = "".join(text.split())
    assert told.count('#read("content.json")') >= 8
    assert '"sections"' not in told


def test_a_run_named_like_a_formula_is_drawn_as_it_is():
    from matplotlib.figure import Figure

    with style.style():
        figure = Figure()
        figure.subplots().set_title(r"run $\input{/etc/passwd}$ </text><image href='x'/>")
        svg = style.to_svg(figure)
    assert b"<image" not in svg


@pytest.mark.parametrize("name", ["a b", "$(true)", "a;true", "-rf", "A", "a'b", "..a"])
def test_a_batch_has_a_name_that_means_nothing_to_a_shell(tmp_path, name):
    (tmp_path / name).mkdir()
    (tmp_path / name / "batch.yaml").write_text("format: 1\n")
    if name.startswith("."):
        assert discover([tmp_path], tmp_path) == []
        return
    with pytest.raises(BatchError):
        discover([tmp_path], tmp_path)


def test_every_rule_quotes_what_it_puts_into_the_shell():
    rules = sorted(ROOT.glob("workflow/rules/*.smk"))
    assert len(rules) >= 6
    for path in rules:
        shell = path.read_text().rpartition("shell:")[2]
        fields = re.findall(r"\{([^}]*)\}", shell)
        assert fields
        assert [field for field in fields if not field.endswith(":q")] == [], path.name


def test_nothing_of_the_package_runs_a_shell():
    calls = re.compile(
        r"shell=True|os\.system|os\.popen|\beval\(|\bexec\(|pickle|yaml\.load\(|allow_pickle=True"
    )
    found = [
        f"{path.name}: {match[0]}"
        for path in ROOT.glob("src/metro/**/*.py")
        for match in calls.finditer(path.read_text())
        if not (
            path.name == "documents.py" and match[0] == "yaml.load("
        )  # with the loader that is tested here
        # by an unpickler that is restricted; tests/stages/test_problem_file.py gives it harmful files
        and not (path.name == "problem_file.py" and match[0] == "pickle")
        and not (
            path.name == "signals.py" and "allow_pickle=False" in path.read_text() and match[0] == "pickle"
        )
    ]
    assert found == []


def test_snakemake_gets_a_folder_of_any_name_as_one_word(tmp_path):
    import shlex

    from snakemake.utils import AlwaysQuotedFormatter

    name = "raw $(touch sprung); 'x'"
    line = AlwaysQuotedFormatter().format("printf %s {folder:q}", folder=name)
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == name
    assert shlex.split(line)[-1] == name
    assert not (tmp_path / "sprung").exists()
