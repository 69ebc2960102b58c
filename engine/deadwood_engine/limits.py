"""Every tolerance and limit of the engine, with its unit and the reason for it."""

GRAVITY = 9.81  # m/s2, as in the paper

# Contact solver
EXACT_BLOCK_COUPLING = 0.5  # [-] mu |G_nt| / G_nn above which split sweeps converge slowly: the 3x3 block is solved
SLIP_ARCS = 16  # arcs of a half circle in which the direction of slip is sought
BLOCK_SWEEPS = 50  # sweeps with whole blocks; a problem still unsolved may be cycling between several solutions
BISECTIONS = 60  # of such an arc: to the last bit of an angle
EXTRAPOLATE_FROM = 20  # sweeps after which the remaining error is one slow mode; solves of unconfined logs take 1 to 5
EXTRAPOLATE_LINES_FROM = 120  # the same with lines of contacts: friction along them mostly converges without help
EXTRAPOLATE_UNTIL = 1000  # sweeps after which nothing is extrapolated, because that may cycle
EXTRAPOLATE_EVERY = 8  # sweeps between two extrapolations, in which other modes decay and the rate shows
EXTRAPOLATE_ALIKE = 0.9  # [-] cosine between the changes of two sweeps above which they belong to one mode
EXTRAPOLATE_MOST = 300.0  # greatest number of sweeps that one extrapolation replaces
DISC_ITERATIONS = 12  # Newton steps of the friction disc's secular equation; it needs 1-4
DISC_ACCURACY = 1e-2  # [-] of the friction impulse before it is projected onto the disc; each further sweep squares it
LEAST_APPROACH = 1e-9  # [m/s] that counts as zero, whatever the tolerance: 10 pm in a step (without gravity, rounding)
LEAST_TOLERANCE = 1e-15  # [m/s] added to the fidelity's: rounding, where there is no gravity for scale

# Lines of contacts (``pressure``)
# [-] greatest angle between normals of a line; float32 heights of 100 m turn those of 0.5 m cells by 2e-5
LINE_TURN = 1e-4
LINE_STEP = 1e-3  # [m] least distance along the log between contacts of a line: those of one ring or face are none
LINE_ROOM = 2e-5  # [m] greatest deviation of the gaps from a line; heights of 200 m in float32 are rounded to 8e-6
LINE_BEND = 1e-3  # [m] greatest deviation of the lever arms from a line

# Outlines (``trace``)
WITHIN = 0.2  # [cells] greatest deviation of an end from the straight path between two outlines; of two steps, if more

# Obstacles near the log
OBSTACLE_TRAVEL = 0.3  # [-] of both radii: beside thin obstacles, greatest travel of the fastest point in a step
LYING_TRAVEL = 0.2  # [-] of both radii: the same beside a lying log, which a spinning log may strike from any side
FIRST_TOUCH = 0.1  # [-] of both radii: distance between two poses at which the first touch of a stem is sought
TOUCH_DEPTH = 0.05  # [-] of both radii: greatest depth of the pose of a first touch
MOST_LOOKS = 40  # greatest number of poses within a step at which the first touch of one stem is sought
# [m] gap at the end of a step below which an obstacle is a contact although the predicted path does not touch it: a
# base that strikes the ground whips its tip against what it would have passed (at 8 m/s and steps of 33 ms, with 5 cm:
# 8 cm into a lying log)
UNFORESEEN = 0.10
OBSTACLE_ALONG = 0.3  # [-] of both radii: travel of a thin log along its own axis in a step beside a thicker stem
THICK = 0.35  # [m] radius of log and stem together above which the sideways speed limits a step, not the fastest point
SAFE = 1.0 - 1e-6  # [-] of a distance: more than the rounding error of a path summed over many steps
NEAR_MARGIN = 2.0  # [m] obstacles this close to the log are listed; listed again when its ends have moved by half of it
MADE_ANEW = 0.7  # [-] of a step: if a contact's impulse leaves less than that beside a stem, the step is repeated
# [-] of a step: an earlier rebound takes place at the start of the step; otherwise the step ends there
MET_AT_ONCE = 0.01
# A step in which a log strikes something ends soon after (``contacts.first_strike``)
STRIKE = 0.1  # [-] of the log's speed, beyond what gravity adds in a step: a slower approach is no strike (6 degrees)
PAST_STRIKE = 0.1  # [-] of the step: how long after the strike it ends
LATE_STRIKE = 0.5  # [-] of the step: if it would not be shortened to less than that, it is not worth a second query
SHORTEST_STEP = 1e-6  # [s] floor of the adaptive step; 100 m/s then travels 0.1 mm

# Scarring drag (``scarring``)
SOIL_DENSITY = 1700.0  # kg/m3, as in Lu et al. (2019)
SCAR_STEP = 1e-4  # [s] least step when the depth of a scar bounds it: a scar of zero depth at a high speed

# Contact detection
AT_ONCE = 1e-9  # [s] a step so short that the predicted pose is the present one: contacts at the release
IMPACT = 2.0  # [-] of g dt: a slower approach is what gravity adds in two steps, not an impact
HOVER = 0.5  # [-] of g dt^2: smaller gaps count as closed (0.5 mm at 10 ms); otherwise the contacts of a log at rest
# differ by the rounding of the DEM, and the solver spends its sweeps on that

HOVER_MOST = 5e-4  # [m] upper bound of that: long steps would let logs rest on air

# [-] least cosine (26 degrees) between a ring's planes of two steps that count as one plane that turned. A candidate
# that was over one wall of a channel may be over the other in the next step: an impulse between the two would carry the
# log without the wedge that increases friction (in a V with sides of 45 degrees it accelerated by 33 % too fast)
SAME_PLANE = 0.9
LEAST_TURN = 1e-2  # [-] of g dt: a contact plane that turns by less counts as unchanged (``turning``)

MERGED = 0.1  # [-] of the radius: candidates of one ring that are closer than this are one contact (with 0.3 a
# rim on two cells touched only one of them)
# [-] cosine of the ground's slope in a ring's plane below which the ring's first candidate is mirrored (37 degrees): in
# a channel with such sides the one at 45 degrees from one wall's is up to 30 degrees from the other's
CHANNEL = 0.8
# [m/s] speed below which a fidelity with one point a ring seeks contacts as the finer ones do: a log that jams for a
# minute would sink to its axis between walls, and on peaks between two rings, that are found in one step in two
SLOW = 1.0
STEEP_LOG = 0.25  # [-] squared horizontal part of the axis up to which it is too steep for that (60 degrees)
ANY_POINT = 1e-6  # [-] sine of axis and ground's normal below which no point of a ring is deeper than another
REFINED = 0.3  # [-] of the radius: candidates nearer to the ground are sought again, perpendicular to it

CREST = 2e-3  # [-] of the radius: a crest that rises by less is flat ground, which the rings touch
ALONG_GRID = 0.05  # [-] sine of the angle to a grid line below which a log lies along it
BESIDE_CREST = 0.05  # [cells] distance on either side of a crest over which the ground must fall away from the log
SAME_CELL = 1e-9  # [cells] a parabola whose lowest point misses the ground by more has left its cell
WALL = 0.5  # [-] sine of the ground's tilt along the axis above which it is a wall, not the flank of a ridge:
# steeper ground could pass between the candidates of an end's rim, and impale a log that its side does not stop
LEAST_UPWARD = 0.1  # [-] least upward component of a normal of the cone's side that replaces the ground's

# Near contact: how much steeper the ground may become around a cell (``terrain.kinks_of``)
LEAST_TRAVEL = 0.2  # [-] of a step's greatest travel, on ground however rugged (``Fidelity.smooth_kinks``)
RUGGED = 1.0  # [-] kinks along the log from which contacts are also sought halfway to the next ring: a spike may be
# narrower than the distance between rings
KINK_REACH = 0.5  # [m] around it at least: a ring's radius and half the distance to the next ring
KINK_CELLS = 5  # around it at most; on finer cells than KINK_REACH / KINK_CELLS thick logs are always queried in full

# Geometry
WHOLE = 1e-9  # [-] by which a quotient may exceed a whole number and still count as whole
VERTICAL = 1e-12  # [-] horizontal part of a unit vector: a more upright one has no direction in plan
SMALL_TURN = 0.01  # [-] square of half an angle up to which the series of its sine and cosine is exact to the last bit
SKEW_LINES = 1e-9  # [-] squared sine below which two segments are parallel: any pair of opposite points is the nearest
FLAT_TOLERANCE = 1e-9  # [-] sine below which two directions count as parallel
LEAST_STATIONS = 8  # least number of rings along a log, however short

# The narrow phase of log and obstacle (``narrow_phase``)
DEEPEST_STEPS = 40  # greatest number of evaluations for the least gap along a core; beside a log's side one suffices
# [m] to which that gap is found; the normal is then accurate to its square root over the radius, 1e-6 rad. With 1e-6 m
# it was 1e-3 rad off an edge's, and was taken for the separation from a plate that the log's end was 7 cm in
DEEPEST_WITHIN = 1e-12
THROUGH_AXIS = 1e-6  # [-] length of the gap's gradient below which a core passes through the log's axis: no side
LINE_ANGLE = 0.1  # [-] squared sine to the log's side (or face) below which a core lies along it: two contacts
LINE_APART = 0.5  # [-] of the log's base radius: least distance of contacts on one line
LINE_INSET = 0.01  # [-] of that line, by which they are inset from its ends, where side and face meet
POST_LEAN = 0.02  # [-] component of a post's normal towards its plate above which the plate is touched before the post
BEHIND_FACE = 0.5  # [-] axial component of the separation from a post above which the post is just behind an end's face
PUSHES_DOWN = 1e-9  # [-] upward component of a normal above which an edge would press a log down: its plate is below it
STRAIGHT = 1e-6  # [-] sine of a bend in a barrier's line below which it is straight
JOINED = 1e-3  # [m] ends of pieces closer than this are one joint
POST_LENGTH = 1e3  # [m] a barrier's posts extend this far down from its top, into the ground

# Bodies given as point clouds
ON_SURFACE = 1e-6  # [-] of the size: points deeper below the hull's surface than this cannot touch anything
ALIKE = 1e-6  # [-] moments of inertia that differ by less are equal
FLAT = 1e-9  # [-] of the cloud's size: points closer to a face's plane than this are on it
SAME_FACE = 1e-6  # [-] of the cloud's size: triangles that deviate from a face's plane by less belong to that face
LEAST_THICKNESS = 1e-6  # [-] of the cloud's size: a thinner cloud has no volume
BEHIND = 1e-7  # [-] of the distance between cloud and core plus a metre: vertices are behind a plane to this accuracy
CORE_APART = 0.1  # [-] of the cloud's thickness: longer stretches of a core inside have two contacts
# [rad] in a step at most: half its sine is a spurious rolling resistance of bodies with many vertices
CLOUD_TURN = 0.05
TURN = 0.2  # [rad] greatest rotation of an asymmetric body in one composed step of its free rotation
MIDPOINT_ITERATIONS = 50  # of the fixed-point iteration of the implicit midpoint rule; it contracts by about 0.05
MIDPOINT_ACCURACY = 1e-16  # [-]
ASKEW = 1e-3  # [m] by which an edge is deeper in a core where they cross than at the ends of the shared stretch
FACE_ALIGNED = 0.9986  # [-] cosine of 3 degrees: a face or edge this close to a core's direction lies along it
CORE_BELOW = 3.0  # [m] a stem continues below the ground, for bodies that arrive from the side of a steep slope
STUMP = 3.0  # [m] height up to which a tree is a cut or broken stump: as wide as its DBH up to its flat top
STUMP_RIM = 0.25  # [-] of its radius: the rounding of the rim, at most half of its height
TOP_LOOKS = 40  # greatest number of chords of a flat top evaluated for its least gap; by bisection to 1e-12
TOP_LEVEL = 1e-9  # [-] change of the gap across the chord below which it is the least

# The terrain's border
BURIED = 0.5  # [-] of the log's base radius: a part deeper in the ground, of a log of which a part was beyond
# the border, came in below the surface there, where nothing supported it: it has left. Beyond it a log hangs free

# Excessive depth
BELOW_GROUND = 0.5  # [s] that a log may be deeper in the ground than its radius and a step's travel: at speed a sharp
# edge lets it in for some tenths of a second, before it is out again; a log that stays is lost

# Rest
REST_WINDOW = 0.25  # [s] between two tests of a slow log
REST_TRAVEL = 0.05  # [-] of rest_speed * REST_WINDOW (1.3 mm at the default): a log at rest moves less between tests
REST_ACCELERATION = 1e-5  # [-] of g: the stopped log, released, must not accelerate faster (static equilibrium)
REST_SOLVED = 0.01  # [-] of that, to which the solve of the test is brought
REST_STEP = 0.01  # [s] longest step of the test
REST_SWEEPS = 1000  # greatest number of sweeps in the test's solve
REST_LOOK = 20  # of these, between two checks of whether the log can come to rest within the remaining ones
ROCKING_WINDOW = 2.5  # [s] of the windows in which an oscillating log is observed; a period may take three seconds
ROCKING_SPEED = 10.0  # [-] of rest_speed, squared the greatest energy per mass of a log that is observed
ROCKING_RANGE = 1.0  # [m] along x, y and z within which its ends stay
ROCKING_CREEP = 0.01  # [-] of rest_speed: permitted creep (1 mm/s at the default). With a quarter of that, 302 of
# 304 logs rest; with five times as much, one of 308 crept on for a minute and then slid 30 m
ROCKING_GROWTH = 1.02  # [-] permitted growth of its peak energy (a log that starts to slide quadruples it)

# Energy balance
LEAST_SPENT = GRAVITY  # [J/kg] least reference for an error: a fall of one metre

# Trees that break (``breaking``)
BREAKING_LOOKS = 60  # greatest number of shares of a tree's impulse tried; a log in a jam needs twenty
BROKEN_WITHIN = 1e-9  # [-] of its capacity: a share this accurate is accepted, and the remainder is corrected exactly

# Ledger of hits
HIT_PAUSE = 0.1  # [s] without an impulse after which the next one is another hit: contacts flicker for a step or two
BLOW = 2.0  # [-] of g dt: an obstacle approached faster is struck; slower, it is leant upon
LEAST_PUSH = 1e-6  # [m/s] per mass: a smaller first impulse is rounding, not a hit

# Least and greatest body that can slide; the greatest is well above what exists, so a larger value is another unit or a
# slip. Beyond it a log is wider than the DEM: no point of it is over terrain on which it could be placed
DIAMETER = (1e-3, 15.0)  # [m] the thickest stem known, Mexico's Tule cypress, has 14 m
LENGTH = (1e-2, 150.0)  # [m] the tallest tree known, a redwood, has 116 m
DENSITY = (1.0, 25_000.0)  # [kg/m3] balsa has 40, osmium 22 600; less than 1 is t/m3 by mistake
SHAPE_SIZE = (1e-3, 150.0)  # [m] longest side of a point cloud: boulders of rockfalls reach 30 m, logs LENGTH

# Sanity checks
WILD_SPEED = 2000.0  # [m/s] faster than any fall on Earth's slopes: the log is reported as failed
POLL_STEPS = 512  # steps between two checks of the stop flag (about 1 ms)

# Checkpoints from which logs are slid again (``stages``)
STAGE_STEPS = 16  # from one to the next: storing one costs as much as a step, and half of these steps are repeated
MOST_STAGES = 64  # per log; for what matters to it later, the log is slid again from the last one
STAGE_CONTACTS = 16  # room for loaded contacts, and for near cores, in a stage of a log; there are a few of each
STAGE_BYTES = 2**30  # of all logs of a run together; logs done later are slid again from their release
