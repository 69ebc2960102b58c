"""What the report says, in English and German: one row a phrase, so that a language cannot lack one.

Phrases hold no markup. What stands in braces is filled in by `Words.say`, and escaped with the rest where it is put
into the page (`markup`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from deadwood_algorithms.report.answer_words import ANSWER_PHRASES, GERMAN_CLASSES
from deadwood_algorithms.results.modelled import german_numbers, in_german

LANGUAGES = ("en", "de")

STOPS = {
    "rest": ("at rest on the terrain", "Ruhe auf dem Gelände"),
    "tree": ("held by a tree", "von Baum gehalten"),
    "lying_log": ("held by a lying log", "von liegendem Stamm gehalten"),
    "block": ("held by a block", "von einem Block gehalten"),
    "barrier": ("held by a barrier", "von Barriere gehalten"),
    "left_dem": ("left the terrain model", "verliess das Geländemodell"),
    "time_limit": ("still moving at the time limit", "bewegt sich noch am Zeitlimit"),
    "failed": ("calculation failed", "Berechnung gescheitert"),
}

PHRASES: dict[str, tuple[str, str]] = {
    "title": ("Sliding deadwood: {names}", "Abrutschendes Totholz: {names}"),
    "subtitle": ("Simulation of sliding logs, Deadwood Toolbox", "Simulation abrutschender Stämme, Deadwood Toolbox"),
    "and": ("and", "und"),
    "to": ("to", "bis"),
    "of_logs": ("of the logs", "der Stämme"),
    "of_steps": ("of {n} steps", "von {n} Schritten"),
    "contents": ("Contents", "Inhalt"),
    "question": ("Question and answer", "Frage und Antwort"),
    "question_lines": (
        "{n} logs are released at {where}. How many of them reach {lines}, and how do they arrive?",
        "{n} Stämme werden bei {where} freigesetzt. Wie viele erreichen {lines}, und wie kommen sie an?",
    ),
    "question_none": (
        "{n} logs are released at {where}. Where do they come to rest? No line to be reached was given.",
        "{n} Stämme werden bei {where} freigesetzt. Wo bleiben sie liegen? Keine zu erreichende Linie war angegeben.",
    ),
    "release_areas": ("{n} release areas", "{n} Freisetzungsgebieten"),
    "release_area": ("release area {name}", "Freisetzungsgebiet {name}"),
    "answer": ("{line}: reached by {share}", "{line}: erreicht von {share}"),
    "no_reach": ("No lines to be reached were given.", "Keine zu erreichenden Linien waren angegeben."),
    "run": ("Run {name}", "Lauf {name}"),
    "runs": ("Runs", "Läufe"),
    "modelled": ("What was modelled, and what was not", "Was modelliert wurde, und was nicht"),
    "modelled_note": (
        "Logs do not break, bend or meet each other; trees and barriers do not give way. The model does not say how "
        "likely a log starts to slide at all. Results are a basis for an expert's judgement, not a hazard map.",
        "Stämme brechen und biegen sich nicht und treffen einander nicht; Bäume und Barrieren geben nicht nach. Das "
        "Modell sagt nicht, wie wahrscheinlich ein Stamm überhaupt abrutscht. Die Ergebnisse sind Grundlage für ein "
        "Fachurteil, keine Gefahrenkarte.",
    ),
    "model_terrain": ("terrain", "Gelände"),
    "model_window": ("part of the DEM", "Teil des DEM"),
    "model_friction": ("friction", "Reibung"),
    "model_restitution": ("restitution", "Stosszahl"),
    "model_rolling_friction": ("rolling friction", "Rollreibung"),
    "model_logs": ("logs", "Stämme"),
    "model_trees": ("trees", "Bäume"),
    "model_barriers": ("barriers", "Barrieren"),
    "model_lying_logs": ("lying logs", "liegende Stämme"),
    "model_blocks": ("boulders", "Blöcke"),
    "model_lines": ("lines", "Linien"),
    "model_outputs": ("computed", "berechnet"),
    "lacks": ("What this report lacks", "Was diesem Bericht fehlt"),
    "lacks_input": (
        "The {what} of the run, {path}, could not be read any more: {reason}",
        "Die Eingabe «{what}» des Laufs, {path}, war nicht mehr lesbar: {reason}",
    ),
    "input_changed": (
        "The {what} of the run, {path}, has changed since the logs slid. What this page shows of it, and what is "
        "calculated from it anew, is of the file as it is now; what the run found is of the file as it was then.",
        "Die Eingabe «{what}» des Laufs, {path}, wurde seit dem Rechenlauf geändert. Was diese Seite davon zeigt oder "
        "neu daraus rechnet, gilt für die Datei, wie sie jetzt ist; die Ergebnisse des Laufs gelten für die damalige.",
    ),
    "lacks_poses": (
        "No trajectory was kept (--trajectories none), so there are no arrivals, no profile and no moving logs.",
        "Keine Bahn wurde aufbewahrt (--trajectories none); darum fehlen Ankünfte, Profil und bewegte Stämme.",
    ),
    "lacks_some_poses": (
        "{stored} of {n} logs kept their trajectory; arrivals, profile and moving logs are theirs.",
        "{stored} von {n} Stämmen behielten ihre Bahn; Ankünfte, Profil und bewegte Stämme sind die ihren.",
    ),
    "lacks_shape": ("No energies of arrival: {reason}", "Keine Energien der Ankunft: {reason}"),
    "gone": ("not there", "nicht vorhanden"),
    "input_dem": ("terrain model", "Geländemodell"),
    "input_trees": ("trees", "Bäume"),
    "input_barriers": ("barriers", "Barrieren"),
    "input_lying_logs": ("lying logs", "liegende Stämme"),
    "input_blocks": ("boulders", "Blöcke"),
    "map": ("Map", "Karte"),
    "map_caption": (
        "Share of the logs that pass each cell, over the relief. Coordinates: {crs}, metres. Drag to move, wheel or "
        "buttons to zoom.",
        "Anteil der Stämme, die jede Zelle passieren, über dem Relief. Koordinaten: {crs}, Meter. Ziehen verschiebt, "
        "Rad oder Knöpfe vergrössern.",
    ),
    "danger_note": (
        "Danger of the lines: of the logs that passed a place, the share that reached a line afterwards; empty where "
        "too few passed.",
        "Gefahr für die Linien: von den Stämmen, die an einem Ort vorbeikamen, der Anteil, der danach eine Linie "
        "erreichte; leer, wo zu wenige vorbeikamen.",
    ),
    "map_some": ("Drawn: {drawn} of {n} {what}.", "Gezeichnet: {drawn} von {n} {what}."),
    "layers": ("Layers", "Ebenen"),
    "layer_relief": ("relief", "Relief"),
    "layer_hits": ("share of logs", "Anteil der Stämme"),
    "layer_speed": ("largest speed", "grösste Geschwindigkeit"),
    "layer_energy": ("largest energy", "grösste Energie"),
    "layer_jump": ("largest clearance", "grösste Sprunghöhe"),
    "layer_danger": ("danger of the lines", "Gefahr für die Linien"),
    "layer_trees": ("trees", "Bäume"),
    "layer_barriers": ("barriers", "Barrieren"),
    "layer_lying_logs": ("lying logs", "liegende Stämme"),
    "layer_blocks": ("boulders", "Blöcke"),
    "layer_lines": ("roads, houses", "Strassen, Häuser"),
    "layer_releases": ("releases", "Freisetzungen"),
    "layer_trajectories": ("trajectories", "Bahnen"),
    "layer_deposits": ("deposits: {stop}", "Ablagerungen: {stop}"),
    "hits_bar": ("logs that pass [%]", "passierende Stämme [%]"),
    "east": ("East [m]", "Ost [m]"),
    "north": ("North [m]", "Nord [m]"),
    "zoom_in": ("Zoom in", "Vergrössern"),
    "zoom_out": ("Zoom out", "Verkleinern"),
    "reset": ("Reset", "Zurück"),
    "reach": ("Reach", "Reichweite"),
    "answer_lost": (
        "; {bounds} if none or all of the {n} others reach it that left the terrain model before",
        "; {bounds}, falls keiner oder alle der {n} anderen sie erreichen, die das Geländemodell vorher verliessen",
    ),
    "n_lost": ("left the terrain model before it", "vorher aus dem Geländemodell"),
    "if_lost": (
        "share if none or all of them reach it (95 % interval)",
        "Anteil, falls keiner oder alle sie erreichen (95-%-Intervall)",
    ),
    "lost_note": (
        "What logs do beyond the terrain model is not known. The share above counts none of them as arrived.",
        "Was Stämme jenseits des Geländemodells tun, ist nicht bekannt. Der Anteil oben zählt keinen von ihnen als "
        "angekommen.",
    ),
    "reach_note": (
        "Two kinds of error: sampling (95 % Wilson interval, shrinks with more logs) and calculation (what the time "
        "stepping of this fidelity adds; more logs do not touch it). The larger part mostly comes from the inputs, "
        "above all the friction coefficient, and is in neither.",
        "Zwei Arten von Fehlern: Stichprobe (95-%-Intervall nach Wilson, schrumpft mit mehr Stämmen) und "
        "Berechnung (was "
        "die Zeitschritte dieser Genauigkeitsstufe dazutun; mehr Stämme ändern daran nichts). Der grössere Teil kommt "
        "meist aus den Eingaben, vor allem dem Reibungskoeffizienten, und steckt in keinem der beiden.",
    ),
    "calculation_known": (
        "{mean} points on average over five synthetic slopes, {worst} on the worst, against the finest preset",
        "{mean} Punkte im Mittel über fünf synthetische Hänge, {worst} am schlechtesten, gegen die feinste Stufe",
    ),
    "calculation_none": (
        "is the reference: none by definition",
        "ist die Referenz: nach Definition keiner",
    ),
    "calculation_unknown": (
        "not known: time step or spacing of its own (compare-fidelity measures it)",
        "nicht bekannt: eigener Zeitschritt oder Abstand (compare-fidelity misst ihn)",
    ),
    "calculation_bound": ("±{bound} points at most", "höchstens ±{bound} Punkte"),
    "promise": (
        "--fidelity auto chose {chosen} and {n} logs: the reach of every line is within ±{together} points, at 95 %, "
        "of what the finest preset would give. For line {line}, where this is most: sampling ±{sampling}, calculation "
        "±{calculation} ({source}).",
        "--fidelity auto hat {chosen} und {n} Stämme gewählt: Die Reichweite jeder Linie liegt, mit 95 %, auf "
        "±{together} Punkte bei dem, was die feinste Stufe ergäbe. Für die Linie {line}, wo das am meisten ist: "
        "Stichprobe ±{sampling}, Berechnung ±{calculation} ({source}).",
    ),
    "promise_assumed": (
        "assumed: as on the benchmark's slopes",
        "angenommen: wie auf den Hängen des Benchmarks",
    ),
    "promise_measured": (
        "measured on this slope against {against}",
        "auf diesem Hang gemessen, gegen {against}",
    ),
    "calculation_measure": (
        "Measured on synthetic slopes (README); on this slope deadwood-tool compare-fidelity measures it.",
        "Gemessen auf synthetischen Hängen (README); auf diesem Hang misst ihn deadwood-tool compare-fidelity.",
    ),
    "line": ("line", "Linie"),
    "logs": ("logs", "Stämme"),
    "n_reach": ("reach it", "erreichen sie"),
    "sampling": ("95 % interval (sampling)", "95-%-Intervall (Stichprobe)"),
    "calculation": ("error of calculation", "Fehler der Berechnung"),
    "until_ci": (
        "The run was to end at ±{wanted} points: {state}.",
        "Der Lauf sollte bei ±{wanted} Punkten enden: {state}.",
    ),
    "until_reached": ("reached after {n} logs", "erreicht nach {n} Stämmen"),
    "until_missed": ("not reached with all {n} logs", "mit allen {n} Stämmen nicht erreicht"),
    "share_of_logs": ("share of the logs [%]", "Anteil der Stämme [%]"),
    "arrivals": ("Arrivals", "Ankünfte"),
    "arrivals_note": (
        "The first touch of each log and line, over the logs that kept their trajectory. Energy is of translation; "
        "height that of the centre of mass above the terrain; angle that between the direction of travel and the line "
        "(90° is square on).",
        "Die erste Berührung je Stamm und Linie, über die Stämme mit aufbewahrter Bahn. Energie der Translation; Höhe "
        "des Schwerpunkts über dem Gelände; Winkel zwischen Bewegungsrichtung und Linie (90° ist frontal).",
    ),
    "design": ("Design values", "Bemessungswerte"),
    "design_note": (
        "Percentiles over the logs that come to a barrier (the largest of each log's hits, just before it) or to a "
        "line (at the first touch), with exact 95 % intervals from order statistics. Height: of the place of the hit, "
        "or of the log's upper edge at the line, above the terrain. No safety factor is in them; deadwood-tool "
        "design-values writes them as a table.",
        "Perzentile über die Stämme, die an eine Barriere kommen (der grösste der Treffer jedes Stamms, kurz davor) "
        "oder an eine Linie (bei der ersten Berührung), mit exakten 95-%-Intervallen aus Ordnungsstatistiken. Höhe: "
        "der getroffenen Stelle, oder der Oberkante des Stamms an der Linie, über dem Gelände. Sie enthalten keinen "
        "Sicherheitsfaktor; deadwood-tool design-values schreibt sie als Tabelle.",
    ),
    "design_more": ("{value}; {n} more hits needed", "{value}; {n} Treffer mehr nötig"),
    "design_energy": ("energy", "Energie"),
    "design_translation": ("of translation", "der Translation"),
    "design_rotation": ("of rotation", "der Rotation"),
    "design_speed": ("speed", "Geschwindigkeit"),
    "design_height": ("height", "Höhe"),
    "design_impulse": ("impulse", "Impuls"),
    "arrivals_none": ("No stored trajectory reaches a line.", "Keine aufbewahrte Bahn erreicht eine Linie."),
    "median": ("median", "Median"),
    "largest": ("largest", "grösstes"),
    "speed": ("speed", "Geschwindigkeit"),
    "energy": ("energy", "Energie"),
    "height": ("height", "Höhe"),
    "angle": ("angle", "Winkel"),
    "time": ("time", "Zeit"),
    "arrival_speed": ("speed of arrival [m/s]", "Geschwindigkeit bei Ankunft [m/s]"),
    "arrival_energy": ("energy of arrival [kJ]", "Energie bei Ankunft [kJ]"),
    "arrival_height": ("height of the centre of mass [m]", "Höhe des Schwerpunkts [m]"),
    "arrival_angle": ("angle to the line [°]", "Winkel zur Linie [°]"),
    "n_logs": ("logs", "Stämme"),
    "spread": ("Lateral spread", "Seitliche Streuung"),
    "spread_note": (
        "Azimuths of the deposits seen from the centre of each release area, without those nearer than the least "
        "run-out, whose azimuth means nothing. North is up.",
        "Azimute der Ablagerungen vom Mittelpunkt jedes Freisetzungsgebiets aus, ohne jene, die näher als der kleinste "
        "Auslauf liegen, deren Azimut nichts bedeutet. Norden ist oben.",
    ),
    "release": ("release", "Freisetzung"),
    "counted": ("deposits counted", "gezählte Ablagerungen"),
    "left_out": ("left out", "nicht gezählt"),
    "spread_deg": ("smallest angle that holds all [°]", "kleinster Winkel über alle [°]"),
    "p05_p95_deg": ("5 to 95 % [°]", "5 bis 95 % [°]"),
    "compass": ("N,E,S,W", "N,O,S,W"),
    "spread_none": (
        "No deposit is far enough from its release.",
        "Keine Ablagerung liegt weit genug von ihrer Freisetzung.",
    ),
    "ways": ("Run-out, speed and jumps", "Auslauf, Geschwindigkeit und Sprünge"),
    "runout": ("Run-out", "Auslauf"),
    "runout_axis": ("run-out, horizontal [m]", "Auslauf, horizontal [m]"),
    "farther": ("logs that go farther [%]", "Stämme, die weiter gehen [%]"),
    "max_speed_axis": ("largest speed of a log [m/s]", "grösste Geschwindigkeit eines Stamms [m/s]"),
    "jump": ("jump height", "Sprunghöhe"),
    "jump_axis": ("largest clearance of a log [m]", "grösster Abstand eines Stamms zum Gelände [m]"),
    "energy_max": ("largest energy", "grösste Energie"),
    "quantity": ("quantity", "Grösse"),
    "mean": ("mean", "Mittel"),
    "stops": ("How the logs ended", "Wie die Stämme endeten"),
    "profile": ("Profile along chosen trajectories", "Profil entlang ausgewählter Bahnen"),
    "profile_note": (
        "Terrain under the centre of mass, the log's height above it (to scale) and its speed, along the "
        "horizontal way.",
        "Gelände unter dem Schwerpunkt, Höhe des Stamms darüber (massstäblich) und Geschwindigkeit, entlang des "
        "horizontalen Wegs.",
    ),
    "way": ("horizontal way [m]", "horizontaler Weg [m]"),
    "elevation": ("elevation [m]", "Höhe ü. M. [m]"),
    "speed_axis": ("speed [m/s]", "Geschwindigkeit [m/s]"),
    "terrain": ("terrain", "Gelände"),
    "centre": ("centre of mass", "Schwerpunkt"),
    "lowest": ("lowest point", "tiefster Punkt"),
    "chosen_farthest": ("log {id}: farthest", "Stamm {id}: weitester"),
    "chosen_fastest": ("log {id}: fastest", "Stamm {id}: schnellster"),
    "chosen_median": ("log {id}: median run-out", "Stamm {id}: mittlerer Auslauf"),
    "ledgers": ("Barriers, trees, lying logs, boulders", "Barrieren, Bäume, liegende Stämme, Blöcke"),
    "ledgers_none": ("The scene has none of them.", "Die Szene hat nichts davon."),
    "barrier": ("barrier", "Barriere"),
    "n_reached": ("reached", "erreicht"),
    "n_stopped": ("stopped", "gehalten"),
    "n_overjumped": ("overjumped", "übersprungen"),
    "n_passed_beside": ("passed beside", "daneben vorbei"),
    "n_hits": ("hits", "Treffer"),
    "energy_hit": ("largest energy of a hit [kJ]", "grösste Energie eines Treffers [kJ]"),
    "height_hit": ("largest height of a hit [m]", "grösste Höhe eines Treffers [m]"),
    "wood": ("obstacles", "Hindernisse"),
    "n_total": ("in the scene", "in der Szene"),
    "n_hit": ("hit", "getroffen"),
    "n_stopping": ("hold a log", "halten einen Stamm"),
    "n_stops": ("logs held", "gehaltene Stämme"),
    "impulse": ("impulse taken [kN s]", "aufgenommener Impuls [kN s]"),
    "energy_taken": ("energy taken [kJ]", "aufgenommene Energie [kJ]"),
    "top_trees": ("The trees that hold the most logs", "Die Bäume, die am meisten Stämme halten"),
    "tree": ("tree", "Baum"),
    "above_capacity": ("Logs with a hit above what stems can take", "Stämme mit einem Treffer über der Tragkraft"),
    "above_of_trees": ("of the tree", "des Baums"),
    "above_of_logs": ("of the log itself", "des Stamms selbst"),
    "all_logs": ("all", "alle"),
    "held_by_trees": ("held by a tree", "von Baum gehalten"),
    "above_note": (
        "Nothing breaks in the model. These logs had, anywhere on their way, a hit that took more energy than the "
        "capacity given: how far the result hangs on rigid stems.",
        "Im Modell bricht nichts. Diese Stämme hatten irgendwo unterwegs einen Treffer, der mehr Energie aufnahm als "
        "die angegebene Tragkraft: So weit hängt das Ergebnis an starren Stämmen.",
    ),
    "three_d": ("3-D view", "3-D-Ansicht"),
    "three_d_note": (
        "Trees, barriers and logs in their true sizes, as modelled (far off at least a pixel wide). Drag turns, "
        "right button or two fingers "
        "move, wheel zooms; click a moving log to follow it. Terrain in steps of {cell} m (DEM: {dem_cell} m); "
        "{shown} of "
        "{stored} stored trajectories.",
        "Bäume, Barrieren und Stämme in wahrer Grösse, wie modelliert (fern mindestens ein Pixel breit). Ziehen "
        "dreht, rechte Taste oder zwei Finger "
        "verschieben, Rad vergrössert; Klick auf einen bewegten Stamm folgt ihm. Gelände in Schritten von "
        "{cell} m (DEM: "
        "{dem_cell} m); {shown} von {stored} aufbewahrten Bahnen.",
    ),
    "three_d_lacks": (
        "Without the terrain model there is no 3-D view.",
        "Ohne Geländemodell gibt es keine 3-D-Ansicht.",
    ),
    "three_d_webgl": (
        "This browser shows no WebGL 2, so there is no 3-D view; all else is complete.",
        "Dieser Browser zeigt kein WebGL 2, darum keine 3-D-Ansicht; alles Übrige ist vollständig.",
    ),
    "three_d_label": ("3-D view of the slope with moving logs", "3-D-Ansicht des Hangs mit bewegten Stämmen"),
    "play": ("Play", "Abspielen"),
    "pause": ("Pause", "Anhalten"),
    "pace": ("pace", "Tempo"),
    "which_logs": ("logs", "Stämme"),
    "group_all": ("all shown here", "alle hier gezeigten"),
    "group_fast": ("the fastest", "die schnellsten"),
    "group_far": ("the farthest", "die weitesten"),
    "group_reach": ("those that reach a line", "die eine Linie erreichen"),
    "group_random": ("a random draw", "eine Zufallsauswahl"),
    "drape": ("on the terrain", "auf dem Gelände"),
    "trails": ("trails", "Spuren"),
    "deposits": ("deposits", "Ablagerungen"),
    "moving": ("moving logs", "bewegte Stämme"),
    "follow": ("Follow", "Folgen"),
    "let_go": ("Let go", "Loslassen"),
    "picked": ("log {id}: {speed} m/s", "Stamm {id}: {speed} m/s"),
    "pick_hint": ("click a log to follow it", "Stamm anklicken, um zu folgen"),
    "home": ("Whole slope", "Ganzer Hang"),
    "accuracy": ("Accuracy", "Genauigkeit"),
    "accuracy_note": (
        "What of the error of calculation is measured in every run.",
        "Was vom Fehler der Berechnung in jedem Lauf gemessen wird.",
    ),
    "fidelity": ("fidelity", "Genauigkeitsstufe"),
    "time_step": ("longest time step", "längster Zeitschritt"),
    "spacing": ("spacing of the contact rings", "Abstand der Kontaktringe"),
    "penetration": ("deepest penetration", "tiefstes Eindringen"),
    "energy_error": ("largest energy made or lost by the stepping", "grösster Energiefehler der Zeitschritte"),
    "residual": ("largest residual of the contacts", "grösstes Residuum der Kontakte"),
    "unconverged": ("steps whose contacts did not converge", "Schritte mit nicht konvergierten Kontakten"),
    "failed_logs": ("failed logs", "gescheiterte Stämme"),
    "left_dem_logs": ("logs that left the terrain model", "Stämme, die das Geländemodell verliessen"),
    "started_in_contact": (
        "logs that started in contact with an obstacle",
        "Stämme, die in Kontakt mit einem Hindernis starteten",
    ),
    "not_run": ("logs not run (--until-ci, --error)", "nicht gerechnete Stämme (--until-ci, --error)"),
    "left_dem_warning": (
        "Logs that left the terrain model: {n}. On a larger one they would have gone on, so reach and spread are off "
        "by up to them.",
        "Stämme, die das Geländemodell verliessen: {n}. Auf einem grösseren wären sie weitergerutscht; Reichweite und "
        "Streuung sind bis zu diesem Anteil falsch.",
    ),
    "failed_warning": (
        "Logs whose calculation failed: {n}. The others did not suffer.",
        "Stämme, deren Berechnung scheiterte: {n}. Die übrigen litten nicht.",
    ),
    "time_limit_warning": (
        "Logs that still moved at the time limit: {n}. Their deposits are not final.",
        "Stämme, die sich am Zeitlimit noch bewegten: {n}. Ihre Ablagerungen sind nicht endgültig.",
    ),
    "provenance": ("Provenance", "Herkunft"),
    "command": ("Command that repeats the run", "Befehl, der den Lauf wiederholt"),
    "versions": ("Versions", "Versionen"),
    "versions_run": (
        "The run was made by deadwood-tool {version}; this page with:",
        "Der Lauf stammt von deadwood-tool {version}; diese Seite von:",
    ),
    "hashes": ("Fingerprints of the inputs", "Prüfsummen der Eingaben"),
    "input": ("input", "Eingabe"),
    "file": ("file", "Datei"),
    "hash_scene": ("scene as calculated", "Szene wie gerechnet"),
    "hash_releases": ("releases as calculated", "Freisetzungen wie gerechnet"),
    "engine_digest": ("engine", "Rechenkern"),
    "cost": ("Cost", "Aufwand"),
    "cost_words": (
        "{cpu} CPU s of sliding, {wall} s on the clock, {steps} steps, {rate} logs/s; this page was made on {machine}.",
        "{cpu} CPU-s Rechnen, {wall} s auf der Uhr, {steps} Schritte, {rate} Stämme/s; diese Seite entstand auf "
        "{machine}.",
    ),
    "parameters": ("Parameters", "Parameter"),
    "comparison": ("Comparison", "Vergleich"),
    "comparison_note": (
        "The same logs in each run, so each log is its own control. Differences to {reference}, with 95 % "
        "intervals over "
        "the logs.",
        "Dieselben Stämme in jedem Lauf, jeder Stamm ist seine eigene Kontrolle. Unterschiede zu {reference}, mit "
        "95-%-Intervallen über die Stämme.",
    ),
    "comparison_lacks": ("The runs are not compared: {reason}", "Die Läufe werden nicht verglichen: {reason}"),
    "comparison_map_lacks": (
        "No map of the difference of {name}: {reason}",
        "Keine Unterschiedskarte von {name}: {reason}",
    ),
    "difference": ("difference", "Unterschied"),
    "difference_map": (
        "{name} minus {reference}: share of the logs that pass [points]",
        "{name} minus {reference}: Anteil passierender Stämme [Punkte]",
    ),
    "quantity_reach": ("reach {item}", "Reichweite {item}"),
    "quantity_bari": ("fewer reach {item} (BARI)", "weniger erreichen {item} (BARI)"),
    "quantity_miri": ("lower 95 % energy at {item} (MIRI)", "kleinere 95-%-Energie bei {item} (MIRI)"),
    "quantity_orpi": ("lower summed energy at {item} (ORPI)", "kleinere Energiesumme bei {item} (ORPI)"),
    "quantity_ended": ("ended: {item}", "Ende: {item}"),
    "quantity_spread": ("lateral spread, {item}", "seitliche Streuung, {item}"),
    "quantity_spread_p05_p95": ("lateral spread 5 to 95 %, {item}", "seitliche Streuung 5 bis 95 %, {item}"),
    "quantity_speed_mean": ("mean speed, {item}", "mittlere Geschwindigkeit, {item}"),
    "quantity_speed_max": ("largest speed, {item}", "grösste Geschwindigkeit, {item}"),
    "quantity_energy_max": ("largest energy, {item}", "grösste Energie, {item}"),
    "quantity_jump_max": ("jump height, {item}", "Sprunghöhe, {item}"),
    "quantity_runout": ("run-out, {item}", "Auslauf, {item}"),
    "quantity_deposit_moved": ("deposits moved, {item}", "Ablagerungen verschoben, {item}"),
    "item_mean": ("mean", "Mittel"),
    "item_median": ("median", "Median"),
    "item_p95": ("95th percentile", "95. Perzentil"),
    "item_largest": ("largest", "grösstes"),
    "parameters_differ": ("In what the runs differ", "Worin sich die Läufe unterscheiden"),
    "parameters_same": (
        "The runs differ in no parameter (their layers may).",
        "Die Läufe unterscheiden sich in keinem Parameter (ihre Ebenen vielleicht).",
    ),
    "none": ("none", "keine"),
    "made": ("Made by deadwood-tool {version}", "Erstellt mit deadwood-tool {version}"),
}
PHRASES |= ANSWER_PHRASES


@dataclass(frozen=True)
class Words:
    """The phrases of one language."""

    language: str

    def say(self, phrase: str, **filled: Any) -> str:
        """The phrase with its gaps filled; values are plain text, not markup."""
        text = PHRASES[phrase][LANGUAGES.index(self.language)]
        return text.format(**filled) if filled else text

    def stop(self, reason: str) -> str:
        """A stop reason in words; one that is not known as it is written."""
        return STOPS[reason][LANGUAGES.index(self.language)] if reason in STOPS else reason

    def modelled(self, said: str) -> str:
        """What a summary says of its model, in this language."""
        return in_german(said) if self.language == "de" else said

    def of_class(self, label: str) -> str:
        """The name of a class as a tool wrote it, in this language."""
        if self.language == "de":
            for pattern, german in GERMAN_CLASSES:
                if found := re.fullmatch(pattern, label):
                    return german_numbers(found.expand(german))
        return label

    def known(self, phrase: str, otherwise: str, **filled: Any) -> str:
        return self.say(phrase, **filled) if phrase in PHRASES else otherwise
