"""Every tolerance and limit of the engine, with its unit and its reason."""

GRAVITY = 9.81  # m/s2, the value of the paper's framework

# Contact solver
EXACT_BLOCK_COUPLING = 0.5  # [-] mu |G_nt| / G_nn above which split sweeps crawl: the 3x3 block is solved whole
SLIP_ARCS = 16  # arcs of a half circle searched for the direction of slip
BLOCK_SWEEPS = 50  # sweeps with whole blocks; a problem still unsolved may be cycling between their several solutions
BISECTIONS = 60  # halvings of such an arc: to the last bit of an angle
EXTRAPOLATE_FROM = 20  # sweeps after which what is left is one slow mode; solves in the open take 1 to 5
EXTRAPOLATE_LINES_FROM = 120  # the same with lines of contacts: friction along them finds its way by itself, mostly
EXTRAPOLATE_UNTIL = 1000  # sweeps from which on none is extrapolated, for that may cycle
EXTRAPOLATE_EVERY = 8  # sweeps from one extrapolation to the next, in which other modes die out and the rate is seen
EXTRAPOLATE_ALIKE = 0.9  # [-] cosine between two sweeps' changes beyond which they are of one mode
EXTRAPOLATE_MOST = 300.0  # sweeps that one extrapolation stands for at most
DISC_ITERATIONS = 12  # Newton steps of the friction disc's secular equation; it needs 1-4
DISC_ACCURACY = 1e-2  # [-] of the friction impulse before it is put on the disc; each further sweep squares it
LEAST_APPROACH = 1e-9  # [m/s] that is none, whatever the tolerance: 10 pm in a step (without gravity that is rounding)
LEAST_TOLERANCE = 1e-15  # [m/s] on top of the fidelity's: rounding, where there is no gravity to measure by

# Lines of contacts (``pressure``)
LINE_TURN = 1e-4  # [-] between normals of a line at most; heights of 100 m in float32 turn those of 0.5 m cells by 2e-5
LINE_STEP = 1e-3  # [m] along the log between contacts of a line at least: those of one ring or face are none
LINE_ROOM = 2e-5  # [m] from one line, at most, of the gaps; heights of 200 m in float32 are rounded to 8e-6
LINE_BEND = 1e-3  # [m] from straight, at most, of the levers

# Outlines (``trace``)
WITHIN = 0.2  # [cells] that an end may be off the straight way from the last outline to the next; of two steps, if more

# Obstacles near the log
OBSTACLE_TRAVEL = 0.3  # [-] of both radii: beside what is thin, most of the way of the fastest point in a step
LYING_TRAVEL = 0.2  # [-] of both radii: the same beside a lying log, which a log that spins may strike from any side
FIRST_TOUCH = 0.1  # [-] of both radii: how far a step is followed beside a stem between two looks for its first touch
TOUCH_DEPTH = 0.05  # [-] of both radii: how deep, at most, the pose of a first touch may be
MOST_LOOKS = 40  # poses within a step that are looked at for the first touch of one stem
# [m] gap at the end of a step below which an obstacle is a contact though the way ahead does not touch it: a base that
# strikes the ground whips its tip against what it would have passed (6 cm into a boulder at 8 m/s)
UNFORESEEN = 0.05
OBSTACLE_ALONG = 0.3  # [-] of both radii: the way of a thin log along itself in a step beside a thicker stem
THICK = 0.35  # [m] radius of log and stem together above which a step is limited by the speed sideways, not the fastest
SAFE = 1.0 - 1e-6  # [-] of a distance: more than what a path's sum of many steps loses by rounding
NEAR_MARGIN = 2.0  # [m] obstacles so close to the log are listed, anew when its ends have moved by half of it
MADE_ANEW = 0.7  # [-] of a step: where a contact's push leaves less than that beside a stem, the step is made anew
MET_AT_ONCE = 0.01  # [-] of a step: what touches so early, and rebounds, does so at its start; else the step ends there
SHORTEST_STEP = 1e-6  # [s] floor of the adaptive step; 100 m/s then travels 0.1 mm

# Scarring drag (``scarring``)
SOIL_DENSITY = 1700.0  # kg/m3, as Lu et al. (2019) have it
SCAR_STEP = 1e-4  # [s] floor of the steps that the depth of a scar bounds: a scar of nothing at a high speed

# Contact detection
AT_ONCE = 1e-9  # [s] a step so short that the pose ahead is the pose now: contacts of the release
IMPACT = 2.0  # [-] of g dt: an approach that is no faster is what gravity adds in two steps, no impact
HOVER = 0.5  # [-] of g dt^2: gaps so small count as closed (0.5 mm at 10 ms); without it the contacts of a log at rest
# differ by the rounding of the DEM, and the solver spends its sweeps on that

HOVER_MOST = 5e-4  # [m] that, at most: long steps would let logs rest on air

LEAST_TURN = 1e-2  # [-] of g dt: a contact plane that turns by less has not turned (``turning``)

MERGED = 0.1  # [-] of the radius: candidates of one ring that come to lie closer than this are one contact (at 0.3 a
# rim on two cells touched one of them only)
ANY_POINT = 1e-6  # [-] sine of axis and ground's normal below which no point of a ring is deeper than another
REFINED = (
    0.3  # [-] of the radius: candidates nearer to the ground than this are sought once more, square to what is there
)

CREST = 2e-3  # [-] of the radius: a crest that stands out by less is flat ground, which the rings touch
ALONG_GRID = 0.05  # [-] sine of the angle to a grid line below which a log lies along it
BESIDE_CREST = 0.05  # [cells] how far on either side of a crest the ground must fall away from the log
SAME_CELL = 1e-9  # [cells] a parabola that misses the ground by more at its lowest point has left its cell
WALL = 0.5  # [-] sine of the ground's tilt along the axis beyond which it is a wall, not the flank of a ridge:
# what is so steep could get between the candidates of an end's rim, and impale a log that its side does not stop
LEAST_UPWARD = 0.1  # [-] least upward part of a normal of the cone's side that is put in the place of the ground's

# Near contact: how much steeper the ground may grow around a cell (``terrain.kinks_of``)
KINK_REACH = 0.5  # [m] around it at least: a ring's radius and half the way to the next ring
KINK_CELLS = 5  # around it at most; on finer cells than KINK_REACH / KINK_CELLS thick logs are looked at in full

# Far from contact: planes above the terrain, over blocks of cells, tell how far a ring may move before it can touch
LID_REACH = 2.0  # [m] least side of a block; rings sleep until the log could have moved so far, at most
LID_SLACK = 1e-3  # [m] more than the rounding of a lid's float32 (0.1 mm at 1000 m above the reference)

# Geometry
WHOLE = 1e-9  # [-] by which a quotient may exceed a whole number and still count as that
VERTICAL = 1e-12  # [-] of a unit vector in plan: what is so upright has no direction there
SMALL_TURN = 0.01  # [-] square of half an angle up to which the series of its sine and cosine is exact to the last bit
SKEW_LINES = 1e-9  # [-] squared sine below which two segments are parallel: any pair of points opposite is the nearest
FLAT_TOLERANCE = 1e-9  # [-] sine below which two directions count as parallel
LEAST_STATIONS = 8  # rings along a log, however short it is

# The narrow phase of log and obstacle (``narrow_phase``)
DEEPEST_STEPS = 40  # looks at most for the least gap along a core; it needs one beside a log's side, else about eight
# [m] to which that gap is found; the normal is then good to its square root over the radius, 1e-6 rad. With 1e-6 m it
# was 1e-3 rad askew to an edge, which passed for the way out of a plate that the log's end was 7 cm in
DEEPEST_WITHIN = 1e-12
THROUGH_AXIS = 1e-6  # [-] length of the gap's gradient below which a core goes right through the log's axis: no side
LINE_ANGLE = 0.1  # [-] squared sine to the log's side (or face) below which a core lies along it: two contacts
LINE_APART = 0.5  # [-] of the log's base radius: contacts on one line are at least so far apart
LINE_INSET = 0.01  # [-] of that line, by which they stand in from its ends, where side and face meet
POST_LEAN = 0.02  # [-] part of a post's normal towards its plate beyond which the plate is touched before the post
BEHIND_FACE = 0.5  # [-] part along the log's axis of the way out of a post beyond which it is just behind an end's face
PUSHES_DOWN = 1e-9  # [-] upward part of a normal above which an edge would push a log down: its plate is below it
STRAIGHT = 1e-6  # [-] sine of a bend in a barrier's line that is none
JOINED = 1e-3  # [m] ends of pieces so near to one another are one joint
POST_LENGTH = 1e3  # [m] a barrier's posts go down from its top, into the ground

# Bodies given as point clouds
ON_SURFACE = 1e-6  # [-] of the size: points deeper under the hull's surface than this cannot touch anything
ALIKE = 1e-6  # [-] moments of inertia that differ by less are equal
FLAT = 1e-9  # [-] of the cloud's size: nearer to a face's plane than this is on it
SAME_FACE = 1e-6  # [-] of the cloud's size: triangles that stand off a face's plane by no more are of that face
LEAST_THICKNESS = 1e-6  # [-] of the cloud's size: a cloud that is thinner has no volume
BEHIND = 1e-7  # [-] of the distance between cloud and core plus a metre: corners are behind a plane, to so much
CORE_APART = 0.1  # [-] of the cloud's thickness: longer stretches of a core that is inside have two contacts
CLOUD_TURN = 0.05  # [rad] in a step at most: half its sine is a false resistance to rolling of a body of many corners
TURN = 0.2  # [rad] an asymmetric body turns at most so far in one composed step of its free rotation
MIDPOINT_ITERATIONS = 50  # of the implicit midpoint rule's fixed point; it contracts by about 0.05
MIDPOINT_ACCURACY = 1e-16  # [-]
ASKEW = 1e-3  # [m] by which an edge is deeper in a core where they cross than at the ends of what they share
FACE_ALIGNED = 0.9986  # [-] cosine of 3 degrees: a face or edge so near to an obstacle's core lies along it
CORE_BELOW = 3.0  # [m] a stem goes on below the ground, for what comes from the side of a steep slope
STUMP = 3.0  # [m] height up to which a stem is cut or broken: as wide as its DBH all the way up, and flat at its top
STUMP_RIM = 0.25  # [-] of its radius: the rounding of the rim, half of its height at most
TOP_LOOKS = 40  # chords of a flat top looked at for its least gap, at most; halving its width, 1e-12 of it
TOP_LEVEL = 1e-9  # [-] change of the gap across the chord below which it is the one

# The terrain's border
BURIED = 0.5  # [-] of the log's radius at its base: what is deeper in the ground, of a log of which a part was beyond
# the border, came in below the surface there, where nothing held it up: it has left. Beyond the border a log hangs free

# What is deeper than it may be
BELOW_GROUND = 0.5  # [s] that a log may be deeper in the ground than its radius and a step's travel: at speed a sharp
# edge lets it in for some tenths of a second, before it is out again; what stays is lost

# Rest
REST_WINDOW = 0.25  # [s] between two looks at a slow log
REST_TRAVEL = 0.05  # [-] of rest_speed * REST_WINDOW (1.3 mm at the default): a log at rest moves less between looks
REST_ACCELERATION = 1e-5  # [-] of g: the frozen log, let go, must not start faster than this (certificate)
REST_SOLVED = 0.01  # [-] of that, to which its solve is brought
REST_STEP = 0.01  # [s] longest step of the certificate
REST_SWEEPS = 1000  # sweeps granted to the certificate's solve
REST_LOOK = 20  # of these, between two looks at whether the log will come to rest in them at all
ROCKING_WINDOW = 2.5  # [s] of the windows in which a log that rocks in place is watched; it may take three to swing
ROCKING_SPEED = 10.0  # [-] of rest_speed, squared the most energy per mass of a log that is watched
ROCKING_RANGE = 1.0  # [m] along x, y and z in which its ends stay
ROCKING_CREEP = 0.01  # [-] of rest_speed: it may creep so fast (1 mm/s at the default). With a quarter of that 302 of
# 304 logs rest; with five times as much one of 308 was seen to creep on for a minute and then to slide down 30 m
ROCKING_GROWTH = 1.02  # [-] its peak energy may not grow (a log that starts to slide quadruples it)

# Energy books
LEAST_SPENT = GRAVITY  # [J/kg] that an error is measured by at least: a metre's fall

# Trees that break (``breaking``)
BREAKING_LOOKS = 60  # shares of a tree's push tried at most, beside others that push; a log in a jam needs twenty
BROKEN_WITHIN = 1e-9  # [-] of its capacity: a share that takes it so nearly is the one, the rest is made up exactly

# Ledger of hits
HIT_PAUSE = 0.1  # [s] without a push after which the next push is another hit: contacts flicker for a step or two
BLOW = 2.0  # [-] of g dt: what a log approaches faster is struck; slower, it is leant upon
LEAST_PUSH = 1e-6  # [m/s] per mass: a smaller first push is rounding, not a hit

# What can slide, least and most; the most is well over what there is, so what exceeds it is another unit or a slip.
# Beyond it a log is wider than the DEM: no point of it lies over terrain that it could be put on
DIAMETER = (1e-3, 15.0)  # [m] the thickest stem known, Mexico's Tule cypress, has 14 m
LENGTH = (1e-2, 150.0)  # [m] the tallest tree known, a redwood, has 116 m
DENSITY = (1.0, 25_000.0)  # [kg/m3] balsa has 40, osmium 22 600; less than 1 is t/m3 by mistake
SHAPE_SIZE = (1e-3, 150.0)  # [m] longest side of a point cloud: the boulders of rock falls end at 30 m, logs at LENGTH

# Health
WILD_SPEED = 2000.0  # [m/s] faster than any fall on Earth's slopes: the log is reported as failed
POLL_STEPS = 512  # steps between two looks at the stop flag (about 1 ms)

# Stages that logs are slid again from (``stages``)
STAGE_STEPS = 16  # from one to the next: to keep one costs as much as a step, and half of these are slid twice
MOST_STAGES = 64  # of a log; what matters to it later is slid again from the last one
STAGE_CONTACTS = 16  # room for loaded contacts, and for near cores, a stage of a log; they have a few each
STAGE_BYTES = 2**30  # of all logs of a run together; those done later are slid again from their release
