"""The site: its commands run on the sample data, it builds without a warning, its links lead somewhere, offline."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

from deadwood_toolbox import cli
from deadwood_toolbox.shelf import TOOLS
from docs import generated, search
from docs.staging import HERE, ROOT, pages, two_shells

GUIDES = sorted(path for path in (HERE / "how-to").glob("*.md") if path.name != "index.md")
# Pages whose commands, in their order, make everything they use from the sample data alone.
OTHERS = sorted(path for part in ("start", "tutorials") for path in (HERE / part).glob("*.md"))
WALKS = [path for path in OTHERS if "```sh" in path.read_text(encoding="utf-8")]


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a language, also of those within a list."""
    found = re.findall(rf"^( *)```{language}\n(.*?)^ *```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    return ["\n".join(line.removeprefix(indent) for line in text.splitlines()) for indent, text in found]


def commands(page: Path) -> list[list[str]]:
    """The commands to be typed on the page, continued lines joined, without the name of the program."""
    lines = [line for text in blocks(page, "sh") for line in text.replace("\\\n", " ").splitlines() if line.strip()]
    return [shlex.split(line)[1:] for line in lines if shlex.split(line)[0] == "deadwood-tool"]


def run(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in commands(page):
        assert cli.run(command) == 0, f"{' '.join(command)}\n{capsys.readouterr().err[-2000:]}"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that is made on the first page of the how-to guides."""
    folder = tmp_path_factory.mktemp("guides")
    (folder / "sample_data").symlink_to(ROOT / "sample_data")
    page = HERE / "how-to" / "index.md"
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for code in blocks(page, "python"):
            exec(compile(code, str(page), "exec"), {})
        for command in commands(page):
            assert cli.run(command) == 0, command
    return folder


# Guides whose commands use what those of others have made.
NEEDS = {"report": ("which-trees", "site-a-barrier", "intensity", "origins")}


@pytest.mark.slow
@pytest.mark.parametrize("page", GUIDES, ids=lambda page: page.stem)
def test_the_commands_of_a_guide_run(page: Path, workspace: Path, monkeypatch, capsys):
    monkeypatch.chdir(workspace)
    for name in (page.stem, *NEEDS.get(page.stem, ()))[::-1]:
        finished = workspace / f".{name}"
        if not finished.exists():
            run(page.with_name(f"{name}.md"), capsys)
            finished.touch()


# Commands on pages that the tests above do not run as they stand, each with what runs it.
ELSEWHERE = {
    "deadwood-tool demo": "tests/algorithms/tools/test_demo.py",
    "deadwood-tool list": "tests/toolbox/test_cli.py",
    "deadwood-tool explore": "tests/algorithms/explore/test_server.py",
    "deadwood-tool qgis-plugin": "tests/toolbox/test_plugin_zip.py",
    "deadwood-tool reproduce-paper": "tests/algorithms/tools/test_reproduce_paper.py",
    "deadwood-tool slide-logs": "tests/algorithms/simulate/test_scheduler.py",  # with --scheduler: many-machines.md
    "deadwood-tool run-sites": "tests/algorithms/tools/test_run_sites.py",  # with --plan: region.md
    "deadwood-tool reach-by-size": "tests/toolbox/test_docs.py",
    "deadwood-tool describe": "tests/toolbox/test_docs.py",
    "deadwood-tool sample-releases": "tests/toolbox/test_examples.py",
    "deadwood-tool make-report": "tests/algorithms/tools/test_make_report.py",
    "python3 -m venv": ".ci/run",
    "py -m venv": ".github/workflows/tests.yml",
    "pip install": ".ci/run",
    "python -m pytest": ".ci/run",
    "python -m benchmarks": "tests/trade/test_page.py",
    "python -m benchmarks.rare": "tests/trade/test_rare.py",
    "python -m benchmarks.population": "tests/trade/test_population.py",
    "python -m deadwood_toolbox.functions_page": "tests/toolbox/test_python.py",
    "python -m deadwood_toolbox.translations": "tests/toolbox/test_plugin_texts.py",
    "dask scheduler": "tests/algorithms/simulate/test_scheduler.py",
    "dask worker": "tests/algorithms/simulate/test_scheduler.py",
}
WITH_ITS_OWN_TEST = {"docs/real-slope.md": "tests/toolbox/test_real_slope.py"}


def typed(page: Path) -> set[str]:
    """The first words of each command line in a page's blocks of code, except those that the tests above run."""
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    if page in [*GUIDES, *WALKS, HERE / "how-to" / "index.md"]:
        text = re.sub(r"^ *```sh\n.*?^ *```", "", text, flags=re.DOTALL | re.MULTILINE)
    fence = re.compile(r"^ *```.*?\n(.*?)^ *```", re.DOTALL | re.MULTILINE)
    code = [*fence.findall(text), *re.findall(r"^ {4,}\S.*$", fence.sub("", text), re.MULTILINE)]
    found = set()
    for line in "\n".join(each for each in code if " CPU seconds of " not in each).splitlines():  # no output
        for each in re.split(r" && |; ", line.strip()):
            words = re.sub(r"^\.venv[/\\]\w+[/\\]", "", each).split()
            if len(words) > 1 and words[0] in ("deadwood-tool", "python", "python3", "py", "pip", "dask"):
                found.add(" ".join(words[: 3 if words[1] == "-m" else 2]))
    return found


def test_every_command_of_the_pages_is_run_somewhere():
    """By the tests of this file, or by those in `ELSEWHERE`, which names only commands of the pages."""
    found: dict[str, str] = {}
    for source in ["README.md", *pages()]:
        if source.endswith(".md") and source not in WITH_ITS_OWN_TEST and source != "CHANGELOG.md":
            found |= dict.fromkeys(typed(ROOT / source), source)
    assert {command: page for command, page in found.items() if command not in ELSEWHERE} == {}
    assert set(ELSEWHERE) - set(found) == set()
    assert [place for place in [*ELSEWHERE.values(), *WITH_ITS_OWN_TEST.values()] if not (ROOT / place).exists()] == []


@pytest.mark.slow
@pytest.mark.parametrize("page", WALKS, ids=lambda page: page.stem)
def test_the_commands_of_a_walk_run_from_the_sample_alone(page: Path, tmp_path: Path, monkeypatch, capsys):
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    monkeypatch.chdir(tmp_path)
    run(page, capsys)


def test_every_page_is_in_one_place():
    assert len(WALKS) >= 4
    places = list(pages().values())
    assert len(places) == len(set(places))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site. The notebook is not run here: it has its own test."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "docs", "--output", str(folder), "--no-notebooks"]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr[-4000:]
    return folder / "html"


class Found(HTMLParser):
    """The ids of a page, and its links and loaded files."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        facts = {name: value for name, value in attrs if value}
        self.ids |= {facts[name] for name in ("id", "name") if name in facts}
        if tag == "a" and "href" in facts:
            self.links.append(facts["href"])
        if tag in ("script", "img", "iframe", "source") and "src" in facts:
            self.loads.append(facts["src"])
        if tag == "link" and "href" in facts and facts.get("rel") != "canonical":
            self.loads.append(facts["href"])


def test_no_link_of_the_site_is_broken_and_nothing_is_loaded_from_elsewhere(site: Path):
    found = {page: Found(page) for page in site.rglob("*.html") if "_static" not in page.parts}
    assert len(found) > 150
    broken = set()
    for page, what in found.items():
        for target in what.loads + what.links:
            path, _, anchor = unquote(target).partition("#")
            if re.match(r"[a-z]+:", path):
                if target in what.loads and not path.startswith("data:"):
                    broken.add((page.name, f"loads {target}"))
                continue
            meant = (page.parent / path.partition("?")[0]).resolve() if path else page
            if not meant.exists() or (anchor and meant in found and anchor not in found[meant].ids):
                broken.add((str(page.relative_to(site)), target))
    assert sorted(broken) == []


# What readers type, and the page that should come first.
QUESTIONS = {
    "friction wet bark": "how-to/which-friction",
    "which friction should I use": "how-to/which-friction",
    "friction coefficient soil": "how-to/which-friction",
    "how many logs": "how-to/accuracy",
    "number of logs needed": "how-to/accuracy",
    "draft or standard": "how-to/accuracy",
    "house": "how-to/slide-logs",
    "road": "how-to/slide-logs",
    "railway": "how-to/slide-logs",
    "snag": "how-to/after-a-storm",
    "windthrow": "how-to/after-a-storm",
    "storm damage": "how-to/after-a-storm",
    "Totholz": "start/de",
    "bois mort": "start/fr",
    "legno morto": "start/it",
    "barrier position": "how-to/site-a-barrier",
    "where should a barrier stand": "how-to/site-a-barrier",
    "barrier energy": "how-to/design-values",
    "height of a barrier": "how-to/design-values",
    "embankment": "how-to/embankments",
    "ditch": "how-to/embankments",
    "jump over barrier": "how-to/jumps",
    "fell trees": "how-to/which-trees",
    "which trees stop logs": "how-to/which-trees",
    "compare with and without forest": "how-to/compare-scenarios",
    "trees from lidar": "how-to/trees",
    "canopy height model": "how-to/trees",
    "random forest stand": "how-to/trees",
    "release positions": "how-to/start-positions",
    "where could logs start": "how-to/where-can-logs-start",
    "return period intensity": "how-to/intensity",
    "hazard map": "how-to/intensity",
    "many sites": "how-to/many-sites",
    "several machines cluster": "how-to/many-machines",
    "sensitivity": "how-to/most-influential-input",
    "calibrate friction": "tutorials/calibrate-an-event",
    "repeat a run": "how-to/repeat",
    "resume interrupted run": "how-to/slide-logs",
    "report pdf": "how-to/report",
    "install": "start/install",
    "qgis plugin": "start/first-run-qgis",
    "python": "reference/python",
    "exit status": "reference/messages",
    "units": "reference/units",
    "how to cite": "explanation/cite",
    "rockfall": "faq",
    "check my terrain model": "how-to/inspect",
    "tree breakage": "how-to/tree-breakage",
    "point cloud of a log": "how-to/log-solid",
    "published values": "how-to/presets",
    "leave or remove dead trees": "how-to/dead-trees",
}


def test_the_search_finds_the_page_that_answers_first_and_shows_where(site: Path):
    """From the file system; nothing is fetched from elsewhere."""
    sys.path.append(str(ROOT / "tests" / "algorithms"))
    from browser import Browser  # pyright: ignore[reportMissingImports]

    browser = Browser()
    try:
        browser.open(site / "index.html")
        browser.call("Page.navigate", url=(site / "search.html").resolve().as_uri() + "?q=friction+wet+bark")
        browser.wait("document.querySelectorAll('#search-results li a').length > 3")
        first = "document.querySelector('#search-results li')"
        assert browser.ask(f"{first}.querySelector('a').getAttribute('href')").startswith(
            "./how-to/which-friction.html"
        )
        assert {"friction", "bark"} & set(browser.ask(f"[...{first}.querySelectorAll('mark')].map((e) => e.innerText)"))
        found = browser.ask(f"{list(QUESTIONS)}.map((each) => deadwoodSearch.find(each)[0]?.place)")
        expected = [f"{each}.html" for each in QUESTIONS.values()]
        assert [each for each in zip(QUESTIONS, found, expected, strict=True) if each[1] != each[2]] == []
        links = browser.ask("[...document.querySelectorAll('#search-results a')].map((e) => e.getAttribute('href'))")
        assert all((site / each.partition("#")[0]).is_file() for each in links)
        assert {each for each in browser.requests if not each.startswith(("file:", "data:"))} == set()
    finally:
        browser.close()


def test_a_section_is_read_without_what_surrounds_it():
    html = (
        "<main><article><nav><a>menu</a></nav><section id='top'><h1>Title<a class='headerlink'>#</a></h1><p>One &amp; "
        "two</p><button>Copy</button><section id='low'><h2>Lower</h2> three<script>no</script></section></section>"
        "</article><p>foot</p></main>"
    )
    assert search.sections(html) == [["top", "Title", "One & two"], ["low", "Lower", "three"]]
    assert set(search.SUBJECTS) <= {each.rsplit(".", 1)[0] for each in pages().values()}


@pytest.mark.slow
def test_axe_finds_nothing_serious_on_the_sites_pages(site: Path):
    """One page of each kind, on a phone and on a wide screen."""
    sys.path.append(str(ROOT / "tests" / "algorithms"))
    from browser import Browser  # pyright: ignore[reportMissingImports]

    kinds = (
        "index", "start/install", "start/first-run-qgis", "start/de", "tutorials/sample-slope", "tutorials/notebook",
        "how-to/index", "reference/tools/slide-logs", "reference/layers/deposits-slide-logs", "reference/glossary",
        "explanation/paper", "gallery", "search",
    )  # fmt: skip
    browser, found = Browser(), []
    try:
        for kind in kinds:
            for width in (375, 1440):
                browser.size(width, 812, phone=width < 500)
                browser.open(site / f"{kind}.html")
                found += [(kind, width, each) for each in browser.hard_to_use()]
    finally:
        browser.close()
    assert found == []


def test_every_tool_every_layer_and_every_term_has_its_place(site: Path):
    for tool in TOOLS:
        page = (site / "reference" / "tools" / f"{tool.name}.html").read_text(encoding="utf-8")
        assert [p.flag for p in tool.parameters() if p.flag not in page] == []
    assert len(list((site / "reference" / "layers").iterdir())) > 80
    ids = Found(site / "reference" / "glossary.html").ids
    assert sum(each.startswith("term-") for each in ids) == len(generated.terms())


def test_every_picture_of_a_page_is_one_that_a_command_makes():
    made = set(re.findall(r'keep\(.*"(\w+)"\)$', (HERE / "pictures.py").read_text(encoding="utf-8"), re.MULTILINE))
    used = {
        name for page in HERE.rglob("*.md") for name in re.findall(r"pictures/(\w+)\.webp", page.read_text("utf-8"))
    }
    assert used <= made
    assert made == {path.stem for path in (HERE / "pictures").iterdir()}


def test_the_glossary_has_one_word_for_each_thing_in_four_languages():
    rows = generated.terms()
    names = [row["term"] for row in rows]
    assert len(names) == len(set(names)) > 50
    assert [row["term"] for row in rows if not all(row.values())] == []


def test_the_messages_that_the_page_explains_are_messages():
    page = (HERE / "reference" / "messages.md").read_text(encoding="utf-8")
    parts = re.findall(
        r"^\| `([^`]+)` \|", page.partition("| a message with these words |")[2].partition("\n\n")[0], re.MULTILINE
    )
    sources = (path.read_text(encoding="utf-8") for path in (ROOT / "algorithms" / "deadwood_algorithms").rglob("*.py"))
    text = re.sub(r'"\s*\n\s*f?"', "", "\n".join(sources))
    assert len(parts) >= 4
    assert [part for part in parts if part not in text] == []


def test_commands_are_shown_for_two_shells():
    shown = two_shells("```sh\ndeadwood-tool a \\\n    --b 1\n```")
    assert "```sh\ndeadwood-tool a \\\n    --b 1\n```" in shown
    assert "```powershell\ndeadwood-tool a `\n    --b 1\n```" in shown
    assert two_shells("```sh\ndeadwood-tool list\n```") == "```sh\ndeadwood-tool list\n```"
    assert two_shells("```sh\ncat > a <<'END' \\\nb\nEND\n```").count("```") == 2


@pytest.mark.slow
def test_the_notebook_runs_and_shows_what_it_says(tmp_path: Path, checkout: dict[str, str], monkeypatch):
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.setenv("PYTHONPATH", checkout["PYTHONPATH"])
    monkeypatch.delenv("MPLBACKEND", raising=False)  # a kernel draws into the notebook where nothing else is asked for
    path = HERE / "tutorials" / "notebook.ipynb"
    notebook = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # kept without: the site's build makes them
    NotebookClient(notebook, timeout=900, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 2
    said = "".join(output.get("text", "") for output in outputs)
    assert said.count("of the logs reach the road") == 3
    assert [path.name for path in tmp_path.iterdir()] == []
