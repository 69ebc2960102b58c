"""The engine: rigid logs sliding on a bilinear terrain among trees and barriers. Arrays in, arrays out."""

from .barriers import Barriers
from .fidelity import FIDELITIES, Fidelity, station_spacing
from .outline import Lines, Segments, segments_of, sweep_hits, sweep_touches
from .scene import Scene
from .slide import Interrupted, Logs, Poses, Rasters, Result, Start, place_logs, slide
from .step import STOP_REASONS
from .trees import Trees

__all__ = [
    "FIDELITIES",
    "STOP_REASONS",
    "Barriers",
    "Fidelity",
    "Interrupted",
    "Lines",
    "Logs",
    "Poses",
    "Rasters",
    "Result",
    "Scene",
    "Segments",
    "Start",
    "Trees",
    "place_logs",
    "segments_of",
    "slide",
    "station_spacing",
    "sweep_hits",
    "sweep_touches",
]
