"""The page itself: sections, figures, styles and scripts in one file that asks no other for anything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from deadwood_algorithms.params.tool import VERSION
from deadwood_algorithms.report.answer_figures import drawings_of_answers
from deadwood_algorithms.report.figures import Drawing, drawings_of, runout_figure
from deadwood_algorithms.report.markup import Markup, element, embedded_json, figure_of, joined, table
from deadwood_algorithms.report.plan import draw_difference, draw_map
from deadwood_algorithms.report.profiles import chosen_profiles
from deadwood_algorithms.report.rounded import decimal, with_interval
from deadwood_algorithms.report.scenario_box import scenario_box
from deadwood_algorithms.report.sections import left_table, question, sections_of, warnings_of
from deadwood_algorithms.report.sources import Extent, ReportedRun
from deadwood_algorithms.report.space import Space, packed
from deadwood_algorithms.report.words import Words

# A page that may load nothing, whatever a name in it says.
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'"
PACES = (0.25, 0.5, 1, 2, 4, 8)
COMPARED = (
    "reach",
    "bari",
    "miri",
    "orpi",
    "ended",
    "spread_p05_p95",
    "speed_mean",
    "speed_max",
    "runout",
    "jump_max",
    "deposit_moved",
)


@dataclass
class Comparison:
    """What two or more runs come to side by side: rows as of `compare-scenarios`, and maps of the differences."""

    rows: list[Any] = field(default_factory=list)
    differing: dict[str, dict[str, Any]] = field(default_factory=dict)
    maps: dict[str, tuple[NDArray[np.float64], Extent]] = field(default_factory=dict)
    lacks: list[tuple[str, dict[str, Any]]] = field(default_factory=list)


@dataclass(frozen=True)
class Report:
    """The page, and the figures in it by name."""

    page: str
    drawings: list[Drawing]


def report_of(
    sources: Sequence[ReportedRun],
    spaces: Sequence[Space | None],
    compared: Comparison | None,
    words: Words,
    title: str | None,
    author: str | None = None,
    project: str | None = None,
) -> Report:
    """Put the whole page together."""
    title = title or words.say("title", names=", ".join(each.name for each in sources))
    shown, chapters, contents = [], [], []
    for k, source in enumerate(sources):
        key = f"r{k}"
        drawings = drawings_of(source, words, key, chosen_profiles(source))
        drawings |= drawings_of_answers(source, words, key)
        drawings["map"] = Drawing(f"{key}_map", words.say("map"), partial(draw_map, source, words))
        shown += drawings.values()
        screen = Drawing(f"{key}_map", words.say("map"), partial(draw_map, source, words, every_layer=True))
        sections = sections_of(source, key, drawings | {"map": screen}, axes_place(screen), words)
        body = [joined([element("h3", name, id=place), content]) for place, name, content in sections]
        name = words.say("run", name=source.name)
        heading = element("h2", name, id=key)
        chapters.append(element("section", heading, *warnings_of(source, words), *body, class_="chapter"))
        inner = element("ul", *(element("li", element("a", each, href=f"#{place}")) for place, each, _ in sections))
        contents.append(element("li", element("a", name, href=f"#{key}"), inner if len(sources) == 1 else ""))
    lead = [element("h2", words.say("question"), id="question"), *question(list(sources), words)]
    lead += scenario_box(list(sources), words, author, project)
    view = three_d(sources, spaces, words)
    contents.insert(0, element("li", element("a", words.say("three_d"), href="#three_d")))
    if compared is not None:
        section, drawn = comparison(sources, compared, words)
        shown += drawn
        view = joined([section, view])
        contents.insert(0, element("li", element("a", words.say("comparison"), href="#comparison")))
    data = {
        "version": VERSION,
        "runs": [{"name": each.name, "summary": each.summary, "manifest": each.run.manifest} for each in sources],
        "space": [packed(space, source) for space, source in zip(spaces, sources, strict=True) if space is not None],
        "words": {name: words.say(name) for name in ("play", "pause")}
        | {"hint": words.say("pick_hint"), "picked": words.say("picked", id="{id}", speed="{speed}")},
    }
    body = [
        element("header", element("p", words.say("subtitle"), class_="quiet"), element("h1", title)),
        element(
            "main",
            *lead,
            element("nav", element("h3", words.say("contents")), element("ul", *contents)),
            view,
            *chapters,
        ),
        element("footer", element("p", words.say("made", version=VERSION), class_="quiet")),
        element("script", embedded_json(data), type="application/json", id="report-data"),
        element("script", Markup(packaged("view3d.js"))),
        element("script", Markup(packaged("page.js"))),
    ]
    head = [
        Markup('<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'),
        Markup(f'<meta http-equiv="Content-Security-Policy" content="{POLICY}"><link rel="icon" href="data:,">'),
        element("title", title),
        element("style", Markup(packaged("page.css"))),
    ]
    page = element("html", element("head", *head), element("body", *body), lang=words.language)
    return Report(f"<!DOCTYPE html>\n{page}\n", shown)


def packaged(name: str) -> str:
    return resources.files("deadwood_algorithms.report").joinpath(name).read_text(encoding="utf-8")


def axes_place(drawing: Drawing) -> tuple[float, float, float, float]:
    """Where the map's frame lies in its SVG, in points from the upper left: x, y, width, height."""
    figure = drawing.made()
    figure.draw_without_rendering()
    box = figure.axes[0].get_window_extent().transformed(figure.dpi_scale_trans.inverted())
    tall = figure.get_figheight()
    return 72.0 * box.x0, 72.0 * (tall - box.y1), 72.0 * box.width, 72.0 * box.height


def three_d(sources: Sequence[ReportedRun], spaces: Sequence[Space | None], words: Words) -> Markup:
    """The 3-D view with its controls; what it shows is in the page's data."""
    heading = element("h2", words.say("three_d"), id="three_d")
    there = [(source, space) for source, space in zip(sources, spaces, strict=True) if space is not None]
    if not there:
        return joined([heading, element("p", words.say("three_d_lacks"))])

    def button(part: str, label: str, **more: Any) -> Markup:
        return element("button", label, type="button", data_part=part, **more)

    def chooser(part: str, label: str, options: list[tuple[str, str]], chosen: str) -> Markup:
        rows = [
            element("option", text, value=value, selected="" if value == chosen else None) for value, text in options
        ]
        return element("label", label, element("select", *rows, data_part=part))

    def box(part: str, label: str, on: bool) -> Markup:
        tag = element("input", type="checkbox", data_solid=part, checked="" if on else None)
        return element("label", Markup(tag.removesuffix("</input>")), label)

    slider = element(
        "input", type="range", min="0", max="1", value="0", step="0.05", data_part="time", aria_label=words.say("time")
    )
    groups = [("", words.say("group_all"))] + [
        (each, words.say(f"group_{each}")) for each in ("fast", "far", "reach", "random")
    ]
    paces = [(f"{each:g}", f"{each:g} ×") for each in PACES]
    runs = [chooser("run", words.say("runs"), [(str(k), each.name) for k, (each, _) in enumerate(there)], "0")]
    solids = ("moving", "deposits", "trees", "barriers", "lying", "blocks", "lines", "trails")
    phrases = {
        "trees": "layer_trees",
        "barriers": "layer_barriers",
        "lying": "layer_lying_logs",
        "blocks": "layer_blocks",
        "lines": "layer_lines",
    }
    boxes = [box(each, words.say(phrases.get(each, each)), each not in ("deposits", "trails")) for each in solids]
    drapes = [("hits", words.say("layer_hits")), ("relief", words.say("layer_relief"))]
    source, space = there[0]
    note = words.say(
        "three_d_note",
        cell=decimal(space.cell, words),
        dem_cell=decimal(source.dem_cell, words),
        shown=len(space.moving),
        stored=source.run.stored_log_ids.size,
    )
    return joined(
        [
            heading,
            element(
                "div",
                element("canvas", aria_label=words.say("three_d_label"), role="img"),
                element("p", words.say("three_d_webgl"), class_="missing warning"),
                element(
                    "div",
                    button("play", words.say("play")),
                    Markup(slider.removesuffix("</input>")),
                    element("span", "0.0 s", data_part="clock"),
                    chooser("pace", words.say("pace"), paces, "1"),
                    chooser("group", words.say("which_logs"), groups, ""),
                    class_="controls motion",
                ),
                element(
                    "div",
                    *(runs if len(there) > 1 else []),
                    chooser("drape", words.say("drape"), drapes, "hits"),
                    button("home", words.say("home")),
                    button("follow", words.say("let_go"), hidden=""),
                    element("span", words.say("pick_hint"), class_="told", data_part="told"),
                    class_="controls",
                ),
                element("div", *boxes, class_="controls"),
                class_="space",
            ),
            element("p", note, class_="quiet screen"),
        ]
    )


def comparison(sources: Sequence[ReportedRun], compared: Comparison, words: Words) -> tuple[Markup, list[Drawing]]:
    """The runs side by side: a table a quantity, the run-outs, and maps of the differences."""
    reference = sources[0].name
    parts: list[Any] = [element("h2", words.say("comparison"), id="comparison")]
    parts += [element("p", words.say(phrase, **filled), class_="warning") for phrase, filled in compared.lacks]
    drawings = [Drawing("comparison_runout", words.say("runout"), partial(runout_figure, list(sources), words))]
    if compared.rows:
        parts.append(element("p", words.say("comparison_note", reference=reference)))
        parts.append(comparison_table(compared.rows, [each.name for each in sources], words))
        differ = [
            (
                f"--{name.replace('_', '-')}",
                "; ".join(f"{run}: {value or words.say('none')}" for run, value in values.items()),
            )
            for name, values in compared.differing.items()
        ]
        parts.append(element("h3", words.say("parameters_differ")))
        parts.append(left_table(differ) if differ else element("p", words.say("parameters_same")))
    parts.append(figure_of(drawings[0]))
    for k, (name, (band, extent)) in enumerate(compared.maps.items()):
        title = words.say("difference_map", name=name, reference=reference)
        draw = partial(draw_difference, band, extent, joint_extent(sources), sources[0], title, words)
        drawings.append(Drawing(f"difference_{k}", title, draw))
        parts.append(figure_of(drawings[-1], title))
    return element("section", *parts), drawings


def joint_extent(sources: Sequence[ReportedRun]) -> Extent:
    sides = np.array([each.extent for each in sources])
    west, south = sides[:, :2].min(axis=0)
    east, north = sides[:, 2:].max(axis=0)
    return float(west), float(south), float(east), float(north)


def comparison_table(rows: Sequence[Any], names: Sequence[str], words: Words) -> Markup:
    """A row a quantity; for each run its value, and from the second on its difference to the first."""
    ends = {row.item for row in rows if row.quantity == "ended" and row.value > 0.0}
    kept = [row for row in rows if row.quantity in COMPARED and (row.quantity != "ended" or row.item in ends)]
    of = {(row.scenario, row.quantity, row.item): row for row in rows}
    head = [words.say("quantity")]
    for k, name in enumerate(names):
        head += [name] + ([f"{name}: {words.say('difference')}"] if k else [])
    body = []
    for quantity, item, unit in dict.fromkeys((row.quantity, row.item, row.unit) for row in kept):
        shown = words.stop(item) if quantity == "ended" else words.known(f"item_{item}", item)
        scale, told = (100.0, "%") if unit == "1" else (1.0, "°" if unit == "deg" else unit)
        cells: list[Any] = [f"{words.known(f'quantity_{quantity}', quantity, item=shown)} [{told}]"]
        for k, name in enumerate(names):
            row = of.get((name, quantity, item))
            if row is None:
                cells += ["–"] * (2 if k else 1)
                continue
            cells.append(with_interval(scale * row.value, scale * row.low, scale * row.high, words))
            if k:
                cells.append(
                    with_interval(
                        scale * row.difference, scale * row.diff_low, scale * row.diff_high, words, signed=True
                    )
                )
        body.append(cells)
    return table(head, body)
