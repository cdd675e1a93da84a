"""The predictor `rigid`: bodies that turn and do not give way, by impulses in sub-steps. Plain integers."""

from dataclasses import dataclass, field
from math import isqrt

import numpy as np

from .. import contact, geometry, turn
from ..errors import require
from ..hard import ordered_pairs, sleeping
from ..state import MOST_C, MOST_P, MOST_V
from . import boxes, solids
from .solids import BOX, ROUND, clamp, cross, dot, minus, plus

UNIT = 2**12
MOST_START, MOST_FALL, MOST_GAP, MOST_OUT = 3 * 2**13, 2**13 - 1, 2**20, 2**8
MOST_WORD, MOST_CHANGE, MOST_SLIDE = 2**15 - 1, 2**12 - 1, 2**11 - 1
MOST_SLIP = 2**13
PAIR_WAVES, WAVES = 40, 50
MOST_IN_CELL, CONTACTS_A_BODY = 48, 20
FIRST_PASSES, LATER_PASSES = 6, 4
CALM_FRAMES = 5


@dataclass(frozen=True)
class World:
    """The constants: those of contacts, and (kind, three sizes) of each type."""

    contact: contact.World
    solids: list

    @property
    def shift(self):
        """A grid unit is 2^shift lattice units."""
        return max(0, (2 * max(solids.sized(solid, 0, 0).radius for solid in self.solids)).bit_length() - 14)


def read_world(constants):
    """The world that `predictor_constants` tells."""
    require(len(constants) > 7 and constants[7] >= 1, "session", "too few predictor constants")
    count = 4 * constants[7]
    require(len(constants) >= count, "session", "too few predictor constants")
    split = len(constants) - count
    world = contact.read_world(constants[:split])
    require(world.substeps in (1, 2, 4, 8), "session", f"{world.substeps} sub-steps with the predictor rigid")
    shapes = [tuple(constants[at : at + 4]) for at in range(split, len(constants), 4)]
    for kind, x, y, z in shapes:
        sizes = (x, y, z) if kind == BOX else (x, y or 1, z + 1)
        good = kind in (ROUND, BOX) and all(1 <= size <= 2**22 for size in sizes) and (kind == BOX or z == 0)
        require(good, "session", f"a solid {kind} {x} {y} {z}")
    return World(world, shapes)


def word(x):
    """Keep x within 16 bits."""
    return max(-(2**15), min(x, MOST_WORD))


def words(vector):
    """The same of each component."""
    return [word(x) for x in vector]


@dataclass
class Row:
    """An impulse along d: its arms and what it does to both spins, in 2^-12; 1 / its effect in 2^-14."""

    d: list
    arm_a: list
    arm_b: list
    turn_a: list = None
    turn_b: list = None
    inverse: int = 0

    def speed(self, a, b):
        """The relative velocity along d, a's minus b's, of two pairs of velocity and spin."""
        return (dot(self.d, words(minus(a[0], b[0]))) + dot(self.arm_a, a[1]) - dot(self.arm_b, b[1])) >> 12


@dataclass
class Body:
    """A body in a frame; `place` of the geometry is the number of bodies."""

    placed: solids.Placed = None
    slot: int = -1
    place: int = 0
    p: list = None
    mobility: int = 0
    still: bool = True
    asleep: bool = False  # then it is still, too
    way: int = 0
    start: list = field(default_factory=lambda: [0] * 3)
    start_spin: list = field(default_factory=lambda: [0] * 3)
    fall: list = field(default_factory=lambda: [0] * 3)
    inertia: list = None
    box: boxes.Box = None
    used: int = 0
    contacts: list = field(default_factory=list)  # the bodies that it touches

    def begin(self):
        """Set the motion to that at the start of the frame."""
        self.v, self.spin = list(self.start), list(self.start_spin)
        self.base = None
        self.moved, self.turned = [0] * 3, [0] * 3

    def motion(self):
        """Velocity and spin."""
        return self.v, self.spin

    def way_so_far(self, bits):
        """What moved and turned, by the number of sub-steps."""
        return [x >> bits for x in self.moved], [x >> bits for x in self.turned]

    def begin_substep(self, k, bits):
        """Fall, and make again what the impulses of the sub-step before did."""
        parts = [((k * x) >> bits) - (((k - 1) * x) >> bits) for x in self.fall]
        base = words(plus(self.v, parts)), self.spin
        if self.base is not None:
            self.v = words(plus(base[0], words(minus(self.v, self.base[0]))))
            self.spin = words(plus(base[1], words(minus(self.spin, self.base[1]))))
        else:
            self.v = base[0]
        self.base = base

    def arm(self, at):
        """A point by the radius."""
        if self.placed is None:
            return [0, 0, 0]
        radius = self.placed.solid.radius
        return [clamp(x, 64 * radius) * (2**40 // radius) >> 34 for x in at]

    def turn(self, arm, share):
        """What an impulse with this arm does to the spin."""
        if self.placed is None:
            return [0, 0, 0]
        return [clamp(dot(row, arm) >> 10, MOST_WORD) * share >> 12 for row in self.inertia]


def inertia_of(placed):
    """The inverse inertia in the world, three rows, in 2^-10."""
    rows = [[0] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(3):
            terms = (((axis[i] * axis[j]) >> 36) * inverse for axis, inverse in zip(placed.axes, placed.solid.inverse))
            rows[i][j] = sum(terms) >> 14
    return rows


class Contact:
    """A contact while it is solved."""

    def __init__(self, a, b, gap, n, arm_a, arm_b, slip):
        self.a, self.b, self.gap = a, b, gap
        most = max(a.mobility, b.mobility)
        self.shares = a.mobility * UNIT // most, b.mobility * UNIT // most
        t1 = slip if any(slip) else any_tangent(n)
        t2 = [x >> 12 for x in cross(n, t1)]
        self.rows = [row_of(d, arm_a, arm_b) for d in (n, t1, t2)]
        for row in self.rows:
            row.turn_a, row.turn_b = a.turn(row.arm_a, self.shares[0]), b.turn(row.arm_b, self.shares[1])
            turns = (dot(row.arm_a, row.turn_a) + dot(row.arm_b, row.turn_b)) >> 12
            row.inverse = 2**26 // max(sum(self.shares) + turns, UNIT)
        self.push = [0, 0, 0]
        self.wanted = 0

    def apply(self, row, impulse):
        """Change both bodies' motions by an impulse along a row."""
        for body, share, by, sign in ((self.a, self.shares[0], row.turn_a, 1), (self.b, self.shares[1], row.turn_b, -1)):
            part = (impulse * share + 2**11) >> 12
            body.v = words(x + sign * ((y * part + 2**11) >> 12) for x, y in zip(body.v, row.d))
            body.spin = words(x + sign * ((y * impulse + 2**11) >> 12) for x, y in zip(body.spin, by))

    def needed(self, row, wanted):
        """The impulse that brings the speed along a row to `wanted`."""
        missing = clamp(wanted - row.speed(self.a.motion(), self.b.motion()), MOST_WORD)
        return (missing * row.inverse + 2**13) >> 14

    def want(self, bits, slop, near):
        """Set the speed at which the bodies are to leave each other at least."""
        gap = clamp(self.gap + self.rows[0].speed(self.a.way_so_far(bits), self.b.way_so_far(bits)), MOST_GAP)
        self.wanted = min(((-gap * 51) << bits) >> 8, MOST_OUT) if gap < 0 else min(0, (slop - gap) << bits)
        if gap > near:
            self.wanted = -MOST_WORD

    def set_push(self, k, impulse):
        """Set one of the accumulated impulses, or bring it nearer."""
        change = clamp(impulse - self.push[k], MOST_CHANGE)
        if change:
            self.apply(self.rows[k], change)
        self.push[k] += change

    def solve(self, friction):
        """One pass over the contact."""
        pushed = self.push[0] + self.needed(self.rows[0], self.wanted)
        self.set_push(0, max(0, min(pushed, MOST_WORD)))
        most = min((self.push[0] * friction) >> 12, MOST_SLIDE)
        for k in (1, 2):
            self.set_push(k, clamp(self.push[k] + self.needed(self.rows[k], 0), most >> (k - 1)))


def any_tangent(n):
    """A direction across a normal."""
    sign = -1 if n[2] < 0 else 1
    x = (n[0] * (2**24 // (UNIT + sign * n[2])) + 2**11) >> 12
    return [UNIT - ((n[0] * x + 2**11) >> 12), -sign * ((x * n[1] + 2**11) >> 12), -n[0]]


def slip_of(a, b, n, arm_a, arm_b, bits):
    """Where a slides on b at the start of the first sub-step; zeros if nowhere."""
    falling = [clamp(x + (f >> bits) - y - (g >> bits), MOST_WORD) for x, f, y, g in zip(a.v, a.fall, b.v, b.fall)]
    moving = zip(falling, cross(a.spin, arm_a), cross(b.spin, arm_b))
    u = [(v << 4) + (of_a >> 8) - (of_b >> 8) for v, of_a, of_b in moving]
    if any(abs(x) >= MOST_SLIP for x in u):
        u = [clamp(x >> 5, MOST_SLIP - 1) for x in u]
    apart = dot(n, u) >> 12
    slip = [clamp(x - (y * apart >> 12), 2 * MOST_SLIP) for x, y in zip(u, n)]
    far = isqrt(dot(slip, slip))
    return [x * (2**24 // far) >> 12 for x in slip] if far >= 16 else [0, 0, 0]


def row_of(d, arm_a, arm_b):
    """The direction and the arms of an impulse along d."""
    return Row(d, [x >> 12 for x in cross(arm_a, d)], [x >> 12 for x in cross(arm_b, d)])


class Frame:
    """A frame: what holds for all bodies, the bodies by place, and the contacts."""

    def __init__(self, state, world, values, gravity, before, damping):
        self.world, self.capacity = world, state.capacity
        self.threshold = values[1] * 64
        self.shift = max(0, self.threshold.bit_length() - 9)
        self.wall, self.friction = values[10], values[11]
        self.slop = (self.threshold >> self.shift) // 10
        self.near = (self.threshold >> self.shift) // 4
        self.bits = world.contact.substeps.bit_length() - 1
        self.solids = [solids.sized(solid, values[9], values[12]) for solid in world.solids]
        self.largest = max(solid.radius for solid in self.solids)
        self.reach = min(values[1], self.largest)
        self.pair_shift = max(self.shift, ((3 * self.largest + self.reach) << 6).bit_length() - 15)
        self.gravity, self.damping = gravity, damping
        self.put_in_order(state, gravity == before)
        self.geometry = Body(place=len(self.bodies))
        self.geometry.begin()
        self.found = []

    def put_in_order(self, state, same_gravity):
        """Fill the bodies by place."""
        alive = np.flatnonzero(state.alive)
        self.side = 2
        while 2 ** (3 * self.side) < 2 * self.capacity:
            self.side += 1
        shift = self.world.shift
        scale = 2**32 // (((2 * self.largest + self.reach) >> shift) + 1)
        x, y, z = ((state.p[:, alive] >> shift) * scale) >> 32
        cells = (x + (y << self.side) + (z << 2 * self.side)) & (2 ** (3 * self.side) - 1)
        order = np.argsort(cells, kind="stable")
        held = np.bincount(cells, minlength=2 ** (3 * self.side))
        rank = np.arange(len(cells)) - (np.cumsum(held) - held)[cells[order]]
        order = np.concatenate([order[rank < MOST_IN_CELL], np.sort(order[rank >= MOST_IN_CELL])])
        self.held = np.minimum(held, MOST_IN_CELL)
        self.first, self.cells = np.cumsum(self.held) - self.held, cells[order]
        v, w = state.v[:, alive], state.w[:, alive]
        radii = [self.solids[min(int(kind), len(self.solids) - 1)].radius for kind in state.type[alive]]
        fast = np.array([not is_slow(2 * self.threshold, *one) for one in zip(v.T.tolist(), w.T.tolist(), radii)], bool)
        asleep = sleeping(state, alive, cells, self.side, same_gravity, v.any(axis=0) | w.any(axis=0), fast)
        self.bodies = [self.body(state, int(alive[k]), place, bool(asleep[k])) for place, k in enumerate(order)]

    def body(self, state, slot, place, asleep):
        """A body at the start of the frame."""
        kind = min(int(state.type[slot]), len(self.solids) - 1)
        placed = solids.Placed(self.solids[kind], solids.axes_of([int(x) for x in state.q[:, slot]]))
        p = [int(x) for x in state.p[:, slot]]
        body = Body(placed, slot, place, p, still=bool(state.rest[slot]) or asleep, asleep=asleep)
        body.inertia = inertia_of(placed)
        radius = placed.solid.radius
        v, w, change = [0] * 3, [0] * 3, [0] * 3
        if not body.still:
            body.mobility = int(self.world.contact.mobility[kind])
            v, w = ([int(x) for x in rows[:, slot]] for rows in (state.v, state.w))
            for i in range(3):
                following = v[i] + self.gravity[i] + int(state.c[i, slot])
                following -= (following * self.damping + 2**15) >> 16
                change[i] = clamp(following, MOST_V) - v[i]
        body.old_v, body.old_w, body.change = v, w, change
        body.start = [clamp(x >> self.shift, MOST_START) for x in v]
        body.start_spin = [clamp((x * radius >> 22) >> self.shift, MOST_START) for x in w]
        body.fall = [clamp(x >> self.shift, MOST_FALL) for x in change]
        if placed.solid.kind == BOX:
            body.box = boxes.box_of(placed, self.pair_shift)
        body.way = min((sum(map(abs, v)) >> 6) + (sum(map(abs, w)) * radius >> 28), 2**21)
        body.begin()
        return body

    def add(self, a, b, wave, points):
        """Add those points at which two bodies touch in this frame, in one wave; return whether there are any."""
        before = len(self.found)
        if before + len(points) > CONTACTS_A_BODY * self.capacity:
            return False
        for n, gap, *arms in points:
            gap = clamp(gap, MOST_GAP)
            if gap + min(0, row_of(n, *arms).speed(a.motion(), b.motion())) < (self.reach << 6) >> self.shift:
                self.found.append((wave, a, b, gap, n, *arms, slip_of(a, b, n, *arms, self.bits)))
                a.contacts.append(b)
                b.contacts.append(a)
        return len(self.found) > before

    def in_units(self, a, b, points, at_b):
        """Points (n, gap, at) as points in the solver's unit, with arms."""
        return [([clamp((x + 2) >> 2, UNIT) for x in n], gap >> self.shift, a.arm(at), b.arm(minus(at, at_b))) for n, gap, at in points]

    def touch(self, a, b, d, margin):
        """The points of two bodies; d and margin in lattice units."""
        if a.box and b.box:
            shift = self.pair_shift
            points = boxes.touch(a.box, b.box, [boxes.rounded(x, shift) for x in d], boxes.rounded(margin, shift))
            return [(n, gap << (shift - self.shift), *arms) for n, gap, *arms in points]
        d = [x << 6 for x in d]
        return self.in_units(a, b, solids.touch(a.placed, b.placed, d, margin << 6), d)

    def find_pairs(self):
        """Find the contacts of bodies with each other."""
        for place_a, place_b in ordered_pairs(self.cells, self.first, self.held, self.side, int(self.held.sum())):
            a, b = self.bodies[place_a], self.bodies[place_b]
            margin = min(self.reach, 2**22) + sum(min(body.way, self.largest // 2) for body in (a, b))
            most = a.placed.solid.radius + b.placed.solid.radius + margin
            d = minus(b.p, a.p)
            if not a.mobility + b.mobility or solids.is_far(d, most) or dot(d, d) >= most * most:
                continue
            wave = first_free((a.used if a.mobility else 0) | (b.used if b.mobility else 0), 0)
            if wave < PAIR_WAVES and self.add(a, b, wave, self.touch(a, b, d, margin)):
                a.used |= 1 << wave
                b.used |= 1 << wave

    def find_walls(self):
        """Find those with the static geometry: corners of boxes, ends of round solids."""
        world = self.world.contact
        for measure, shapes in ((geometry.plane, world.planes), (geometry.box, world.boxes), (geometry.ball, world.balls)):
            for shape in shapes:
                for body in self.bodies:
                    if body.mobility:
                        self.find_wall(measure, shape, body)

    def find_wall(self, measure, shape, body):
        """Find the contacts of one body with one shape."""
        solid = body.placed.solid
        margin = self.wall + min(self.reach, 2**22) + body.way
        wave = first_free(body.used, PAIR_WAVES)
        if overlap(measure, shape, body.p, solid.radius + margin)[0] <= 0 or wave >= WAVES:
            return
        size, radius = solid.size, 0
        if solid.kind == BOX:
            corners = [[-s if k >> i & 1 else s for i, s in enumerate(size)] for k in range(8)]
        else:
            radius = size[0]
            corners = [[0, size[1], 0], [0, -size[1], 0]] if size[1] else [[0, 0, 0]]
        points = []
        for corner in corners:
            at = body.placed.world(corner)
            p = [clamp(x + (y >> 6), MOST_P) for x, y in zip(body.p, at)]
            most = clamp((radius >> 6) + margin, MOST_P)
            height, out = overlap(measure, shape, p, most)
            if height > 0:
                n = [clamp(x, 2**14) for x in out]
                gap = ((most - height - self.wall) << 6) - radius
                points.append((n, gap, [x - (y * radius >> 14) for x, y in zip(at, n)]))
        if self.add(body, self.geometry, wave, self.in_units(body, self.geometry, points, [0, 0, 0])):
            body.used |= 1 << wave

    def solve(self):
        """All sub-steps."""
        in_order = sorted(self.found, key=lambda one: one[0])
        contacts = [Contact(*one[1:]) for one in in_order]
        for k in range(1, 2**self.bits + 1):
            for body in self.bodies:
                body.begin_substep(k, self.bits)
            for one in contacts:
                one.want(self.bits, self.slop, self.near)
            for _ in range(FIRST_PASSES if k == 1 else LATER_PASSES):
                for one in contacts:
                    one.solve(self.friction)
            for body in self.bodies:
                body.moved, body.turned = plus(body.moved, body.v), plus(body.turned, body.spin)
        for one in contacts:
            push = one.push[0] + one.needed(one.rows[0], min(one.wanted, 0))
            impulse = clamp(max(0, min(push, MOST_WORD)) - one.push[0], MOST_CHANGE)
            if impulse:
                one.apply(one.rows[0], impulse)


def first_free(used, first):
    """The first bit from `first` on that is not set."""
    while used >> first & 1:
        first += 1
    return first


def overlap(measure, shape, p, radius):
    """`height` and `out` of Contact for one place."""
    at = np.array(p, np.int64).reshape(3, 1)
    height, out = measure(at, np.array([clamp(radius, MOST_P)]), shape)
    return int(height[0]), [int(x) for x in out[:, 0]]


def limited(w):
    """A spin that a state may hold."""
    return [int(x) for x in turn.limited(np.array(w, np.int64).reshape(3, 1))[:, 0]]


def is_slow(threshold, v, w, radius):
    """Whether a body hardly moves by this threshold (in 1/64 lattice unit)."""
    slow = all(abs(x) <= threshold // 10 for x in v)
    slow = slow and all(abs(6 * (x * radius >> 22)) <= threshold for x in w)
    return slow


def finish(frame, state, body, decay):
    """Return what a body becomes: p, v, q, w, and whether it is slow. c is written."""
    slot, radius, bits = body.slot, body.placed.solid.radius, frame.bits
    substeps = 2**bits
    per_unit = min(2 ** (30 + frame.shift) // radius, 2**36)
    p, v, w, way = [], [], [], []
    for i in range(3):
        fall, start = body.fall[i], body.start[i]
        fallen = substeps * start + sum((k * fall) >> bits for k in range(1, substeps + 1))
        pushed = (body.v[i] - start - fall) << frame.shift
        shifted = ((body.moved[i] - fallen) << frame.shift) >> bits
        v.append(clamp(body.old_v[i] + body.change[i] + pushed, MOST_V))
        moved = body.old_v[i] + (((substeps + 1) * body.change[i]) >> (bits + 1)) + shifted
        p.append(clamp(body.p[i] + ((moved + 32) >> 6), MOST_P))
        spun = body.spin[i] - body.start_spin[i]
        turned = (body.turned[i] - substeps * body.start_spin[i]) >> bits
        w.append(body.old_w[i] + (spun * per_unit >> 8))
        way.append(body.old_w[i] + (turned * per_unit >> 8))
        c = int(state.c[i, slot])
        state.c[i, slot] = clamp(c - ((c * decay + 2**15) >> 16), MOST_C)
    w = limited(w)
    q = turn.turned(state.q[:, slot : slot + 1], np.array(limited(way), np.int64).reshape(3, 1))[:, 0]
    return p, v, q, w, is_slow(frame.threshold, v, w, radius)


def step(state, world, values, gravity, gravity_before, damping):
    """Make one frame, with the turn. `values`: the parameters in force; bodies at rest are already awake or not."""
    gravity, before = ([int(x) for x in np.ravel(g)] for g in (gravity, gravity_before))
    frame = Frame(state, world, values, gravity, before, damping)
    frame.find_pairs()
    frame.find_walls()
    frame.solve()
    woken = 50 * max(abs(x - y) for x, y in zip(gravity, before)) > max(abs(x) for x in gravity)
    ends = {body.slot: finish(frame, state, body, values[4]) for body in frame.bodies if not body.still}
    for body in frame.bodies:
        if body.asleep:
            continue
        slow = [other.still or ends[other.slot][4] for other in (body, *body.contacts)]
        calm = not woken and not body.still and len(slow) > 1 and all(slow)
        slot = body.slot
        frames = min(int(state.own[0, slot]) + 1, CALM_FRAMES) if calm else 0
        state.own[0, slot] = frames
        if frames == CALM_FRAMES:
            state.v[:, slot] = state.w[:, slot] = 0
        elif not body.still:
            p, v, q, w, _ = ends[slot]
            state.p[:, slot], state.v[:, slot], state.q[:, slot], state.w[:, slot] = p, v, q, w
