"""Trees by their binomial and by common names in German, French, Italian and English: whole names, never parts of them.

A name that is not in the table is unknown, and reported as such. What is known of a species (density, decay, a law of
DBH and height) is a `presets.Wood`, and most have none; then that is reported, too. A bare common
name (pine, Kiefer) is that of the commonest such species of the Alps. Standard library only.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import cache

# binomial: common names
NAMES = {
    "Abies alba": "Tanne, Weisstanne, sapin, sapin blanc, sapin pectiné, sapin commun, abete bianco, silver fir, "
    "European silver fir, fir",
    "Abies lasiocarpa": "Felsengebirgstanne, sapin subalpin, subalpine fir",
    "Acer campestre": "Feldahorn, érable champêtre, acero campestre, field maple",
    "Acer platanoides": "Spitzahorn, érable plane, acero riccio, Norway maple",
    "Acer pseudoplatanus": "Ahorn, Bergahorn, érable, érable sycomore, acero, acero di monte, sycamore, sycamore maple",
    "Alnus glutinosa": "Schwarzerle, aulne glutineux, ontano nero, black alder, common alder",
    "Alnus incana": "Grauerle, Weisserle, aulne blanc, ontano bianco, grey alder, gray alder",
    "Alnus alnobetula": "Grünerle, aulne vert, ontano verde, green alder",
    "Betula pendula": "Birke, Hängebirke, bouleau, bouleau verruqueux, betulla, birch, silver birch",
    "Carpinus betulus": "Hainbuche, Hagebuche, Weissbuche, charme, carpino, carpino bianco, hornbeam",
    "Castanea sativa": "Kastanie, Edelkastanie, châtaignier, castagno, sweet chestnut, chestnut",
    "Fagus sylvatica": "Fagus, Buche, Rotbuche, hêtre, faggio, beech, European beech, common beech",
    "Fraxinus excelsior": "Esche, frêne, frassino, frassino maggiore, ash, European ash, common ash",
    "Larix decidua": "Lärche, Europäische Lärche, mélèze, mélèze d'Europe, larice, larch, European larch",
    "Larix kaempferi": "Japanlärche, Japanische Lärche, mélèze du Japon, larice giapponese, Japanese larch",
    "Larix lyallii": "Felsengebirgslärche, alpine larch, subalpine larch",
    "Ostrya carpinifolia": "Hopfenbuche, charme-houblon, carpino nero, hop hornbeam",
    "Picea abies": "Picea, Fichte, Rotfichte, Rottanne, épicéa, épicéa commun, abete rosso, peccio, spruce, "
    "Norway spruce",
    "Picea engelmannii": "Engelmannfichte, épicéa d'Engelmann, Engelmann spruce",
    "Picea sitchensis": "Sitkafichte, Sitka-Fichte, épicéa de Sitka, abete di Sitka, Sitka spruce",
    "Pinus cembra": "Arve, Zirbe, Zirbelkiefer, arolle, pin cembro, pin arolle, cembro, pino cembro, Swiss stone pine, "
    "arolla pine, stone pine",
    "Pinus mugo": "Bergföhre, Bergkiefer, Legföhre, Latsche, Latschenkiefer, pin de montagne, pin mugo, mugo, "
    "pino mugo, mountain pine, dwarf mountain pine",
    "Pinus nigra": "Schwarzföhre, Schwarzkiefer, pin noir, pin noir d'Autriche, pino nero, black pine, Austrian pine",
    "Pinus pinaster": "Strandkiefer, pin maritime, pino marittimo, maritime pine",
    "Pinus ponderosa": "Gelbkiefer, pin ponderosa, ponderosa pine",
    "Pinus radiata": "Monterey-Kiefer, pin de Monterey, pino di Monterey, Monterey pine, radiata pine",
    "Pinus strobus": "Strobe, Weymouthsföhre, Weymouthskiefer, pin Weymouth, pino strobo, Weymouth pine, "
    "eastern white pine",
    "Pinus sylvestris": "Föhre, Kiefer, Waldföhre, Waldkiefer, Gemeine Kiefer, pin, pin sylvestre, pino, "
    "pino silvestre, pine, Scots pine, Scotch pine",
    "Pinus uncinata": "Hakenkiefer, aufrechte Bergföhre, pin à crochets, pino uncinato",
    "Populus tremula": "Aspe, Espe, Zitterpappel, tremble, pioppo tremulo, aspen, European aspen",
    "Prunus avium": "Kirschbaum, Vogelkirsche, merisier, ciliegio, wild cherry",
    "Pseudotsuga menziesii": "Douglasie, douglas, sapin de Douglas, douglasia, abete di Douglas, Douglas fir",
    "Quercus petraea": "Traubeneiche, chêne sessile, chêne rouvre, rovere, sessile oak",
    "Quercus pubescens": "Flaumeiche, chêne pubescent, roverella, downy oak",
    "Quercus robur": "Eiche, Stieleiche, chêne, chêne pédonculé, quercia, farnia, oak, English oak, pedunculate oak",
    "Robinia pseudoacacia": "Robinie, robinier, robinia, black locust",
    "Sorbus aucuparia": "Vogelbeere, Vogelbeerbaum, sorbier, sorbier des oiseleurs, sorbo degli uccellatori, rowan",
    "Taxus baccata": "Eibe, if, tasso, yew",
    "Thuja plicata": "Riesenlebensbaum, thuya géant, western red cedar, western redcedar",
    "Tilia cordata": "Linde, Winterlinde, tilleul, tilleul à petites feuilles, tiglio, tiglio selvatico, "
    "small-leaved lime",
    "Tsuga heterophylla": "Westliche Hemlocktanne, pruche de l'Ouest, western hemlock",
    "Ulmus glabra": "Ulme, Bergulme, orme, orme de montagne, olmo, olmo montano, elm, wych elm",
}
SYNONYMS = {
    "Abies pectinata": "Abies alba",
    "Alnus viridis": "Alnus alnobetula",
    "Picea excelsa": "Picea abies",
    "Pinus montana": "Pinus mugo",
    "Pseudotsuga taxifolia": "Pseudotsuga menziesii",
    "Quercus sessiliflora": "Quercus petraea",
}


@dataclass(frozen=True)
class Species:
    """A tree species by its binomial."""

    binomial: str
    names: tuple[str, ...]


SPECIES = tuple(Species(binomial, tuple(names.split(", "))) for binomial, names in NAMES.items())


def species_of(text: str) -> Species | None:
    """The species that a cell names, as binomial (with or without its author) or by a common name; None if unknown."""
    words = _words(text)
    known = _known()
    return known.get(" ".join(words)) or known.get(" ".join(words[:2]) if _is_binomial(words) else "")


@cache
def _known() -> dict[str, Species]:
    by_binomial = {each.binomial: each for each in SPECIES}
    known: dict[str, Species] = {}
    for each in SPECIES:
        for name in (each.binomial, *each.names):
            for spelt in (name, _digraphs(name)):
                known[" ".join(_words(spelt))] = each
    return known | {" ".join(_words(old)): by_binomial[now] for old, now in SYNONYMS.items()}


def _is_binomial(words: list[str]) -> bool:
    """Whether the first two words are a binomial of the table, which an author may follow; nothing may follow a common
    name.
    """
    found = _known().get(" ".join(words[:2]))
    latin = {*(" ".join(_words(each)) for each in SYNONYMS), " ".join(_words(found.binomial)) if found else ""}
    return found is not None and " ".join(words[:2]) in latin


def _words(text: str) -> list[str]:
    """Words without case, accents, hyphens and text in brackets; ß is ss."""
    plain = unicodedata.normalize("NFKD", re.sub(r"\(.*?\)", " ", text.casefold()))
    return re.findall(r"[a-z]+", "".join(each for each in plain if not unicodedata.combining(each)))


def _digraphs(name: str) -> str:
    """German spelling without umlauts: Föhre as Foehre."""
    for one, two in (("ä", "ae"), ("ö", "oe"), ("ü", "ue")):
        name = name.replace(one, two).replace(one.upper(), two.capitalize())
    return name
