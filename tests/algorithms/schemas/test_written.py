"""Exactly what the schemas declare is written: every tool runs once, and its files are read."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import every_output
import pytest
import rasterio
from every_output import Found, Pictures

from deadwood_algorithms.schemas import BARRIERS, BLOCKS, LINES, LYING_LOGS, RELEASES, STRUCTURES, TREES
from deadwood_algorithms.schemas.files import DANGER, FAILED, TERRAIN_TILES
from deadwood_algorithms.schemas.words import JsonFile, Layer, Output, RasterFile, TableFile
from deadwood_algorithms.schemas.written import WRITTEN, band_named, fits
from deadwood_toolbox.shelf import NAMES

# Users' layers as given, without columns that they lack; columns written only after a defect of the engine, and those
# only with a terrain model in tiles.
COPIED = (RELEASES, TREES, BARRIERS, LYING_LOGS, BLOCKS, LINES, STRUCTURES)
ABSENT = (FAILED, TERRAIN_TILES)


@pytest.fixture(scope="module")
def pictures() -> Pictures:
    return Pictures()


@pytest.fixture(scope="module")
def found(tmp_path_factory, pictures) -> list[Found]:
    with pictures.watched():
        return every_output.run_every_tool(tmp_path_factory.mktemp("every_tool"))


def test_all_that_a_tools_picture_says_lies_within_it(found, pictures):
    """Titles, keys, names of ticks; a picture that is cropped to its content cannot cut any of them off."""
    assert len(found) > 100
    assert len(pictures.seen) > 20
    assert pictures.over == []


def unmatched(names: Iterable[str], declared: Iterable[str]) -> list[str]:
    declared = list(declared)
    return [name for name in names if not any(fits(each, name) for each in declared)]


def names_in(found: Found, what: object) -> list[str]:
    """The columns, bands or keys of what was written."""
    if isinstance(what, RasterFile):
        return [" | ".join(band) for band in every_output.bands_of(found.path)]
    if isinstance(what, JsonFile):
        return sorted(every_output.keys_of(found.path))
    if isinstance(what, Layer) and what.geometry:
        return sorted(every_output.layer_of(found)[1])
    return every_output.columns_of(found.path) if isinstance(what, (Layer, TableFile)) else []


def names_of(what: object) -> list[str]:
    """The columns, bands or keys that are declared."""
    if isinstance(what, RasterFile):
        return [" | ".join((band.name, band.unit, band.number)) for band in what.bands]
    if isinstance(what, JsonFile):
        return [key.name for key in what.keys]
    return [column.name for column in what.columns] if isinstance(what, (Layer, TableFile)) else []


def below_a_whole(name: str, what: object) -> bool:
    """Whether a key lies within one that is declared with all that is in it."""
    wholes = [key.name for key in what.keys if key.whole] if isinstance(what, JsonFile) else []
    parts = re.split(r"(?=\.|\[)", name)
    heads = ["".join(parts[: k + 1]) for k in range(len(parts) - 1)]
    return any(fits(whole, head) for whole in wholes for head in heads)


def declared_at(found: Found) -> Iterator[Output]:
    yield from (each for each in WRITTEN if each.tool == found.tool and fits(each.place, found.place))


def test_every_tool_has_been_run(found):
    """Except view, which writes a report like make-report; check and inspect, which write nothing; and warm-up."""
    assert (
        {each.tool for each in found}
        == set(NAMES) - {"view", "check", "inspect", "warm-up"}
        == {each.tool for each in WRITTEN}
    )


def test_every_file_and_layer_that_is_written_is_declared_once(found):
    counts = {f"{each.tool} {each.place}": len(list(declared_at(each))) for each in found}
    assert {place: count for place, count in counts.items() if count != 1} == {}


def test_every_file_and_layer_that_is_declared_is_written(found):
    missing = [
        f"{each.tool} {each.place}"
        for each in WRITTEN
        if each.what not in ABSENT and not any(each in declared_at(one) for one in found)
    ]
    assert missing == []


def test_every_column_band_and_key_that_is_written_is_declared(found):
    strange = {}
    for each in found:
        (output,) = declared_at(each)
        what = output.what
        if isinstance(what, Layer) and what.keeps_source:
            continue
        names = [name for name in names_in(each, what) if not below_a_whole(name, what)]
        if unknown := unmatched(names, names_of(what)):
            strange[f"{each.tool} {each.place}"] = unknown
    assert strange == {}


def test_every_column_band_and_key_that_is_declared_is_written(found):
    seen: dict[int, set[str]] = {}
    for each in found:
        (output,) = declared_at(each)
        seen.setdefault(id(output.what), set()).update(names_in(each, output.what))
    never = {
        f"{output.tool} {output.place}": silent
        for output in WRITTEN
        if output.what not in (*COPIED, *ABSENT)
        if (silent := [d for d in names_of(output.what) if not any(fits(d, name) for name in seen[id(output.what)])])
    }
    assert never == {}


def test_geometries_are_those_declared(found):
    wrong = {}
    for each in found:
        (output,) = declared_at(each)
        if isinstance(output.what, Layer) and output.what.geometry:
            geometry = every_output.layer_of(each)[0]
            if geometry not in output.what.geometry:
                wrong[f"{each.tool} {each.place}"] = geometry
    assert wrong == {}


def test_the_names_above_match_as_they_should():
    assert fits("reach_LINE_percent", "reach_road_percent")
    assert fits("difference_SCENARIO.tif", "difference_with-forest.tif")
    assert fits("speed, PERCENT % | m/s | float32", "speed, 90 % | m/s | float32")
    assert fits(" | m | NUMBER", " | m | uint16")
    assert fits("logs.by_stop_reason.REASON", "logs.by_stop_reason.tree")
    assert fits("run.gpkg|layername=deposits", "run.gpkg|layername=deposits")
    assert not fits("reach_LINE", "runout_m")
    assert not fits("reach[].p", "reach[].ci_low")


def test_bands_have_short_names_and_say_what_they_mean(found):
    """Names that fit a list of layers; the meaning as ``long_name``, also if GDAL has rewritten the file."""
    for each in found:
        if each.path.suffix != ".tif" or fits("dem_CHANGE.tif", each.path.name) or each.path.name == "dem.tif":
            continue
        with rasterio.open(each.path) as source:
            for number, name in enumerate(source.descriptions, start=1):
                assert name is None or len(name) <= 32, (each.place, name)
                if name is not None:
                    assert len(source.tags(number)["long_name"]) > 10, (each.place, name)


def test_a_band_has_the_meaning_of_the_name_that_fits_it_best():
    for name, words in (("line road", "Share that reaches"), ("line road: upper end", "Upper end")):
        band = band_named("origins", name)
        assert band is not None
        assert band.meaning.startswith(words)
    assert band_named("danger", "road") == DANGER.bands[-1]
    assert band_named("danger", "any_line") == DANGER.bands[0]
    assert band_named("unknown", "any_line") is None
