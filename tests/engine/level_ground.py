"""Level ground with two trees, and a log above it, for tests of a step and of a whole trajectory."""

import numpy as np

from deadwood_engine import Scene, Trees
from deadwood_engine.log_body import cone_bodies
from deadwood_engine.model import Log, Model, Settings

G, DT, TRAVEL, ROLL_ANGLE = 9.81, 0.01, 0.2, 0.5
SETTINGS = Settings(DT, TRAVEL, ROLL_ANGLE, 1e-3, 400, 1.0, 0.0, 9.0, 0.1, G, 0.3, 3, False, 0.1, -1.0, 0.0, -1.0, 0.0)
LOG = cone_bodies(np.array([0.5]), np.array([8.0]), np.array([400.0]))[0]
WHERE = Log(np.zeros(2, np.int64), LOG, 9)


def level_model() -> Model:
    trees = Trees(np.array([5.0, 9.0]), np.array([5.0, 9.0]), np.full(2, 0.4), np.full(2, 20.0))
    arrays = Scene.prepare(np.zeros((40, 40)), 1.0, 0.0, 0.0, friction=0.3, trees=trees, reference=0.0).arrays
    return Model(*arrays, SETTINGS)
