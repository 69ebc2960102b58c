"""The texts of a run's QGIS project, in English: names of layers, groups and sheets, and the texts of the print
layout.
"""

from __future__ import annotations

SHEET_PHRASES = {
    "sheet_title": "Sliding logs: {name}",
    "sheet_more": "and {n} more lines",
    "sheet_foot": "Scale 1:{scale}   CRS: {crs}   Deadwood Toolbox {version}, printed {date}",
    "sheet_between": "{low} to {high}",
    "sheet_up_to": "up to {high}",
    "sheet_over": "over {low}",
    "sheet_dbh": "DBH",
    "sheet_doubt": "Doubtful: {text}",
}
# Layers, groups, sheets and views, whose names in the project are English unless another language is requested.
QGIS_NAMES = (
    "Deadwood run",
    "Results",
    "Animation",
    "Scene",
    "Rasters",
    "Terrain",
    "Reach",
    "Reached by",
    "Deposits",
    "Deposited logs",
    "Trajectories",
    "Barrier arrivals",
    "Barrier hits",
    "Tree hits",
    "Lying hits",
    "Block hits",
    "Logs in motion",
    "Logs at rest",
    "Releases",
    "Barriers",
    "Lying logs",
    "Blocks",
    "Trees",
    "Hit count",
    "Reach probability",
    "Danger",
    "Danger count",
    "Deposit count",
    "Speed max",
    "Energy max",
    "Jump max",
    "Share of the logs that reach it",
    "Roads, railways, houses",
    "Logs that pass a cell",
    "Map of the run, A4 landscape",
    "Map of the run, A4 portrait",
    "Map of the run",
    "Draped over the terrain in 3D",
    "Logs in 3D",
)
QGIS_PHRASES = {f"qgis_{name.lower().replace(',', '').replace(' ', '_')}": name for name in QGIS_NAMES}
