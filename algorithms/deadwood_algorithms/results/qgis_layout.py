"""Print layouts of a run for its QGIS project: map, legend, scale bar, north arrow, title, scenario, scale and CRS.

A4 in landscape and in portrait. The map shows the layers of a map theme, so that the print does not depend on what is
checked or on the time of the animation; its scale is a round number. Written without QGIS, like `qgis_project`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from deadwood_algorithms.files.qml import NORMAL, Label

THEME = "Map of the run"
EDGE_MM = 10.0
Box = tuple[float, float, float, float]  # left, top, width, height


@dataclass(frozen=True)
class Sheet:
    """Positions of the items on a page [mm]; ``columns`` is the number of columns of the legend."""

    name: str
    map_id: str
    width: float
    height: float
    answers: Box
    scenario: Box
    map: Box
    legend: Box
    columns: int
    foot: Box


LANDSCAPE = Sheet(
    name="Map of the run, A4 landscape",
    map_id="{5d1f0b52-0c5e-4a53-9d5e-6c6f6c6f6701}",
    width=297.0,
    height=210.0,
    answers=(EDGE_MM, 16.0, 277.0, 8.0),
    scenario=(EDGE_MM, 24.0, 277.0, 16.0),
    map=(EDGE_MM, 41.0, 205.0, 152.0),
    legend=(219.0, 41.0, 68.0, 122.0),
    columns=1,
    foot=(EDGE_MM, 195.0, 277.0, 8.0),
)
PORTRAIT = Sheet(
    name="Map of the run, A4 portrait",
    map_id="{5d1f0b52-0c5e-4a53-9d5e-6c6f6c6f6702}",
    width=210.0,
    height=297.0,
    answers=(EDGE_MM, 16.0, 190.0, 11.0),
    scenario=(EDGE_MM, 27.0, 190.0, 20.0),
    map=(EDGE_MM, 48.0, 190.0, 178.0),
    legend=(EDGE_MM, 228.0, 190.0, 54.0),
    columns=4,
    foot=(EDGE_MM, 283.0, 190.0, 6.0),
)
SHEETS = (LANDSCAPE, PORTRAIT)
MM_PER_M = 1000.0
ROUND = (1.0, 2.0, 2.5, 5.0)  # round scales, times a power of ten
BAR_SHARE = 0.22  # largest share of the map's width
# QGIS's numbers for the types of layout items.
PAGE, MAP, PICTURE, LABEL, LEGEND, BAR = 65638, 65639, 65640, 65641, 65642, 65646
ARROW = ":/images/north_arrows/layout_default_north_arrow.svg"
FONT = "Arial"
BOLD, PLAIN = 75, 50


@dataclass(frozen=True)
class SheetWords:
    """The texts on the page; ``[% %]`` contains an expression of QGIS.

    ``of`` translates a name of the project, or the label of a class, into the language of the page.
    """

    title: str
    answers: str
    scenario: str
    foot: str
    of: Callable[[Label], str]


def layouts_xml(words: SheetWords, extent: Box, theme: str, legend: Sequence[str]) -> str:
    """The layouts; ``extent`` is the minimum area shown, ``legend`` the nodes of the layers in the legend."""
    return f"<Layouts>{''.join(_layout(each, words, extent, theme, legend) for each in SHEETS)}</Layouts>"


def _layout(sheet: Sheet, words: SheetWords, extent: Box, theme: str, legend: Sequence[str]) -> str:
    scale = nice_scale(extent, sheet)
    left, top, width, height = sheet.map
    right, bottom = left + width, top + height
    items = (
        _map(_shown(extent, scale, sheet), theme, sheet),
        _label(words.title, (EDGE_MM, 5.0, sheet.width - 2.0 * EDGE_MM, 11.0), 16.0, BOLD),
        _label(words.answers, sheet.answers, 11.0, PLAIN),
        _label(words.scenario, sheet.scenario, 8.0, PLAIN),
        _label(words.foot, sheet.foot, 7.5, PLAIN),
        _legend(legend, sheet),
        _bar(scale, (left + 3.0, bottom - 15.0, 60.0, 12.0), sheet),
        _arrow((right - 15.0, top + 3.0, 12.0, 14.0), sheet),
    )
    name = quoteattr(words.of(sheet.name))
    return f'<Layout name={name} units="mm" printResolution="300">{_page(sheet)}{"".join(items)}</Layout>'


def nice_scale(extent: Box, sheet: Sheet) -> float:
    """The denominator of the largest round scale at which the extent fits on the map."""
    west, south, east, north = extent
    least = max((east - west) / sheet.map[2], (north - south) / sheet.map[3]) * MM_PER_M
    power = 10.0 ** math.floor(math.log10(least))
    return next(each * power for each in (*ROUND, 10.0) if each * power >= least * (1.0 - 1e-9))


def _shown(extent: Box, scale: float, sheet: Sheet) -> Box:
    """The extent of the map, around the centre of the given extent."""
    west, south, east, north = extent
    half_width, half_height = (scale * side / MM_PER_M / 2.0 for side in sheet.map[2:])
    x, y = (west + east) / 2.0, (south + north) / 2.0
    return x - half_width, y - half_height, x + half_width, y + half_height


def bar_length(scale: float, sheet: Sheet) -> float:
    """Length of the scale bar [m]: two segments of a round number each, at most a fifth of the map's width."""
    most = BAR_SHARE * sheet.map[2] * scale / MM_PER_M / 2.0
    power = 10.0 ** math.floor(math.log10(most))
    return 2.0 * max(each * power for each in ROUND if each * power <= most)


def _item(kind: int, place: Box, inner: str = "", **facts: object) -> str:
    left, top, width, height = place
    attributes = "".join(f" {name}={quoteattr(str(value))}" for name, value in facts.items())
    return (
        f'<LayoutItem type="{kind}" position="{left:g},{top:g},mm" positionOnPage="{left:g},{top:g},mm" '
        f'size="{width:g},{height:g},mm" referencePoint="0" visibility="1" opacity="1"{attributes}>{inner}</LayoutItem>'
    )


def _page(sheet: Sheet) -> str:
    return f"<PageCollection>{_item(PAGE, (0.0, 0.0, sheet.width, sheet.height))}</PageCollection>"


def _map(shown: Box, theme: str, sheet: Sheet) -> str:
    west, south, east, north = shown
    inner = f'<Extent xmin="{west:.3f}" ymin="{south:.3f}" xmax="{east:.3f}" ymax="{north:.3f}"/>'
    facts = {
        "uuid": sheet.map_id,
        "followPreset": "true",
        "followPresetName": theme,
        "frame": "true",
        "background": "true",
    }
    return _item(MAP, sheet.map, inner, id="map", isTemporal=0, outlineWidthM="0.3,mm", **facts)


def _label(text: str, place: Box, size: float, weight: int) -> str:
    return _item(LABEL, place, _font("LabelFont", size, weight), labelText=text, marginX=0, valign=32)


def _font(tag: str, size: float, weight: int) -> str:
    return f'<{tag} description="{FONT},{size:g},-1,5,{weight},0,0,0,0,0" style=""/>'


def _legend(nodes: Sequence[str], sheet: Sheet) -> str:
    sizes = {"title": (10.0, BOLD), "group": (9.0, BOLD), "subgroup": (8.5, BOLD), "symbol": (8.0, PLAIN)}
    sizes["symbolLabel"] = (8.0, PLAIN)
    gaps = {"title": 'marginBottom="2"', "subgroup": 'marginTop="2.5"', "symbol": 'marginTop="1"'}
    gaps["symbolLabel"] = 'marginTop="1" marginLeft="2"'
    styles = "".join(
        f'<style name="{name}" alignment="1" indent="0" {gaps.get(name, "")}>{_font("styleFont", *size)}</style>'
        for name, size in sizes.items()
    )
    tree = f"<layer-tree-group><customproperties/>{''.join(nodes)}</layer-tree-group>"
    facts = {
        "legendFilterByMap": 1,
        "resizeToContents": 1,
        "symbolWidth": 6,
        "symbolHeight": 3,
        "columnCount": sheet.columns,
    }
    inner = f"<styles>{styles}</styles>{tree}"
    return _item(LEGEND, sheet.legend, inner, map_uuid=sheet.map_id, title="", wrapChar="", boxSpace=0, **facts)


def _bar(scale: float, place: Box, sheet: Sheet) -> str:
    segment = bar_length(scale, sheet) / 2.0
    facts = {"numSegments": 2, "numSegmentsLeft": 0, "numUnitsPerSegment": f"{segment:g}", "unitLabel": "m"}
    text = f'<text-style fontFamily="{FONT}" fontSize="8" fontSizeUnit="Point" {NORMAL} textColor="0,0,0,255"/>'
    colours = (
        '<fillColor red="0" green="0" blue="0" alpha="255"/><fillColor2 red="255" green="255" blue="255" alpha="255"/>'
    )
    return _item(
        BAR,
        place,
        text + colours,
        mapUuid=sheet.map_id,
        style="Single Box",
        unitType="meters",
        numMapUnitsPerScaleBarUnit=1,
        segmentSizeMode=0,
        segmentMillimeters=f"{segment / scale * MM_PER_M:.6g}",
        height=2.5,
        labelBarSpace=1.5,
        boxContentSpace=1.5,
        outlineWidth=0.2,
        background="true",
        **facts,
    )


def _arrow(place: Box, sheet: Sheet) -> str:
    return _item(PICTURE, place, file=ARROW, mode=0, resizeMode=0, mapUuid=sheet.map_id, northMode=0, pictureRotation=0)
