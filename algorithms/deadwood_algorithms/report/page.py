"""The page itself: sections, figures, styles and scripts in one file that needs no other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from importlib import resources
from typing import Any

from deadwood_algorithms.params.tool import VERSION
from deadwood_algorithms.report.answer_figures import drawings_of_answers
from deadwood_algorithms.report.compared import Comparison, comparison, difference_maps, joint_extent
from deadwood_algorithms.report.figures import Drawing, drawings_of
from deadwood_algorithms.report.markup import Markup, element, embedded_json, figure_of, joined
from deadwood_algorithms.report.plan import draw_map, draw_runs
from deadwood_algorithms.report.profiles import chosen_profiles
from deadwood_algorithms.report.rounded import decimal
from deadwood_algorithms.report.sections import map_section, sections_of, warnings_of
from deadwood_algorithms.report.signed import signed_pages
from deadwood_algorithms.report.sources import ReportedRun
from deadwood_algorithms.report.space import Space, packed
from deadwood_algorithms.report.words import Words

# A page that may load nothing, whatever names it contains.
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'"
PACES = (0.25, 0.5, 1, 2, 4, 8)


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
    *,
    annex_open: bool = False,
) -> Report:
    """Assemble the page; a closed annex is not printed."""
    title = title or words.say("title", names=", ".join(each.name for each in sources))
    shown, chapters, contents, plans = [], [], [], []
    alone = len(sources) == 1
    for k, source in enumerate(sources):
        key = f"r{k}"
        drawings = drawings_of(source, words, key, chosen_profiles(source))
        drawings |= drawings_of_answers(source, words, key)
        drawings["map"] = Drawing(f"{key}_map", words.say("map"), partial(draw_map, source, words), words)
        shown += drawings.values()
        screen = Drawing(f"{key}_map", words.say("map"), partial(draw_map, source, words, every_layer=True), words)
        plans.append(map_section(source, screen, axes_place(screen), words))
        sections = sections_of(source, key, drawings, [] if alone else plans[-1], words)
        body = [joined([element("h3", name, id=place), content]) for place, name, content in sections]
        name = words.say("run", name=source.name)
        heading = element("h2", name, id=key)
        chapters.append(element("section", heading, *warnings_of([source], words), *body, class_="chapter"))
        inner = element("ul", *(element("li", element("a", each, href=f"#{place}")) for place, each, _ in sections))
        contents.append(element("li", element("a", name, href=f"#{key}"), inner))
    if alone:
        plan = plans[0]
    else:
        side = Drawing("runs_map", words.say("map"), partial(draw_runs, sources, joint_extent(sources), words), words)
        shown.append(side)
        plan = [figure_of(side, words.say("runs_caption"), card=True)]
    apart = difference_maps(sources, compared, words) if compared else None
    shown += [apart] if apart else []
    first = signed_pages(
        sources, compared, plan, figure_of(apart, apart.title if apart else "", card=True), words, author, project
    )
    contents.insert(0, element("li", element("a", words.say("three_d"), href="#three_d")))
    annex = [three_d(sources, spaces, words)]
    if compared is not None:
        section, drawn = comparison(sources, compared, words)
        shown += drawn
        annex.insert(0, section)
        contents.insert(0, element("li", element("a", words.say("comparison_whole"), href="#comparison")))
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
            first,
            element(
                "details",
                element(
                    "summary", element("h1", words.say("annex"), id="annex"), element("span", words.say("annex_hint"))
                ),
                element("nav", element("h2", words.say("contents")), element("ul", *contents)),
                *annex,
                *chapters,
                class_="annex",
                open="" if annex_open else None,
            ),
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
    """Position of the map's frame in its SVG, in points from the upper left: x, y, width, height."""
    figure = drawing.made()
    figure.draw_without_rendering()
    box = figure.axes[0].get_window_extent().transformed(figure.dpi_scale_trans.inverted())
    tall = figure.get_figheight()
    return 72.0 * box.x0, 72.0 * (tall - box.y1), 72.0 * box.width, 72.0 * box.height


def three_d(sources: Sequence[ReportedRun], spaces: Sequence[Space | None], words: Words) -> Markup:
    """The 3-D view with its controls; its content is in the page's data."""
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
    paces = [(f"{each:g}", words.signs(f"{each:g} ×")) for each in PACES]
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
                    element("span", words.signs("0.0 s"), data_part="clock"),
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
                    element("span", words.say("pick_hint"), class_="followed", data_part="followed"),
                    class_="controls",
                ),
                element("div", *boxes, class_="controls"),
                class_="space",
            ),
            element("p", note, class_="quiet screen"),
        ]
    )
