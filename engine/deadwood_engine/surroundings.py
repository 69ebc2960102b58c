"""What a log knows of its surroundings: the columns of ``Scratch.near``."""

# Plan ends for which the list of what is near was made, whether there is such a list, and how many cores are in it
BASE_X, TIP_X, LISTED, CORES = 0, 2, 4, 5
# The path [m] before which no ring, and no obstacle, needs to be looked at; how many cores may limit the next step
RINGS_WAKE, OBSTACLES_WAKE, BESIDE = 6, 7, 8
# How far [m] the log is clear at least of what was not looked at; row of the core that bounds the next step, or -1
CLEAR, THIN = 9, 10
NEAR_WIDTH = 11
