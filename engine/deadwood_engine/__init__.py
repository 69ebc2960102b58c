"""The engine: rigid logs sliding on a bilinear terrain among trees and barriers. Arrays in, arrays out."""

from .barriers import Barriers
from .blocks import Blocks
from .cloud import Shape
from .digest import engine_digest
from .fidelity import FIDELITIES, Fidelity, fidelity_with, station_spacing, where_things_rebound
from .influence import Influences
from .ledger import Hits
from .lines import Lines, Segments, segments_of
from .logs import Logs, Start, place_logs
from .lying_logs import LyingLogs
from .outline import sweep_danger, sweep_hits, sweep_touches
from .rasters import Rasters
from .rest import STOP_REASONS
from .result import Poses, Result
from .scene import Scene
from .slide import Interrupted, fidelity_in, slide
from .stages import Stages
from .trees import Trees

__all__ = [
    "FIDELITIES",
    "STOP_REASONS",
    "Barriers",
    "Blocks",
    "Fidelity",
    "Hits",
    "Influences",
    "Interrupted",
    "Lines",
    "Logs",
    "LyingLogs",
    "Poses",
    "Rasters",
    "Result",
    "Scene",
    "Segments",
    "Shape",
    "Stages",
    "Start",
    "Trees",
    "engine_digest",
    "fidelity_in",
    "fidelity_with",
    "place_logs",
    "segments_of",
    "slide",
    "station_spacing",
    "sweep_danger",
    "sweep_hits",
    "sweep_touches",
    "where_things_rebound",
]
