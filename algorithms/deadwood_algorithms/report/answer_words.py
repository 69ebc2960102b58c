"""The phrases of what other tools found out: worth, barriers, classes, origins, and what the answer hangs on."""

from __future__ import annotations

ANSWER_PHRASES: dict[str, tuple[str, str]] = {
    "worth": ("What each tree is worth", "Was jeder Baum wert ist"),
    "worth_note": (
        "How many logs more would reach the line if the thing were gone, the same log by log as a run without it. "
        "Several things together are not worth the sum of each.",
        "Wie viele Stämme mehr die Linie erreichten, wenn es fehlte, Stamm für Stamm wie in einem Lauf ohne es. "
        "Mehrere zusammen sind nicht die Summe der einzelnen wert.",
    ),
    "worth_counts": (
        "{line}: of {n} {what}, {keep} keep logs away and {bring} bring some.",
        "{line}: von {n} {what} halten {keep} Stämme fern, und {bring} bringen welche.",
    ),
    "worth_none": (
        "None of them changes how many logs reach {line}.",
        "Nichts davon ändert, wie viele {line} erreichen.",
    ),
    "worth_of_some": (
        "Asked with {n} of the run's {all} logs.",
        "Gefragt mit {n} der {all} Stämme des Laufs.",
    ),
    "planted": ("What a tree or log put there would keep away", "Was ein Baum oder Stamm dort fernhielte"),
    "kind_tree": ("trees", "Bäumen"),
    "kind_lying_log": ("lying logs", "liegenden Stämmen"),
    "kind_barrier": ("barriers", "Barrieren"),
    "kind_stand": ("stands", "Beständen"),
    "thing": ("id", "Kennung"),
    "gain_logs": ("logs kept away", "ferngehaltene Stämme"),
    "gain_points": ("points (95 %)", "Punkte (95 %)"),
    "keeps": ("keeps logs away (size: how many)", "hält Stämme fern (Grösse: wie viele)"),
    "brings": ("brings logs", "bringt Stämme"),
    "no_worth": ("other trees", "andere Bäume"),
    "siting": ("Where a barrier serves most", "Wo eine Barriere am meisten nützt"),
    "siting_now": (
        "{share} of the logs reach a line as things are. {n} candidates were put up, each alone.",
        "{share} der Stämme erreichen heute eine Linie. {n} Standorte wurden geprüft, jeder allein.",
    ),
    "siting_note": (
        "First those chosen, one after the other, each with all before it; then the candidates alone that no other one "
        "beats that is neither longer nor higher. The best of many was picked by these logs and serves others a little "
        "less. Barriers are rigid here; where one can be founded, and what it costs, a person decides.",
        "Zuerst die gewählten, eine nach der anderen, jede mit allen vor ihr; dann die Standorte allein, die keiner "
        "übertrifft, der weder länger noch höher ist. Die beste von vielen wurde mit diesen Stämmen gewählt und nützt "
        "gegen andere etwas weniger. Barrieren sind hier starr; wo eine gegründet werden kann und was sie kostet, "
        "entscheidet ein Mensch.",
    ),
    "siting_none": (
        "None was chosen: no candidate keeps more logs away than chance could.",
        "Keine wurde gewählt: kein Standort hält mehr Stämme fern, als Zufall es könnte.",
    ),
    "alone": ("alone", "allein"),
    "chosen": ("chosen: {step}", "gewählt: {step}"),
    "length_height": ("length × height [m]", "Länge × Höhe [m]"),
    "still_reach": ("still reach a line", "erreichen noch eine Linie"),
    "kept_away": ("kept away [points]", "ferngehalten [Punkte]"),
    "energy_p95": ("energy of hits, 95 % [kJ]", "Energie der Treffer, 95 % [kJ]"),
    "barrier_class": ("class", "Klasse"),
    "class_note": (
        "Class: the weakest of {name} that holds that energy, and the upper end of its interval ({source}). The "
        "classes are tested with compact blocks; a slender log may pass through rings or load a net otherwise, so a "
        "person decides.",
        "Klasse: die schwächste von {name}, die diese Energie und das obere Ende ihres Intervalls hält ({source}). "
        "Die Klassen sind mit kompakten Blöcken geprüft; ein schlanker Stamm kann durch Ringe dringen oder ein Netz "
        "anders belasten, darum entscheidet ein Mensch.",
    ),
    "chosen_barrier": ("barrier that is chosen", "gewählte Barriere"),
    "intensity": ("Classes of intensity and probability", "Klassen von Intensität und Wahrscheinlichkeit"),
    "intensity_rule": (
        "The classes of 30 and 300 kJ and of 30, 100 and 300 years are those of the Swiss federal recommendations for "
        "falls of rock (BRP, BWW, BUWAL 1997; BAFU 2016); other bounds are the user's. Which hazard follows, and "
        "whether they suit wood, a person decides.",
        "Die Klassen von 30 und 300 kJ und von 30, 100 und 300 Jahren sind die der eidgenössischen Empfehlungen für "
        "Sturzprozesse (BRP, BWW, BUWAL 1997; BAFU 2016); andere Grenzen sind die des Benutzers. Welche Gefahr daraus "
        "folgt und ob sie zu Holz passen, entscheidet ein Mensch.",
    ),
    "intensity_map": ("Energy of the logs", "Energie der Stämme"),
    "class_and_above": ("this class and above [ha]", "diese Klasse und höhere [ha]"),
    "least_passage": (
        "Where at least {share} % of the logs bring that energy; more logs do not make the areas larger.",
        "Wo mindestens {share} % der Stämme diese Energie haben; mehr Stämme machen die Flächen nicht grösser.",
    ),
    "largest_energy": (
        "The largest energy of all logs, which grows with their number, and with it the area of each class.",
        "Die grösste Energie aller Stämme: Sie wächst mit ihrer Zahl, und mit ihr die Fläche jeder Klasse.",
    ),
    "passage_map": ("Share of the logs that pass", "Anteil der Stämme, die vorbeikommen"),
    "return_map": ("Return period of a passage", "Wiederkehrperiode einer Passage"),
    "class_ground": ("ground [ha]", "Fläche [ha]"),
    "at_least": ("at least [kJ]", "mindestens [kJ]"),
    "return_period": ("return period [years]", "Wiederkehrperiode [Jahre]"),
    "longer_than": ("over {years}", "über {years}"),
    "no_hit": (
        "Where no log passed, less than {share} of the logs may pass yet (95 %).",
        "Wo kein Stamm vorbeikam, kommen vielleicht doch bis zu {share} der Stämme vorbei (95 %).",
    ),
    "from_where": ("From where lines are reached", "Von wo Linien erreicht werden"),
    "from_where_map": (
        "logs released in a cell that reach any line [%]",
        "in einer Zelle freigesetzte Stämme, die eine Linie erreichen [%]",
    ),
    "from_where_note": (
        "Of {n} logs, in cells of {cell} m; a cell with fewer than {least} is empty.",
        "Von {n} Stämmen, in Zellen von {cell} m; eine Zelle mit weniger als {least} ist leer.",
    ),
    "at_least_share": ("at least", "mindestens"),
    "any_line": ("any line", "irgendeine Linie"),
    "reach_it": ("of their logs reach it", "ihrer Stämme erreichen sie"),
    "affected": ("Ground that the logs of a release area pass", "Boden, den die Stämme eines Gebiets überstreichen"),
    "varied": ("What the answer hangs on", "Woran die Antwort hängt"),
    "varied_note": (
        "The same {n} logs in {runs} runs, each factor alone at both ends of its range; high less low end with its "
        "95 % interval. Of what was not varied nothing is known.",
        "Dieselben {n} Stämme in {runs} Läufen, jeder Faktor allein an beiden Enden seines Bereichs; oberes minus "
        "unteres Ende mit 95-%-Intervall. Von dem, was nicht variiert wurde, ist nichts bekannt.",
    ),
    "hangs_on": ("{outcome} hangs on {factors}.", "{outcome} hängt an: {factors}."),
    "hangs_undecided": (
        "{outcome}: so many logs do not decide which of {factors} is the strongest.",
        "{outcome}: so viele Stämme entscheiden nicht, was am stärksten wirkt: {factors}.",
    ),
    "hangs_on_nothing": (
        "{outcome}: no factor changes it beyond chance with so many logs.",
        "{outcome}: kein Faktor ändert sie mit so vielen Stämmen mehr als der Zufall.",
    ),
    "outcome_reach": ("reach of {line} [%]", "Reichweite bis {line} [%]"),
    "outcome_runout": ("mean run-out [m]", "mittlerer Auslauf [m]"),
    "factor": ("factor", "Faktor"),
    "range": ("range", "Bereich"),
    "low_end": ("low end", "unteres Ende"),
    "high_end": ("high end", "oberes Ende"),
    "as_it_is": ("as it is", "wie es ist"),
    "swing": ("high less low", "oberes minus unteres"),
    "total_effect": ("total-effect index", "Totaleffekt-Index"),
    "factor_friction": ("friction", "Reibung"),
    "factor_friction_factor": ("friction of the map (times)", "Reibung der Karte (mal)"),
    "factor_rolling_friction": ("rolling friction", "Rollreibung"),
    "factor_restitution": ("restitution", "Stosszahl"),
    "factor_tree_friction": ("friction of stems", "Reibung der Bäume"),
    "factor_tree_restitution": ("restitution of stems", "Stosszahl der Bäume"),
    "factor_log_dbh_factor": ("DBH of the logs (times)", "BHD der Stämme (mal)"),
    "factor_log_length_factor": ("length of the logs (times)", "Länge der Stämme (mal)"),
    "factor_log_density_factor": ("density of the logs (times)", "Dichte der Stämme (mal)"),
    "factor_tree_dbh_factor": ("DBH of the trees (times)", "BHD der Bäume (mal)"),
    "factor_dem_noise_m": ("error of the terrain model [m]", "Fehler des Geländemodells [m]"),
    "factor_fidelity": ("fidelity", "Genauigkeitsstufe"),
}
# Words of the classes' names, which the tools write in English
GERMAN_CLASSES = (
    (r"below (.+?) % of the logs", r"unter \1 % der Stämme"),
    (r"(.+?) to (.+?) % of the logs", r"\1 bis \2 % der Stämme"),
    (r"(.+?) % of the logs and more", r"\1 % der Stämme und mehr"),
    (r"below (.+)", r"unter \1"),
    (r"(.+) and more", r"\1 und mehr"),
    (r"up to (.+) years", r"bis \1 Jahre"),
    (r"over (.+) years", r"über \1 Jahre"),
    (r"(.+) to (.+) years", r"\1 bis \2 Jahre"),
    (r"(.+) to (.+)", r"\1 bis \2"),
)
