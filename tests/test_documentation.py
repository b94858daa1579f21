"""The documentation is true of the code: links lead somewhere, commands parse, the citation is whole."""

import re
import shlex
import tomllib

import pytest
from conftest import REPOSITORY
from scripts import load_script

from drkid import KitSpec, __version__
from drkid.cli import app
from drkid.process import PROCESSES, ProcessPreset

PAGES = sorted([*REPOSITORY.glob("*.md"), *(REPOSITORY / "docs").rglob("*.md")])
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


def page_id(path):
    return str(path.relative_to(REPOSITORY))


def anchors(text):
    """The anchors of a page's headings, as GitHub and MkDocs make them."""
    words = (re.sub(r"[^\w\s-]", "", heading.lower()) for heading in HEADING.findall(text))
    return {re.sub(r"[\s-]+", "-", word.strip()) for word in words}


def fences(language):
    return [
        pytest.param(body, id=f"{page_id(page)}:{number}")
        for page in PAGES
        for number, (name, body) in enumerate(FENCE.findall(page.read_text()))
        if name == language
    ]


def commands():
    """Each `drkid …` line of the pages, comments and prompts left out."""
    lines = {
        line.strip()
        for fence in fences("bash")
        for line in fence.values[0].splitlines()
        if line.strip().startswith("drkid ")
    }
    return sorted(lines)


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_links_lead_somewhere(page):
    for target in LINK.findall(page.read_text()):
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        path, _, anchor = target.partition("#")
        found = page if not path else page.parent / path
        assert found.exists(), f"{target} in {page_id(page)}"
        if anchor:
            assert anchor in anchors(found.read_text()), f"{target} in {page_id(page)}"


def test_every_page_is_in_the_navigation():
    navigation = (REPOSITORY / "mkdocs.yml").read_text()
    for page in (REPOSITORY / "docs").rglob("*.md"):
        assert f": {page.relative_to(REPOSITORY / 'docs')}\n" in navigation


def test_there_are_commands_to_try():
    assert len(commands()) > 20


@pytest.mark.parametrize("line", commands())
def test_commands_parse(line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for fence in fences("toml"):  # files that commands name: their first line says which
        name, _, body = fence.values[0].partition("\n")
        (tmp_path / name.removeprefix("# ")).write_text(body)
    arguments = shlex.split(line, comments=True)[1:]
    command, bound, _ = app.parse_args(arguments, exit_on_error=False, print_error=False)
    assert callable(command)
    given = {name: value for name, value in bound.arguments.items() if name in KitSpec.model_fields}
    flags = bound.arguments.get("flags", {})
    KitSpec.parse({**given, **{name: value for name, value in flags.items() if name in KitSpec.model_fields}})


def test_a_misspelt_option_is_noticed():
    with pytest.raises(Exception, match="clases"):
        app.parse_args(["make", "--clases", "7"], exit_on_error=False, print_error=False)


@pytest.mark.parametrize("text", fences("python"))
def test_python_compiles(text):
    compile(text, "page", "exec")


@pytest.mark.parametrize("text", fences("toml"))
def test_toml_is_a_spec(text):
    values = tomllib.loads(text)
    if "based_on" in values:
        assert ProcessPreset.model_validate(PROCESSES[values.pop("based_on")].model_dump() | values)
    else:
        assert KitSpec.parse(values)


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("paper", "comparison-with-the-paper.md"),
        ("choices", "comparison-with-the-paper.md"),
        ("congruence", "palette-solver.md"),
        ("remesh", "mathematics.md"),
        ("fabrication", "how-to/does-it-go-together.md"),
    ],
)
def test_tables_are_those_of_the_benchmarks(name, file):
    tables = load_script(REPOSITORY / "docs" / "make_tables.py")
    page = (REPOSITORY / "docs" / file).read_text()
    assert f"<!-- table {name} -->" in page
    assert tables.filled(page, name, tables.TABLES[name]) == page


def test_citation():
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")
    citation = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors", "version", "license", "references"} <= citation.keys()
    assert citation["cff-version"] == "1.2.0"
    assert citation["version"] == __version__
    paper = citation["references"][0]
    assert [author["family-names"] for author in paper["authors"]] == ["Khan", "Bohak", "Viola"]
    assert "2304.02941" in paper["identifiers"][0]["value"]


def test_the_pictures_are_small_enough_for_a_page():
    pictures = sorted((REPOSITORY / "docs" / "figures").glob("*.png"))
    assert pictures
    assert all(picture.stat().st_size < 300_000 for picture in pictures)
