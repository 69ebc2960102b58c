"""The files of a variation's folder."""

from __future__ import annotations

RUNS, TORNADO, INDICES, PICTURE, FACTS = "runs.csv", "tornado.csv", "indices.csv", "tornado.png", "summary.json"
