"""Species by whole names: those that were once confused, authors, spellings, and every name once."""

from __future__ import annotations

import pytest

from deadwood_algorithms.params.presets import OF_SPECIES, WOODS
from deadwood_algorithms.params.species import NAMES, SPECIES, SYNONYMS, species_of
from deadwood_algorithms.prepare.mobilisation.decay import CRITICAL, OUTSIDE, UNKNOWN, of_years, rate_of


@pytest.mark.parametrize(
    ("text", "binomial"),
    [
        # read as pine, beech, pine, pine, pine and Scots pine when a part of a name was enough
        ("Carpinus betulus", "Carpinus betulus"), ("Hainbuche", "Carpinus betulus"), ("sapin", "Abies alba"),
        ("subalpine fir", "Abies lasiocarpa"), ("alpine larch", "Larix lyallii"), ("Pinus radiata", "Pinus radiata"),
        ("Picea abies (L.) H. Karst.", "Picea abies"), ("PICEA ABIES L.", "Picea abies"), ("Fichte", "Picea abies"),
        ("Epicéa", "Picea abies"), ("epicea commun", "Picea abies"), ("Picea excelsa", "Picea abies"),
        ("Weißtanne", "Abies alba"), ("Foehre", "Pinus sylvestris"), ("Föhre", "Pinus sylvestris"),
        ("Waldfoehre", "Pinus sylvestris"), (" pin ", "Pinus sylvestris"), ("Douglas-fir", "Pseudotsuga menziesii"),
        ("Buche (Rotbuche)", "Fagus sylvatica"), ("Hêtre", "Fagus sylvatica"), ("Picea", "Picea abies"),
        ("Lärche", "Larix decidua"), ("Laerche", "Larix decidua"), ("pino cembro", "Pinus cembra"),
    ],
)  # fmt: skip
def test_a_name_is_that_of_its_species(text, binomial):
    found = species_of(text)
    assert found is not None
    assert found.binomial == binomial


@pytest.mark.parametrize(
    "text",
    [
        "",
        "Pinus",
        "Pinus sp.",
        "Quercus ilex",
        "x",
        "sapinette",
        "pin noir et autres",
        "12",
        "fir tree",
        "Buche Fichte",
    ],
)
def test_what_is_not_in_the_table_is_unknown(text):
    assert species_of(text) is None


def test_every_name_is_of_one_species_and_every_wood_of_a_species():
    names = [name.casefold() for each in SPECIES for name in (each.binomial, *each.names)]
    assert len(names) == len(set(names))
    assert set(SYNONYMS.values()) | set(OF_SPECIES) <= set(NAMES)
    for wood in WOODS.values():
        assert rate_of(wood.binomial) == rate_of(wood.name) == wood.rate
    assert {each.binomial for each in SPECIES if rate_of(each.binomial) is not None} == set(OF_SPECIES)


def test_rates_of_downed_wood_say_nothing_of_snags():
    window = (2.0, 5.0)
    assert of_years(3.0, "Fagus sylvatica", window) == CRITICAL
    assert of_years(4.0, "Fagus sylvatica", window) == OUTSIDE
    assert of_years(4.0, "Fagus sylvatica", window, standing=True) == UNKNOWN
    assert of_years(4.0, "Picea abies", window, standing=True) == CRITICAL  # the years of spruce are of both
    assert of_years(6.0, "Abies alba", window, standing=True) == OUTSIDE  # that of spruce is used, and this is reported
