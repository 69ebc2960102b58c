"""Every picture of every tool, on the sample, on one page to be looked at: ``python tests/gallery.py FOLDER``.

Runs each tool as the test of its outputs does, makes a report with all their results, and gathers the pictures that lie
in the folder then, PNG by PNG, in FOLDER/gallery.html. It takes some minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / each) for each in ("", "engine", "algorithms", "tests/algorithms")]


def main(folder: Path) -> None:
    from every_output import run_every_tool

    from deadwood_algorithms.tools import make_report

    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "slide-logs").exists():
        run_every_tool(folder)
    # What each run was asked for afterwards, so that each kind of figure of the report is there
    asked = {
        "slide-logs": ("value-trees/values.gpkg", "map-intensity", "vary"),
        "without": ("site-barriers", "map-origins"),
    }
    for run, results in asked.items():
        make_report.TOOL(
            runs=str(folder / run),
            results=",".join(str(folder / each) for each in results),
            output=str(folder / f"whole_{run}.html"),
            figures=str(folder / f"whole_{run}"),
            overwrite=True,
        )
    (folder / "gallery.html").write_text(page_of(folder), encoding="utf-8")
    print(folder / "gallery.html")


def page_of(folder: Path) -> str:
    """A figure a picture, under the name of the folder that it lies in."""
    parts = []
    for place in sorted({each.parent for each in folder.rglob("*.png")}):
        parts.append(f"<h2>{place.relative_to(folder)}</h2>")
        parts += [
            f'<figure><img src="{each.relative_to(folder)}"><figcaption>{each.name}</figcaption></figure>'
            for each in sorted(place.glob("*.png"))
        ]
    style = "body{font:14px sans-serif}figure{display:inline-block;margin:8px}img{max-width:46vw;border:1px solid #ccc}"
    return f"<!DOCTYPE html><meta charset='utf-8'><title>Gallery</title><style>{style}</style>{''.join(parts)}"


if __name__ == "__main__":
    main(Path(sys.argv[1]))
