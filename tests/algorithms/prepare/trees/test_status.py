"""Dead trees and snags: found by their codes, kept apart, and written as releases that slide-logs and others read."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest

from deadwood_algorithms import schemas
from deadwood_algorithms.params.tool import UserError
from deadwood_algorithms.prepare.trees.status import DEAD, GONE, LIVE, code_of, codes, meaning_of
from deadwood_algorithms.tools import sample_releases

EAST, NORTH = 2_783_050.0, 1_190_050.0


def table(*rows: str, head: str = "x;y;dbh;h;Zustand") -> str:
    return "\n".join([head, *(f"{EAST + 5 * k};{NORTH};{row}" for k, row in enumerate(rows))])


MIXED = table("40;25;lebend", "50;20;tot", "30;18;", "35;12;Dürrständer", "45;30;gefällt")


@pytest.mark.parametrize(
    ("value", "code"),
    [(3.0, "3"), (np.int64(4), "4"), (" Dead, Broken Bole", "dead, broken bole"), (np.nan, ""), (None, "")],
)
def test_codes_are_compared_as_words(value, code):
    assert code_of(value) == code


def test_lists_of_codes():
    assert codes("3, 4") == ("3", "4")
    assert codes("Standing dead; Dead, broken bole") == ("standing dead", "dead, broken bole")
    assert codes(None) == ()


def test_the_usual_words_in_the_usual_fields_are_known(imported, tmp_path, outcome, said):
    trees = imported(MIXED, snags=str(tmp_path / "snags.gpkg"))
    assert trees["dbh_cm"].tolist() == [40, 30]
    snags = gpd.read_file(tmp_path / "snags.gpkg")
    assert snags["dbh_cm"].tolist() == [50, 35]
    assert outcome["last"].facts["dead"] == 2
    assert f"2 dead standing trees written to {tmp_path / 'snags.gpkg'}" in outcome["last"].lines
    assert "1 tree dropped: no longer standing" in outcome["last"].lines
    assert "field 'Zustand': living (lebend: 1, empty: 1); dead, standing (" in said.notes[-1]
    assert str(outcome["last"].outputs["snags"]) == str(tmp_path / "snags.gpkg")


def test_without_the_option_they_are_kept_apart_and_reported(imported, outcome):
    assert imported(MIXED)["dbh_cm"].tolist() == [40, 30]
    assert "2 dead standing trees kept apart; --snags writes them as a releases layer" in outcome["last"].lines


def test_they_may_stay_among_the_trees_as_well(imported, tmp_path, outcome):
    trees = imported(MIXED, snags=str(tmp_path / "snags.gpkg"), keep_dead=True)
    assert trees["dbh_cm"].tolist() == [40, 50, 30, 35]
    assert len(gpd.read_file(tmp_path / "snags.gpkg")) == 2
    assert ", and kept among the trees" in " ".join(outcome["last"].lines)


def test_codes_of_ones_own(imported, tmp_path):
    text = table("40;25;1", "50;20;7", "30;18;8", "35;12;9", head="x;y;dbh;h;code")
    values = {"status_field": "CODE", "dead_values": "7,8", "gone_values": "9", "snags": str(tmp_path / "s.gpkg")}
    assert imported(text, **values)["dbh_cm"].tolist() == [40]
    assert gpd.read_file(tmp_path / "s.gpkg")["dbh_cm"].tolist() == [50, 30]


def test_what_the_user_says_overrides_the_usual_words(imported, tmp_path):
    text = table("40;25;lebend", "50;20;liegend")
    imported(text, dead_values="liegend", status_field="Zustand", snags=str(tmp_path / "s.gpkg"))
    assert gpd.read_file(tmp_path / "s.gpkg")["dbh_cm"].tolist() == [50]
    trees = imported(table("40;25;lebend", "50;20;tot"), gone_values="tot", status_field="Zustand")
    assert trees["dbh_cm"].tolist() == [40]


def test_the_releases_are_a_layer_of_the_contract(imported, tmp_path, slope, said):
    path = tmp_path / "snags.gpkg"
    imported(
        table(
            "40;25;A;lebend;Fichte", "50;20;B;tot;Fichte", "60;;C;tot;Tanne", head="x;y;dbh;h;baum_id;Zustand;Baumart"
        ),
        snags=str(path),
    )
    snags = gpd.read_file(path)
    assert snags["log_id"].tolist() == [1, 2]
    assert snags["release_id"].tolist() == ["B", "C"]
    assert snags["length_m"].tolist() == pytest.approx([20, (60 / 2.52) ** (1 / 0.84)])
    assert snags["orientation"].tolist() == ["upright"] * 2
    assert snags["species"].tolist() == ["Fichte", "Tanne"]
    known = {column.name for column in schemas.RELEASES.columns}
    assert {"log_id", "release_id", "dbh_cm", "length_m", "orientation"} <= known
    sample_releases.TOOL(areas=str(path), dem=slope(), count=3, radius_m=2.0, output=str(tmp_path / "r.gpkg"))
    logs = gpd.read_file(tmp_path / "r.gpkg")
    assert logs["release_id"].tolist() == ["B", "C"] * 3
    assert logs["dbh_cm"].tolist() == [50, 60] * 3


def test_faults(imported, tmp_path):
    with pytest.raises(UserError, match="no dead tree is found for --snags; --status-field and --dead-values name"):
        imported(table("40;25;lebend"), snags=str(tmp_path / "s.gpkg"))
    assert not (tmp_path / "s.gpkg").exists()
    with pytest.raises(UserError, match=r"no field 'state' \(--status-field\)"):
        imported(MIXED, status_field="state")
    with pytest.raises(UserError, match="--dead-values and --gone-values need --status-field"):
        imported("x;y;h\n2783050;1190050;20\n", dead_values="7")
    with pytest.raises(UserError, match="--snags and --output are one file"):
        imported(MIXED, snags=str(tmp_path / "out.gpkg"))
    with pytest.raises(UserError, match="no tree is left; .*1 tree dropped: no longer standing"):
        imported(table("40;25;gefällt"))


@pytest.mark.parametrize(
    ("meaning", "words"),
    [
        (LIVE, "alive; living; live; healthy; ok; lebend; lebend, krone gebrochen; lebt; gesund"),
        (LIVE, "vital; vivant; vivante; vif; sain; viva; vivo; sano"),
        (DEAD, "dead; standing dead; snag; dürr; dürrständer; duerrstaender; abgestorben; tot"),
        (DEAD, "toter baum; stehend tot; totholz, stehend; abgängig; hochstumpf; mort; morte"),
        (DEAD, "mort sur pied; sur pied sec; sèche; chandelle; dépéri; morto; morta; morto in piedi"),
        (DEAD, "secco; secca"),
        (GONE, "lying dead; fallen; windthrown; wind thrown; uprooted; stump; cut; felled; harvested"),
        (GONE, "dead, on the ground; liegend; liegend tot; totholz, liegt; geworfen"),
        (GONE, "vom wind geworfen; windwurf; sturmwurf; windbruch; sturmholz; umgestürzt; umgefallen"),
        (GONE, "entwurzelt; wurzelteller; gefällt; entnommen; geerntet; wurzelstock; baumstumpf"),
        (GONE, "stumpf; strunk; stubben; chablis; volis; tombé; mort au sol; couché; renversé; coupé"),
        (GONE, "abattu; souche; déraciné; schiantato; schiantati; schianto; morto a terra; caduto"),
        (GONE, "sradicato; abbattuto; tagliato; ceppaia; ceppo"),
        (None, "nicht tot; not dead; pas mort; non morto; kein wurzelteller; krank; 7; ja; standing"),
        (None, "stehend; in piedi"),
    ],
)
def test_every_word_for_the_status_in_four_languages(meaning, words):
    """Lying comes before dead, and what is negated or says neither is not known."""
    found = {word: meaning_of(word, None, None) for word in words.split("; ")}
    assert found == dict.fromkeys(words.split("; "), meaning)
