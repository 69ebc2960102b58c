"""Build the site: ``python -m docs`` writes ``docs/_build/html``, which opens in a browser without a server.

Needs the extra ``docs``. No network is used. Every warning is an error: a broken link, or a page that is in no menu.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path

from docs import search
from docs.staging import HERE, ROOT, stage


def build(folder: Path, *, notebooks: bool = True) -> int:
    """Stage the sources under ``folder / "source"`` and build ``folder / "html"``; returns the status of Sphinx."""
    from sphinx.cmd.build import main as sphinx

    # Use the packages of this checkout, here and in the notebook's process, whatever is installed.
    packages = [str(ROOT / each) for each in ("", "engine", "algorithms")]
    sys.path[:0] = packages
    os.environ["PYTHONPATH"] = os.pathsep.join([*packages, os.environ.get("PYTHONPATH", "")])
    os.environ["DEADWOOD_DOCS_NOTEBOOKS"] = "cache" if notebooks else "off"
    os.environ.pop("MPLBACKEND", None)  # the kernel draws into the notebook by default
    source, html = folder / "source", folder / "html"
    stage(source)
    shutil.rmtree(html, ignore_errors=True)
    options = ["--fail-on-warning", "--keep-going", "--quiet", "--fresh-env", "--conf-dir", str(HERE)]
    status = sphinx([*options, "-d", str(folder / "doctrees"), str(source), str(html)])
    if status == 0:
        search.write(html)
    return status


def main() -> int:
    asked = argparse.ArgumentParser(prog="python -m docs", description="Build the site of the documentation.")
    asked.add_argument("--output", type=Path, default=HERE / "_build", help="folder of the result")
    asked.add_argument("--no-notebooks", action="store_true", help="show the notebook without running it")
    options = asked.parse_args()
    status = build(options.output.resolve(), notebooks=not options.no_notebooks)
    if status == 0:
        print(f"open {options.output / 'html' / 'index.html'}")
    return status


if __name__ == "__main__":
    sys.exit(main())
