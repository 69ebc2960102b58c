"""The pages of ``docs`` and CONTRIBUTING.md: their code runs, their links lead somewhere, their commands exist."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = sorted(page for page in (ROOT / "docs").rglob("*.md") if "_build" not in page.parts)
PAGES = [ROOT / "CONTRIBUTING.md", ROOT / "README.md", *DOCS]
TOOL_PAGE = (ROOT / "docs" / "add-a-tool.md").read_text(encoding="utf-8")
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@every_page
def test_links_lead_to_files(page: Path):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        assert target.startswith("https://") or (page.parent / target).exists(), target


@every_page
def test_files_and_functions_that_a_page_names_exist(page: Path):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    made = set(re.findall(r"<!-- (?:file|append): (\S+) -->", text))
    for place in re.findall(r"`((?:tests|algorithms|engine|benchmarks|deadwood_toolbox)/[\w./-]+)`", text):
        assert place in made or (ROOT / place).exists(), place
    for module in re.findall(r"python -m (benchmarks|deadwood_toolbox[.\w]*)", text):
        assert list(ROOT.glob(f"{module.replace('.', '/')}*")), module


def test_the_code_of_the_python_page_runs_in_its_order(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    names: dict[str, object] = {"__name__": "notebook"}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)
    said = capsys.readouterr().out
    assert "20 logs: " in said
    assert "friction is -1, but must be at least 0" in said
    assert sorted(each.name for each in tmp_path.iterdir()) == ["map.png", "run"]
    assert len(blocks) >= 6


def test_the_tool_of_the_page_is_a_tool_and_its_tests_pass(tmp_path: Path, checkout: dict[str, str]):
    """As described on the page, but beside the checkout: packages without ``__init__`` may be split over folders."""
    files = {
        path: code
        for how, path, code in re.findall(
            r"<!-- (file|append): (\S+) -->\n```python\n(.*?)```\n<!-- end", TOOL_PAGE, flags=re.DOTALL
        )
        if how == "file"
    }
    assert len(files) == 2
    for path, code in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(code, encoding="utf-8")
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --import-mode=importlib\n", encoding="utf-8")
    paths = [tmp_path / "algorithms", ROOT / "tests" / "algorithms", checkout["PYTHONPATH"]]
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/algorithms"],
        env={**checkout, "PYTHONPATH": os.pathsep.join(map(str, paths))},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, ran.stdout[-3000:]
    assert re.search(r"\b5 passed", ran.stdout)


def test_the_functions_that_the_tool_page_lists_are_where_it_says():
    rows = re.findall(r"^\| [^|]+ \| ([^|]+) \| `([\w/]+\.py)` \|$", TOOL_PAGE, flags=re.MULTILINE)
    assert len(rows) >= 10
    for names, place in rows:
        source = (ROOT / "algorithms" / "deadwood_algorithms" / place).read_text(encoding="utf-8")
        assert [name for name in re.findall(r"`(\w+)`", names) if f"def {name}(" not in source] == [], place
