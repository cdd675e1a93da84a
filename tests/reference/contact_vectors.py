"""The vectors of the predictors `contact` and `field`."""

import worlds
from tandem_reference import pairs
from tandem_reference.predict import Drive
from vector_text import Vector

ONE = 2**30
# Three sub-steps. The last type is small. Planes and one box are tilted, the other box is skewed; nothing is round.
EDGES = [
    3, 9000, 8000, 300, 5000, 100, 900, 2, 2, 2, 2, 20003, 50001, 3002, 100003,
    107427840, 1068354561, 10000001, -150001, -ONE // 2 - 12345, 929887697, 54321, -400000,
    300000, 0, 0, 40000, 40000, 40000, 644245094, 858993459, 0, -858993459, 644245094, 0, 0, 0, ONE,
    -300000, 0, 7, 30000, 50000, 20000, ONE, 0, 0, 644245094, 858993459, 0, 644245094, 0, 858993459,
    0, 300000, 0, 60001, 3, 300000, 250000, 30000,
]  # fmt: skip
# One sub-step and small types, so that a grid unit is a lattice unit.
SMALL = [1, 65536, 300, 100, 100, 200, 300, 4, 0, 0, 0, 128, 40000, 129, 40000, 1000, 70000, 1001, 50000]
# Bodies as large as may be, so that a grid unit is 2^12 lattice units.
LARGE = [
    2, 60000, 8192, 8191, 65536, 8192, 8192, 2, 1, 0, 1, 2**24, 2**20, 2**23 + 4097, 70000,
    0, ONE, 0, 0, 0, 0, 0, 2**25,
]  # fmt: skip


def vectors():
    """All of them by name."""
    return {
        "contact": fifty_steps("contact"),
        "contact_rest": contact_rest(),
        "contact_pairs": pair_edges(),
        "contact_shapes": shapes(),
        "contact_small": small(),
        "contact_large": large(),
        "field": fifty_steps("field"),
    }


def fifty_steps(predictor):
    """The world of 200 bodies among a plane, a box and a ball."""
    line = worlds.timeline(worlds.stream("none", predictor, 200, parameters={**worlds.PARAMETERS, 4: 800}))
    line.world.state = worlds.two_hundred_bodies()
    vector = Vector(f"{predictor}: 200 bodies of two types, a plane, a box, a ball; 50 steps", line)
    vector.predict(50)
    return vector


def contact_rest():
    """A body at rest among others, with contact."""
    of = worlds.stream("none", "contact")
    places = {i: ((i * 30000, 25000 + 4000 * i, 0), (0, -5000 * i, 0)) for i in range(4)}
    line = worlds.timeline(of, places)
    line.world.state.rest[1] = 1
    line.world.state.c[1, 1] = 3000
    line.world.state.v[0, 1] = 6400
    vector = Vector("contact: slot 1 rests (with a velocity, which the others feel); contact wakes nobody", line)
    vector.predict(5)
    return vector


class Places:
    """Bodies of a world, slot by slot, each alone with its partners."""

    def __init__(self):
        self.bodies = {}
        self.types = {}
        self.lane = 0

    def add(self, p, v=(0, 0, 0), kind=0):
        """A body in the next slot."""
        slot = len(self.bodies)
        self.bodies[slot] = p, v
        self.types[slot] = kind

    def new_lane(self):
        """y and z far from all that stands already, above the planes."""
        self.lane += 1
        return 3000000 * self.lane, 41 * self.lane

    def line(self, of, drive):
        """The timeline that starts with them."""
        line = worlds.timeline(of, self.bodies, drive)
        for slot, kind in self.types.items():
            line.world.state.type[slot] = kind
        return line


def heap(places, bodies):
    """Bodies in a heap within a cell."""
    following = worlds.random_numbers(41)
    for _ in range(bodies):
        p = [middle + following(12000) for middle in (4020804, 4020804, 20004)]
        places.add(p, [following(90000) for _ in range(3)])


def shapes():
    """Faces, corners and centres, to the unit."""
    places = Places()
    geometry_edges(places)
    heap(places, 10)
    of = worlds.stream("none", "contact", 60, types=4, constants=EDGES)
    line = places.line(of, Drive((7, -3000, 5), 201))
    vector = Vector("contact: faces, corners and centres of tilted shapes", line)
    vector.predict(3)
    return vector


def cell_of(x, width=10001, shift=2):
    """The cell of a coordinate."""
    return ((x >> shift) * (2**32 // (width + 1))) >> 32


def same_or_next(x, other):
    """The least shift of both, of no more than some cells, with which their cells are the same or neighbours."""
    for by in range(0, 50000, 128):
        if abs(cell_of(x + by) - cell_of(other + by)) <= 1:
            return by
    raise AssertionError("no place found")


def pair_edges():
    """Pairs that pass each other, and a full cell: near or not decides whether they are ever felt."""
    places = Places()
    # The limit of the gap is 325, of 128 lattice units each: (first x, x of the other); the other passes within the frame.
    for x, other in ((0, 324 * 128), (0, 325 * 128), (1, 325 * 128), (127, 324 * 128 - 1), (0, 323 * 128 + 127)):
        for sign in (1, -1):
            y, z = places.new_lane()
            by = same_or_next(sign * x, sign * other)
            places.add((sign * x + by, y, z))
            places.add((sign * other + by, y, z), (-sign * 3 * 64 * 50000, 0, 0))
    # Near only where it will be, by less than a unit: 41599 and a half.
    y, z = places.new_lane()
    part = 2**15 - (2**15 + 1) // 3
    wanted = next(v for v in range(7900000, 8100000) if (-41650 + (v * part >> 21)) == 41599 and (v * part >> 20) & 1)
    by = same_or_next(-41650, 0)
    places.add((by, y, z))
    places.add((by - 41650, y, z), (wanted, 0, 0))
    # Two that fly out at the same pace, further apart than the limit: neither is clamped when pairs are found.
    y, z = places.new_lane()
    edge = next(x for x in range(ONE - 200000, ONE, 128) if cell_of(x + 50000) - cell_of(x) == 1)
    for x in (edge, edge + 50000):
        places.add((x, y, z), (64 * 900000, 0, 0))
    # On the border of cells; the other is a cell and a little away, and comes.
    for cell, x in ((50, 4 * 50 * 10002), (60, 4 * (60 * 10001 + 20))):
        y, z = places.new_lane()
        places.add((x, y, z))
        places.add((x - 40401, y, z), (64 * 9000, 0, 0))
    # Far away, but in the same cell or its neighbour, and at the same place in 16 bits.
    y, z = places.new_lane()
    beside = 0, 1, 7, 8, 9, 55, 56, 57, 63, 64, 65, 71, 72, 73
    far = 2**23 * next(k for k in range(1, 120) if cell_of(k * 2**23) % 512 in beside)
    places.add((1000, y, z))
    places.add((1000 + far, y, z + 9000))
    assert pairs.short(far >> 2) == 0
    heap(places, 20)
    of = worlds.stream("none", "contact", 60, types=4, constants=EDGES)
    line = places.line(of, Drive((7, -3000, 5), 201))
    vector = Vector("contact: pairs that are just near or not, and a cell of twenty", line)
    vector.predict(3)
    return vector


def geometry_edges(places):
    """Bodies in and about the shapes of EDGES; those of type 2 have the values of type 1, the last in the table."""
    for p in (
        (300000, 0, 0), (300000, 1, 0), (299000, 45000, 30000), (360001, 3000, 5), (300000, 55000, 52000),
        (345000, 44000, 49999),
        (-300000, 0, 7), (-300010, 20001, 3), (-270000, 60001, 30011), (-265001, 49000, -16000), (-331000, -3, 9),
        (0, 300000, 0), (3, 300000, 250000), (55001, 340001, 20003), (-30001, 355003, -40003),
        (150000, -170001, 3), (90001, -390000, 5), (700001, 20007, -5),
    ):  # fmt: skip
        places.add(p, (p[0] % 5000 - 2500, -4001, p[2] % 3000), 2 if p[0] % 3 == 1 else 0)
    following = worlds.random_numbers(42)
    for i in range(16):
        p = [following(65000) for _ in range(3)]
        places.add((p[0] + (300000, -300000)[i % 2], p[1], p[2]), [following(9000) for _ in range(3)], i // 2 % 2)
    # Two bodies at one place, two that overlap by nearly all, one at the limits.
    y, z = places.new_lane()
    places.add((5, y, z), (5000, 40, -60))
    places.add((5, y, z), (-900, 777, 3))
    places.add((4, y + 22990, z), (-900, -77777, 3), 1)
    y, z = places.new_lane()
    places.add((-ONE, y, z), (-(2**28), 2**28, 2**28 - 1))


def small():
    """Small bodies of which a grid unit is a lattice unit, in as few cells as there may be."""
    of = worlds.stream("none", "contact", 4, types=4, constants=SMALL)
    bodies = {
        0: ((0, 0, 0), (640, 0, 0)),
        1: ((256, 0, 0), (-640, 64, 0)),
        2: ((9000, 7, 0), (0, 0, 0)),
        3: ((9256, 7, 0), (-6400, 0, 640)),
    }
    line = worlds.timeline(of, bodies, Drive((0, 0, 0), 0))
    line.world.state.type[:] = range(4)
    about = "contact, one sub-step: a pair that touches so little that its depth is 0, one whose t ends a slice of 2^12"
    vector = Vector(about, line)
    vector.predict(3)
    vector.say("slots 0 and 1 at exactly the sum of their radii, which do not touch")
    vector.delta(worlds.teleported({0: ((0, 0, 0), (640, 0, 0)), 1: ((0, 0, -257), (-640, 64, 0))}))
    vector.predict(1)
    vector.say("four bodies in one heap")
    heap = {i: ((700 * i, 900 * (i % 2), -600 * (i // 2)), (99 - i, 7, 5)) for i in range(4)}
    vector.delta(worlds.teleported(heap))
    vector.predict(3)
    return vector


def large():
    """Bodies of the largest radius, up to the limits of the state."""
    places = Places()
    following = worlds.random_numbers(43)
    for i in range(14):
        wide = 2**26 if i < 10 else 2**30
        speed = 2**22 if i < 5 else 2**28
        places.add([following(wide) for _ in range(3)], [following(speed) for _ in range(3)], i % 2)
    line = places.line(worlds.stream("none", "contact", 14, types=2, constants=LARGE), Drive((0, -(2**20), 0), 65535))
    vector = Vector("contact: the largest bodies, forces and velocities up to their limits", line)
    vector.predict(4)
    return vector
