"""What a log knows of its surroundings: the columns of ``Scratch.near``."""

# Plan ends for which the lists of what is near were made, whether there are such lists, and how much is in each
BASE_X, TIP_X, LISTED, TREES, PLATES, LYING_LOGS = 0, 2, 4, 5, 6, 7
# The path [m] before which no ring, and no obstacle, needs to be looked at; how many trees may limit the next step
RINGS_WAKE, OBSTACLES_WAKE, BESIDE = 8, 9, 10
NEAR_WIDTH = 11
