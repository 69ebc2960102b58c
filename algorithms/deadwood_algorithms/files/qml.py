"""The part of QGIS's style language that the toolbox needs: pieces of XML from plain numbers and words.

`styles` defines the look of each layer, and `qgis_project` puts layers into a project; both are written without QGIS.
The elements are those that QGIS 3.22 writes, without those that have defaults; later versions read them unchanged.
Standard library only.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr, unescape

# The last version of 3.22, which warns that a project of an earlier 3.22 is old; from 3.26 on QGIS warns
# only of projects of later versions and of QGIS 2.
VERSION = "3.22.16-Białowieża"
CATEGORIES = "LayerConfiguration|Symbology|Symbology3D|Labeling|Temporal"
EDGE = "#232323"
# QGIS's keys for the simplest symbol layers of markers, lines and fills.
_CLASSES = {"marker": "SimpleMarker", "line": "SimpleLine", "fill": "SimpleFill"}


@dataclass(frozen=True)
class Span:
    """The label of a class of values: its ends, of which one may be open, and their unit; as text it is English."""

    unit: str
    low: float | None = None
    high: float | None = None

    def __str__(self) -> str:
        if self.high is None:
            return f"over {self.low:g} {self.unit}"
        return f"{'up to' if self.low is None else f'{self.low:g} to'} {self.high:g} {self.unit}"


Label = str | Span


def _label(label: Label) -> str:
    """The attribute and, for a range, its parts, which QGIS ignores and `relabelled` reads."""
    if isinstance(label, str):
        return f" label={quoteattr(label)}"
    ends = (("low", label.low), ("high", label.high))
    facts = "".join(f' label_{name}="{end:g}"' for name, end in ends if end is not None)
    return f" label={quoteattr(str(label))} label_unit={quoteattr(label.unit)}{facts}"


_LABELLED = re.compile(r' label="([^"]*)"((?: label_\w+="[^"]*")*)')


def relabelled(style: str, say: Callable[[Label], str]) -> str:
    """A style with its labels replaced, for example by those in another language."""

    def said(found: re.Match[str]) -> str:
        facts = dict(re.findall(r'label_(\w+)="([^"]*)"', found[2]))
        if not facts:
            return _label(say(unescape(found[1])))
        low, high = (float(facts[name]) if name in facts else None for name in ("low", "high"))
        return _label(say(Span(unescape(facts["unit"]), low, high)))

    return _LABELLED.sub(said, style)


@dataclass(frozen=True)
class Symbol:
    """A symbol; ``kind`` is marker, line or fill, ``beneath`` what is drawn first, such as a wider line around it."""

    kind: str
    facts: tuple[tuple[str, str], ...]
    beneath: Symbol | None = None

    def xml(self, name: str) -> str:
        under = self.beneath.layer() if self.beneath else ""
        return (
            f'<symbol type="{self.kind}" name={quoteattr(name)} alpha="1" clip_to_extent="1" force_rhr="0">'
            f"{under}{self.layer()}</symbol>"
        )

    def layer(self) -> str:
        options = "".join(_option(key, value) for key, value in self.facts)
        return (
            f'<layer class="{_CLASSES[self.kind]}" enabled="1" locked="0" pass="0">'
            f'<Option type="Map">{options}</Option></layer>'
        )


def marker(colour: str, size_mm: float, *, shape: str = "circle", edge: str = EDGE, edge_mm: float = 0.1) -> Symbol:
    facts = {"name": shape, "color": rgba(colour), "size": f"{size_mm:g}", "size_unit": "MM"}
    facts |= {"outline_color": rgba(edge), "outline_width": f"{edge_mm:g}", "outline_style": "solid"}
    return Symbol("marker", tuple(facts.items()))


def line(colour: str, width: float, *, alpha: int = 255, unit: str = "MM") -> Symbol:
    facts = {"line_color": rgba(colour, alpha), "line_width": f"{width:g}", "line_width_unit": unit}
    return Symbol("line", tuple((facts | {"capstyle": "round", "joinstyle": "round"}).items()))


def fill(colour: str | None, edge: str, *, alpha: int = 255, edge_mm: float = 0.26) -> Symbol:
    """A filled outline; without a colour only the outline."""
    facts = {"color": rgba(colour or edge, alpha), "style": "solid" if colour else "no"}
    facts |= {"outline_color": rgba(edge), "outline_width": f"{edge_mm:g}", "outline_style": "solid"}
    return Symbol("fill", tuple(facts.items()))


def rgba(colour: str, alpha: int = 255) -> str:
    """``#rrggbb`` as QGIS writes it: r,g,b,a."""
    return ",".join(str(int(colour[k : k + 2], 16)) for k in (1, 3, 5)) + f",{alpha}"


def single(symbol: Symbol) -> str:
    return f'<renderer-v2 type="singleSymbol"><symbols>{symbol.xml("0")}</symbols></renderer-v2>'


def categorized(field: str, rows: Sequence[tuple[str, str, Symbol]]) -> str:
    """One symbol for each value: (value, label, symbol)."""
    listed = "".join(
        f'<category render="true" symbol="{k}" value={quoteattr(value)} label={quoteattr(label)}/>'
        for k, (value, label, _) in enumerate(rows)
    )
    symbols = "".join(symbol.xml(str(k)) for k, (_, _, symbol) in enumerate(rows))
    return (
        f'<renderer-v2 type="categorizedSymbol" attr={quoteattr(field)}>'
        f"<categories>{listed}</categories><symbols>{symbols}</symbols></renderer-v2>"
    )


def graduated(field: str, rows: Sequence[tuple[float, float, Label, Symbol]]) -> str:
    """One symbol for each range of values: (low, high, label, symbol)."""
    listed = "".join(
        f'<range render="true" symbol="{k}" lower="{low:.10g}" upper="{high:.10g}"{_label(label)}/>'
        for k, (low, high, label, _) in enumerate(rows)
    )
    symbols = "".join(symbol.xml(str(k)) for k, (*_, symbol) in enumerate(rows))
    return (
        f'<renderer-v2 type="graduatedSymbol" attr={quoteattr(field)} graduatedMethod="GraduatedColor">'
        f"<ranges>{listed}</ranges><symbols>{symbols}</symbols></renderer-v2>"
    )


# Without a weight QGIS takes the thinnest one; newer versions go by the name.
NORMAL, BOLD = 'fontWeight="50" namedStyle="Regular"', 'fontWeight="75" namedStyle="Bold"'


def labels(expression: str) -> str:
    """Labels with a white halo, from an expression."""
    return (
        '<labeling type="simple"><settings calloutType="simple">'
        f'<text-style fieldName={quoteattr(expression)} isExpression="1" fontSize="10" fontSizeUnit="Point" {BOLD} '
        'textColor="30,30,30,255" textOpacity="1">'
        '<text-buffer bufferDraw="1" bufferSize="0.8" bufferSizeUnits="MM" bufferColor="255,255,255,255" '
        'bufferOpacity="1"/></text-style>'
        '<placement placement="2" placementFlags="10"/><rendering drawLabels="1"/></settings></labeling>'
    )


def intervals(start_field: str, end_field: str) -> str:
    """Each feature is shown from the time in one field to that in the other."""
    return (
        f'<temporal enabled="1" mode="2" startField={quoteattr(start_field)} endField={quoteattr(end_field)} '
        'durationField="" startExpression="" endExpression="" durationUnit="s" fixedDuration="0" accumulate="0" '
        'limitMode="0"><fixedRange><start></start><end></end></fixedRange></temporal>'
    )


def appears(day: tuple[int, int, int], seconds_field: str) -> str:
    """Each feature is shown from a number of seconds after the start of a day.

    In QGIS, a time added to a date loses fractions of a second, and one made from an epoch has a time zone.
    """
    seconds = f'"{seconds_field}"'
    parts = (
        *map(str, day),
        f"floor({seconds} / 3600)",
        f"floor({seconds} / 60) % 60",
        f"{seconds} - 60 * floor({seconds} / 60)",
    )
    moment = f"make_datetime({', '.join(parts)})"
    return (
        '<temporal enabled="1" mode="4" startField="" endField="" durationField="" '
        f'startExpression={quoteattr(moment)} endExpression="" durationUnit="s" fixedDuration="0" accumulate="0" '
        'limitMode="0"><fixedRange><start></start><end></end></fixedRange></temporal>'
    )


# --- the 3-D view ---------------------------------------------------------------------------------------------------


def cones_3d(rows: Iterable[tuple[str, float, float, float, str]]) -> str:
    """Upright truncated cones on the terrain, one row for each rule: (filter, base radius, top radius, length [m],
    colour).

    QGIS places the middle of a shape on the ground, so each is raised by half its length.
    """
    return _solids_3d(
        "cone",
        [
            (condition, {"bottomRadius": base, "topRadius": top, "length": length}, 0.5 * length, colour)
            for condition, base, top, length, colour in rows
        ],
    )


def spheres_3d(rows: Iterable[tuple[str, float, float, str]]) -> str:
    """Spheres, one row for each rule: (filter, radius [m], height of the middle above the terrain [m], colour)."""
    return _solids_3d("sphere", [(condition, {"radius": radius}, up, colour) for condition, radius, up, colour in rows])


def _solids_3d(kind: str, rows: Iterable[tuple[str, dict[str, float], float, str]]) -> str:
    """Points on the terrain as solids, one row for each rule: (filter, sizes [m], by how much it is raised [m],
    colour).
    """
    rules = []
    for k, (condition, sizes, up, colour) in enumerate(rows):
        shape = "".join(f'<Option type="double" name="{name}" value="{size:.6g}"/>' for name, size in sizes.items())
        raised = f"1 0 0 0 0 1 0 0 0 0 1 0 0 {up:.6g} 0 1"  # column by column; the second axis is up
        rules.append(
            f'<rule key="{_key(k + 1)}" filter={quoteattr(condition)}><symbol type="point" shape="{kind}" '
            f'material_type="phong"><data alt-clamping="terrain"/>{_phong(colour)}'
            f'<shape-properties><Option type="Map">{shape}</Option></shape-properties>'
            f'<transform matrix="{raised}"/></symbol></rule>'
        )
    return f'<renderer-3d type="rulebased">{_TILING}<rules key="{_key(0)}">{"".join(rules)}</rules></renderer-3d>'


def faces_3d(colour: str) -> str:
    """Multipolygons whose parts are the faces of solids, in their own heights."""
    data = (
        '<data alt-clamping="absolute" alt-binding="vertex" extrusion-height="0" height="0" '
        'culling-mode="no-culling" add-back-faces="1" invert-normals="0" rendered-facade="3"/>'
    )
    return _one_3d("polygon", data, colour)


def ribbons_3d(colour: str, width_px: float) -> str:
    """Lines in their own heights, of a width in pixels."""
    data = (
        f'<data alt-clamping="absolute" alt-binding="vertex" simple-lines="1" width="{width_px:g}" '
        'extrusion-height="0" height="0"/>'
    )
    return _one_3d("line", data, colour)


def walls_3d(colour: str, width_m: float, height_m: float) -> str:
    """Lines on the terrain as walls."""
    data = (
        f'<data alt-clamping="terrain" alt-binding="vertex" simple-lines="0" width="{width_m:g}" '
        f'extrusion-height="{height_m:g}" height="0"/>'
    )
    return _one_3d("line", data, colour)


_TILING = '<vector-layer-3d-tiling zoom-levels-count="3" show-bounding-boxes="0"/>'


def _one_3d(kind: str, data: str, colour: str) -> str:
    return (
        f'<renderer-3d type="vector">{_TILING}<symbol type="{kind}" material_type="phong">'
        f'{data}{_phong(colour)}<edges width="1" enabled="0" color="0,0,0,255"/></symbol></renderer-3d>'
    )


def _phong(colour: str) -> str:
    half = "#" + "".join(f"{int(colour[k : k + 2], 16) // 2:02x}" for k in (1, 3, 5))
    return (
        f'<material ambient="{rgba(half)}" diffuse="{rgba(colour)}" specular="60,60,60,255" shininess="0">'
        "<data-defined-properties/></material>"
    )


def _key(number: int) -> str:
    """Rules are distinguished by a UUID; a fixed one keeps the file the same from run to run."""
    return f"{{00000000-0000-4000-8000-{number:012d}}}"


# --- rasters --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Stop:
    """A colour at a value; an ``alpha`` of 0 is transparent."""

    value: float
    colour: str
    label: str
    alpha: int = 255


def ramp(stops: Sequence[Stop], *, opacity: float = 0.9) -> str:
    """Colours interpolated between the stops, which the legend lists; beyond the last stop its colour is kept."""
    listed = "".join(
        f'<item value="{stop.value:.10g}" color="{stop.colour}" alpha="{stop.alpha}" label={quoteattr(stop.label)}/>'
        for stop in stops
    )
    low, high = f"{stops[0].value:.10g}", f"{stops[-1].value:.10g}"
    return (
        f'<pipe><rasterrenderer type="singlebandpseudocolor" band="1" opacity="{opacity:g}" alphaBand="-1" '
        f'classificationMin="{low}" classificationMax="{high}">{_GIVEN}<rastershader>'
        f'<colorrampshader colorRampType="INTERPOLATED" classificationMode="1" clip="0" minimumValue="{low}" '
        f'maximumValue="{high}" labelPrecision="6">{listed}<rampLegendSettings useContinuousLegend="0"/>'
        f"</colorrampshader></rastershader></rasterrenderer>{_SHARP}</pipe><blendMode>0</blendMode>"
    )


def paletted(rows: Sequence[tuple[int, str, str]]) -> str:
    """One colour per value: (value, colour, label); other values are transparent."""
    listed = "".join(
        f'<paletteEntry value="{value}" color="{colour}" label={quoteattr(label)} alpha="255"/>'
        for value, colour, label in rows
    )
    return (
        '<pipe><rasterrenderer type="paletted" band="1" opacity="0.8" alphaBand="-1" nodataColor="">'
        f"{_GIVEN}<colorPalette>{listed}</colorPalette></rasterrenderer>{_SHARP}</pipe><blendMode>0</blendMode>"
    )


def relief_shading() -> str:
    """Terrain lit from several sides, paled so that what lies on it stands out."""
    return (
        '<pipe><rasterrenderer type="hillshade" band="1" opacity="0.6" alphaBand="-1" azimuth="315" angle="45" '
        f'zfactor="1" multidirection="1">{_GIVEN}</rasterrenderer>{_SMOOTH}</pipe><blendMode>0</blendMode>'
    )


_GIVEN = "<minMaxOrigin><limits>None</limits><extent>WholeRaster</extent></minMaxOrigin>"
_SHARP = '<rasterresampler maxOversampling="2"/><resamplingStage>resamplingFilter</resamplingStage>'
_SMOOTH = (
    '<rasterresampler zoomedInResampler="bilinear" zoomedOutResampler="bilinear" maxOversampling="2"/>'
    "<resamplingStage>resamplingFilter</resamplingStage>"
)


def document(inner: str, *, labelled: bool = False) -> str:
    """A whole style file around the pieces above."""
    return (
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
        f'<qgis version="{VERSION}" styleCategories="{CATEGORIES}" labelsEnabled="{int(labelled)}">'
        f"{inner}</qgis>\n"
    )


def _option(name: str, value: str) -> str:
    return f'<Option type="QString" name={quoteattr(name)} value={quoteattr(value)}/>'
