"""A hull against round cores and plates, by a box at random whose distances, depths and corners are known otherwise."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from deadwood_engine import Scene, Shape
from deadwood_engine.cores import BARRIER, CORE, LYING, TREE, SweptSphere
from deadwood_engine.limits import FACE_ALIGNED
from deadwood_engine.log_body import REACH
from deadwood_engine.model import Log, Model, Settings
from deadwood_engine.rotation import set_axis
from deadwood_engine.scratch import Scratch

SIDES = np.array([0.8, 1.0, 1.6])
MOST = 0.3  # of the thicknesses in a step


@pytest.fixture(scope="module")
def scene():
    return Scene.prepare(np.full((30, 30), -9.0), 1.0, 0.0, 0.0, friction=0.4, reference=0.0).arrays


class Box:
    """A box of SIDES somewhere, and a worker's memory that holds its pose as the one ahead."""

    def __init__(self, plain, scene, turn, centre, cores=1):
        ticks = np.array([-0.5, 0.5])
        shape = Shape.of(np.array(np.meshgrid(ticks, ticks, ticks)).reshape(3, -1).T * SIDES)
        self.file, self.scene, self.turn, self.centre = plain("cloud_obstacles"), scene, turn, np.asarray(centre, float)
        self.cloud, self.body = shape.cloud, shape.bodies(np.array([2000.0]))[0]
        self.state = np.zeros(16)
        self.state[:3], self.state[3:7] = centre, np.roll(turn.as_quat(), 1)
        set_axis(self.state)
        self.scratch = Scratch.allocate(8, cores, 1, self.cloud)
        trial = self.scratch.trial[0]
        (trial.x, trial.y, trial.z), (trial.dx, trial.dy, trial.dz) = self.centre, self.state[13:16]
        plain("cloud").matrix_of(self.state, self.scratch.turns, 9)
        self.file.lay_out(self.cloud, self.scratch)
        self.step = plain("contacts").Ahead(1e-9, 0.0, 1e-9, 0.0, 0.4, 0.0)
        self.frame = np.zeros(2, np.int64)
        query = plain("cloud_contacts").CloudQuery
        self.query = query(self.cloud, scene.terrain, self.frame, self.scratch, self.state)

    def distance(self, point):
        """Of places (..., 3) from the box, 0 within."""
        aside = np.abs(self.turn.inv().apply(point - self.centre)) - SIDES / 2
        return np.linalg.norm(np.maximum(aside, 0.0), axis=-1)

    def meets(self, start, u, long, wide, free=(False, False)):
        """Contacts with a core of one radius: (gaps, normals, points of contact, travel)."""
        core = SweptSphere(tuple(start), tuple(u), long, wide, 0.0)
        count, travel = self.file.core_contacts(self.query, 0, self.step, (LYING, 0, 0), core, free, MOST)
        table = self.scratch.contacts[:count]
        normals = np.column_stack([table["n" + axis] for axis in "xyz"])
        return table["room"], normals, self.centre + np.column_stack([table["r" + axis] for axis in "xyz"]), travel


def random_core(rng, box, through):
    """A core beside the box, or right through it: (start, u, long)."""
    u = rng.normal(size=3)
    u /= np.linalg.norm(u)
    long = 6.0 if through else rng.uniform(0.3, 4.0)
    middle = (
        box.centre + box.turn.apply(rng.uniform(-0.4, 0.4, 3) * SIDES) if through else box.centre + rng.normal(size=3)
    )
    return middle - 0.5 * long * u, u, long


def test_beside_the_box_it_is_the_nearest_point(plain, scene):
    """Face, edge or corner of the box, middle or end of the core: distance, and the normal from one to the other."""
    rng = np.random.default_rng(0)
    looked = 0
    for _ in range(150):
        box = Box(plain, scene, Rotation.from_quat(rng.normal(size=4)), rng.uniform(10.0, 20.0, 3))
        start, u, long = random_core(rng, box, False)

        def away(z, box=box, start=start, u=u):
            return box.distance(start + z * u)

        best = minimize_scalar(away, bounds=(0.0, long), method="bounded", options={"xatol": 1e-9})
        z = min((0.0, best.x, long), key=away)
        apart = box.distance(start + z * u)
        if apart < 1e-3:
            continue
        axes = box.turn.as_matrix().T
        square = box.turn.apply(np.clip(box.turn.inv().apply(start + z * u - box.centre), -SIDES / 2, SIDES / 2))
        square = (box.centre + square - start - z * u) / apart
        if max(np.abs(axes @ square).max(), np.abs(axes @ u).max()) > FACE_ALIGNED:
            continue  # within 3 degrees of a face or an edge: below
        gaps, normals, points, travel = box.meets(start, u, long, apart + 0.02)
        both = 0.4 + apart + 0.02  # no farther than a part of both thicknesses, or the neck between two cores
        assert travel >= MOST * min(both, 2.0 * math.sqrt(0.4 * both)) * (1.0 - 1e-12)
        looked += 1
        assert gaps == pytest.approx([-0.02], abs=1e-7)
        assert box.distance(points[0]) < 1e-7
        assert normals[0] == pytest.approx(square, abs=1e-5)
        gaps, _, _, travel = box.meets(start, u, long, apart - 0.02)
        assert len(gaps) == 0
    assert looked > 60


def test_what_is_clear_may_go_as_far(plain, scene):
    """A metre off its face: so far, less rounding, and no contact."""
    box = Box(plain, scene, Rotation.identity(), (15.0, 15.0, 5.0))
    gaps, _, _, travel = box.meets((15.0 + 0.4 + 1.3, 15.0, 0.0), (0.0, 0.0, 1.0), 9.0, 0.3)
    assert len(gaps) == 0
    assert travel == pytest.approx(1.0)


def test_a_core_within_is_let_out_the_shortest_way_square_to_itself(plain, scene):
    """The hull seen along the core is a polygon: its least support over 20 000 directions; two contacts where it is
    inside for long."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        box = Box(plain, scene, Rotation.from_quat(rng.normal(size=4)), rng.uniform(10.0, 20.0, 3))
        start, u, long = random_core(rng, box, True)
        gaps, normals, points, _ = box.meets(start, u, long, 0.1)
        across = np.linalg.svd(u[None])[2][1:]
        angle = np.linspace(0.0, 2 * np.pi, 5_000, endpoint=False)
        m = np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * across[1]
        depth = np.abs(box.turn.inv().apply(m)) @ (SIDES / 2) + m @ (box.centre - start)
        assert len(gaps) in (1, 2)
        assert gaps == pytest.approx(np.full(len(gaps), -depth.min() - 0.1), abs=1e-3)
        assert (gaps >= -depth.min() - 0.1 - 1e-9).all()  # the shortest of all
        assert (np.abs(normals @ u) < 1e-9).all()
        inside = np.linspace(0.0, long, 3001)
        inside = inside[box.distance(start + inside[:, None] * u) == 0.0]
        found = (points - 0.1 * normals - start) @ u
        on_core = start + found[:, None] * u
        assert points == pytest.approx(on_core + 0.1 * normals)  # on the core's skin
        if len(gaps) == 2:
            assert found == pytest.approx([inside.min(), inside.max()], abs=1e-2)
        else:
            assert found[0] == pytest.approx(0.5 * (inside.min() + inside.max()), abs=1e-2)


@pytest.mark.parametrize(("free", "depth"), [((False, False), 0.4), ((True, False), 0.05)])
def test_a_free_end_within_is_let_out_through_the_face(plain, scene, free, depth):
    """A core from 5 cm under the box's lower face downwards: out through it if that end is free, else sideways."""
    box = Box(plain, scene, Rotation.identity(), (15.0, 15.0, 5.0))
    gaps, normals, _, _ = box.meets((15.0, 15.0, 5.0 - 0.8 + 0.05), (0.0, 0.0, -1.0), 3.0, 0.0, free)
    assert gaps == pytest.approx(np.full(len(gaps), -depth))
    assert abs(normals[0, 2]) == pytest.approx(1.0 if free[0] else 0.0)
    if free[0]:
        assert normals[0, 2] == 1.0  # the box goes up


@pytest.mark.parametrize("angle", [1.0, 2.0, 2.9, 3.1, 10.0, 60.0])
def test_an_edge_askew_over_a_core_is_borne_where_they_cross(plain, scene, angle):
    """Within 3 degrees an edge counts as along the core, but the ends of what they share do not touch: 2 mm deep."""
    lean = Rotation.from_euler("x", 45, degrees=True)  # an edge of 1.6 m downwards
    lean *= Rotation.from_euler("y", 90, degrees=True)
    low = np.abs(lean.as_matrix()[2]) @ (SIDES / 2)
    box = Box(
        plain, scene, Rotation.from_euler("z", angle, degrees=True) * lean, (15.0, 15.0, 5.0 + low + 0.05 - 0.002)
    )
    edge = box.turn.apply(box.cloud.corners)
    middle = edge[np.argsort(edge[:, 2])[:2]].mean(axis=0)[:2] + box.centre[:2]
    gaps, *_ = box.meets((middle[0] - 2.0, middle[1], 5.0), (1.0, 0.0, 0.0), 4.0, 0.05)
    assert gaps.min(initial=0.0) == pytest.approx(-0.002, abs=1e-4)


@pytest.mark.parametrize(("shift", "ends"), [(0.0, (14.5, 15.5)), (0.4, (14.9, 15.5)), (-0.7, (14.5, 14.8))])
def test_along_a_face_it_is_two_contacts_at_the_ends_of_what_they_share(plain, scene, shift, ends):
    """A core of 1 m along y, 3 cm over the upper face, its radius 5 cm."""
    box = Box(plain, scene, Rotation.identity(), (15.0, 15.0, 5.0))
    gaps, normals, points, _ = box.meets((15.0, 14.5 + shift, 5.83), (0.0, 1.0, 0.0), 1.0, 0.05)
    assert gaps == pytest.approx([-0.02, -0.02])
    assert normals == pytest.approx(np.array([[0.0, 0.0, -1.0]] * 2))
    assert points == pytest.approx(np.array([[15.0, ends[0], 5.8], [15.0, ends[1], 5.8]]))


def test_corners_beyond_a_plate_are_pushed_back_to_the_middle_s_side(plain, scene):
    """Those from which the way to the centre crosses the plate: not above its edge, and not beside its ends."""
    rng = np.random.default_rng(2)
    behind = 0
    for _ in range(60):
        box = Box(plain, scene, Rotation.from_quat(rng.normal(size=4)), rng.uniform(14.0, 16.0, 3) - (0.0, 0.0, 10.0))
        plate = np.zeros(1, CORE).view(np.recarray)[0]
        turn, rise = rng.uniform(0.0, 2 * np.pi), rng.uniform(-0.3, 0.3)
        ahead = np.array([np.cos(turn), np.sin(turn), rise]) / np.hypot(1.0, rise)
        first = box.centre + rng.normal(size=3) * 0.4 - rng.uniform(0.2, 1.5) * ahead
        plate.x, plate.y, plate.z, plate.long = *first, 2.0
        plate.ux, plate.uy, plate.uz = ahead
        count, travel = box.file._plate_contacts(box.query, 0, box.step, box.body[REACH], 5, plate, MOST)
        normal = np.array([-ahead[1], ahead[0], 0.0]) / np.hypot(*ahead[:2])
        normal *= np.sign(normal @ (box.centre - first))
        expected = {}
        for k, corner in enumerate(box.centre + box.turn.apply(box.cloud.corners)):
            off, off_c = normal @ (corner - first), normal @ (box.centre - first)
            if off < 0.0:
                at = corner + off / (off - off_c) * (box.centre - corner)
                along = (at - first)[:2] @ ahead[:2] / (ahead[:2] @ ahead[:2])  # in units of the core's direction
                if 0.0 <= along <= 2.0 and at[2] <= first[2] + along * ahead[2]:
                    expected[8 + k] = -abs(off)
        keys = box.scratch.keys[:count]
        assert dict(zip(keys[:, 2].tolist(), box.scratch.contacts["room"][:count], strict=True)) == pytest.approx(
            expected
        )
        assert (keys[:, :2] == (BARRIER, 5)).all()
        for c in box.scratch.contacts[:count]:
            assert (c.nx, c.ny, c.nz) == pytest.approx(tuple(normal))
        assert travel >= MOST * 0.4
        behind += count
    assert behind > 40
    far = np.zeros(1, CORE).view(np.recarray)[0]
    far.x, far.y, far.z, far.ux, far.long = 15.0, 25.0, 50.0, 1.0, 2.0
    box = Box(plain, scene, Rotation.identity(), (15.0, 15.0, 5.0))
    count, travel = box.file._plate_contacts(box.query, 0, box.step, box.body[REACH], 5, far, MOST)
    assert count == 0
    assert travel == pytest.approx(10.0 - box.body[REACH])


def test_each_kind_that_is_near_has_its_own_friction(plain, scene):
    """A stem, a lying log and a barrier with one post, all in the box: keys, and friction and restitution of each."""
    box = Box(plain, scene, Rotation.identity(), (15.0, 15.0, 5.0), 3)
    box.state[9] = -1.0
    cores = box.scratch.near_cores
    for k, kind in enumerate((TREE, LYING, BARRIER)):
        core = cores[k]
        core.kind, core.long, core.wide = kind, 9.0, 0.0 if kind == BARRIER else 0.2
        core.x, core.y, core.z, core.ux = 15.3, 15.1, 4.9, 1.0
    cores[0].z, cores[0].ux, cores[0].uz = 0.0, 0.0, 1.0
    cores[2].first_post, cores[2].z = 1.0, 6.5  # the edge above the box, the post right through
    box.scratch.listed[:3], box.scratch.near[0].cores = (7, 8, 9), 3
    settings = Settings(0.01, 0.4, 1.0, 1e-3, 400, 1.0, 0.0, 9.0, 0.1, 0.0, 0.5, 3, False, 0.1, 0.61, 0.11, 0.62, 0.12)
    model = Model._make((*scene._replace(cloud=box.cloud), settings))
    log = Log(box.frame, box.body, 0)
    count, travel = box.file.cloud_obstacle_contacts(model, log, box.state, box.scratch, 0, 1e-3)
    keys, table = box.scratch.keys[:count], box.scratch.contacts[:count]
    assert {tuple(key[:2]) for key in keys.tolist()} == {(TREE, 7), (LYING, 8), (BARRIER, 9)}
    assert 2 in keys[keys[:, 0] == BARRIER][:, 2]
    assert 0 not in keys[keys[:, 0] == BARRIER][:, 2]
    for key, c in zip(keys, table, strict=True):
        friction, restitution = (0.62, 0.12) if key[0] == BARRIER else (0.61, 0.11)
        assert c.mu == friction
        if c.before_n < -1e-9:
            assert c.target == pytest.approx(-restitution * c.before_n)
    assert travel == pytest.approx(MOST * math.sqrt(1.0) * 0.4)
