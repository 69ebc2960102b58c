"""What a log knows of its surroundings: the columns of ``Scratch.near``."""

# Plan ends for which the list of what is near was made, whether there is such a list, and how many cores are in it
BASE_X, TIP_X, LISTED, CORES = 0, 2, 4, 5
# The path [m] before which no ring, and no obstacle, needs to be looked at; how many cores may limit the next step
RINGS_WAKE, OBSTACLES_WAKE, BESIDE = 6, 7, 8
NEAR_WIDTH = 9
