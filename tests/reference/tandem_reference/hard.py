"""The predictor `hard`: bodies that do not give way, by impulses in four sub-steps."""

import numpy as np

from . import geometry, pairs
from .integers import clamp, root
from .state import MOST_C, MOST_P, MOST_V

SUBSTEPS = 4
ONE = 2**12
WHOLE = 2**15
MOST_WORD, MOST_START, MOST_FALL, MOST_OUT = 2**15 - 1, 24576, 8191, 2**9
PUSH_OUT = 26240
PAIR_WAVES, WAVES = 20, 26
CALM_FRAMES = 5


class Frame:
    """What holds for all bodies in one frame: radii, the solver's unit, the reach."""

    def __init__(self, world, values):
        self.threshold = values[1] * 64
        self.shift = max(0, self.threshold.bit_length() - 10)
        longer = world.radius + ((world.radius * values[9] + 2**15) >> 16)
        self.radius = np.clip(longer, 1, 2**25)
        self.largest = int(self.radius.max())
        self.reach = min(values[1], self.largest)
        self.wall, self.friction = values[10], min(8 * values[11], MOST_WORD)
        self.slop = (self.threshold >> self.shift) // 10
        self.grid_shift = world.shift


def places(frame, p, capacity):
    """Bodies ordered by cell and slot, the place of each cell's first body, and s; 16 of a cell take part."""
    s = 2
    while 2 ** (3 * s) < 2 * capacity:
        s += 1
    scale = 2**32 // (((2 * frame.largest + frame.reach) >> frame.grid_shift) + 1)
    x, y, z = ((p >> frame.grid_shift) * scale) >> 32
    cells = (x + (y << s) + (z << 2 * s)) & (2 ** (3 * s) - 1)
    order = np.argsort(cells, kind="stable")
    held = np.bincount(cells, minlength=2 ** (3 * s))
    rank = np.arange(len(cells)) - (np.cumsum(held) - held)[cells[order]]
    taking = order[rank < pairs.MOST_IN_CELL]
    others = np.sort(order[rank >= pairs.MOST_IN_CELL])
    held = np.minimum(held, pairs.MOST_IN_CELL)
    return np.concatenate([taking, others]), cells, np.cumsum(held) - held, held, s


def sleeping(state, alive, cells, s, same_gravity, moving, rousing):
    """Which bodies sleep through the frame: calm ones that are not `moving`, unless a `rousing` one is near."""
    still = state.rest[alive]
    calm = (state.own[0, alive] == CALM_FRAMES) & ~moving & ~still & same_gravity
    steps = (-1, 0, 1)
    offsets = np.array([x + (y << s) + (z << 2 * s) for z in steps for y in steps for x in steps])
    near = (cells[rousing & ~still & ~calm][:, None] + offsets) % 2 ** (3 * s)
    return calm & ~np.isin(cells, near)


def ordered_pairs(cells, first, held, s, taking):
    """Pairs of places in the order of the specification, whether near or not."""
    count = 2 ** (3 * s)
    rows = (1, 0), (-1, 1), (0, 1), (1, 1)
    offsets = [1] + [x + (y << s) + (z << 2 * s) for y, z in rows for x in (-1, 0, 1)]
    for place in range(taking):
        cell = cells[place]
        for other in range(place + 1, first[cell] + held[cell]):
            yield place, other
        for offset in offsets:
            near = (cell + offset) % count
            for other in range(first[near], first[near] + held[near]):
                yield place, other


def touches(frame, gap, u, n):
    """Whether bodies so far apart touch in this frame."""
    closing = min(0, int((u * n).sum()) >> 12)
    return gap * 64 + closing < frame.reach * 64


class Waves:
    """The contacts of a frame: (a, b, n, gap, shares) and their wave."""

    def __init__(self, frame, mobility):
        self.frame, self.mobility = frame, mobility
        self.used = [0] * len(mobility)
        self.found, self.waves = [], []

    def add(self, a, b, n, gap, shares, least, most):
        """Add a contact in the first wave in which neither of its bodies has one."""
        movable = [body for body in (a, b) if body < len(self.mobility) and self.mobility[body]]
        wave = least
        while any(self.used[body] >> wave & 1 for body in movable):
            wave += 1
        if wave < most and len(self.found) < 10 * self.capacity:
            for body in movable:
                self.used[body] |= 1 << wave
            gap = int(clamp(gap * 64 >> self.frame.shift, MOST_WORD))
            self.found.append((a, b, n, gap, shares))
            self.waves.append(wave)


def way(u):
    """The most by which bodies come nearer in a frame."""
    return int(np.abs(u).sum()) >> 6


def find_pairs(frame, p, v, radius, found, grid):
    """Add the contacts between bodies; all columns are by place."""
    cells, first, held, s = grid
    limit = (((2 * frame.largest + frame.reach) >> (frame.grid_shift + 5)) + 3) ** 2
    now, later = p >> (frame.grid_shift + 5), (p + (v >> 6)) >> (frame.grid_shift + 5)
    mobility = found.mobility
    for a, b in ordered_pairs(cells, first, held, s, int(held.sum())):
        gaps = [pairs.short_difference(place[:, a], place[:, b]) for place in (now, later)]
        if min(int((gap * gap).sum()) for gap in gaps) >= limit or mobility[a] + mobility[b] == 0:
            continue
        d, u, radii = p[:, a] - p[:, b], v[:, a] - v[:, b], int(radius[a] + radius[b])
        square = sum(int(x) ** 2 for x in d)
        if square >= (radii + frame.reach + way(u)) ** 2:
            continue
        far = int(root(np.array([square]))[0])
        n = (d * (2**40 // far) + 2**27) >> 28 if far else np.array([0, ONE, 0])
        if touches(frame, far - radii, u, n):
            both = int(mobility[a] + mobility[b])
            shares = [min(int(mobility[body]) * WHOLE // both, MOST_WORD) for body in (a, b)]
            found.add(a, b, n, far - radii, shares, 0, PAIR_WAVES)


def find_walls(frame, world, p, v, radius, found):
    """Add the contacts with the static geometry, shape by shape."""
    longer = radius + frame.wall
    most = clamp(longer + frame.reach + (np.abs(v).sum(axis=0) >> 6), MOST_P)
    for measure, shapes in ((geometry.plane, world.planes), (geometry.box, world.boxes), (geometry.ball, world.balls)):
        for shape in shapes:
            height, out = measure(p, most, shape)
            for a in np.flatnonzero((height > 0) & (found.mobility != 0)):
                n = clamp((out[:, a] + 2) >> 2, ONE)
                gap = int(most[a] - height[a] - longer[a])
                if touches(frame, gap, v[:, a], n):
                    found.add(int(a), p.shape[1], n, gap, (MOST_WORD, 0), PAIR_WAVES, WAVES)


def word(x):
    """Clamp to 16 bits, as every sum of the sub-steps is."""
    return np.clip(x, -(2**15), 2**15 - 1)


def product(x, y):
    """Multiply by a share of 2^15."""
    return (x * y + 2**14) >> 15


def summed(one, two, three):
    """Add three terms from left to right."""
    return word(word(one + two) + three)


class Wave:
    """The contacts of one wave, as arrays."""

    def __init__(self, contacts):
        self.a = np.array([contact[0] for contact in contacts])
        self.b = np.array([contact[1] for contact in contacts])
        self.gap = np.array([contact[3] for contact in contacts], np.int64)
        self.share_a, self.share_b = np.array([contact[4] for contact in contacts], np.int64).T
        x, y, z = n = np.array([contact[2] for contact in contacts], np.int64).T
        sign = np.where(z < 0, -1, 1)
        inverse = 2**24 // (ONE + sign * z)
        xi, yi = (x * inverse + 2048) >> 12, (y * inverse + 2048) >> 12
        xy = (xi * y + 2048) >> 12
        t1 = np.stack([ONE - ((x * xi + 2048) >> 12), -sign * xy, -x])
        t2 = np.stack([-sign * xy, ONE - ((y * yi + 2048) >> 12), -y])
        self.n, self.t1, self.t2 = (clamp(8 * axis, MOST_WORD) for axis in (n, t1, t2))
        self.push = np.zeros_like(self.gap)
        self.slide = [self.push, self.push]
        self.wanted = self.push

    def along(self, axis, rows):
        """The part of a difference of two rows, a's minus b's, along an axis."""
        u = word(rows[:, self.a] - rows[:, self.b])
        last = product(u[2], axis[2]) if axis is self.n else -product(u[2], -axis[2])
        return summed(product(u[0], axis[0]), product(u[1], axis[1]), last)

    def apply(self, w, push, slide1, slide2):
        """Change both bodies' velocities."""
        n, t1, t2 = self.n, self.t1, self.t2
        z = summed(product(push, n[2]), -product(slide1, n[0]), -product(slide2, n[1]))
        xy = [summed(product(push, n[i]), product(slide1, t1[i]), product(slide2, t2[i])) for i in (0, 1)]
        whole = np.stack([*xy, z])
        w[:, self.a] = word(w[:, self.a] + product(whole, self.share_a))
        w[:, self.b] = word(w[:, self.b] - product(whole, self.share_b))

    def want(self, frame, way):
        """Set the speed at which the bodies are to leave each other at least."""
        gap = word(self.gap + self.along(self.n, way))
        out = np.minimum(product(word(-gap), PUSH_OUT), MOST_OUT)
        left = word(SUBSTEPS * np.minimum(word(frame.slop - gap), 0))
        self.wanted = word(np.maximum(out, 0) + left)

    def solve(self, frame, w):
        """One pass over the wave."""
        push = np.maximum(word(word(self.push + self.wanted) - self.along(self.n, w)), 0)
        most = product(push, frame.friction)
        slide = [clamp(word(old - self.along(axis, w)), most) for old, axis in zip(self.slide, (self.t1, self.t2))]
        self.apply(w, word(push - self.push), word(slide[0] - self.slide[0]), word(slide[1] - self.slide[1]))
        self.push, self.slide = push, slide

    def relax(self, w):
        """Take back what pushing out has left."""
        wanted = np.minimum(self.wanted, 0)
        push = np.maximum(word(word(self.push + wanted) - self.along(self.n, w)), 0)
        self.apply(w, word(push - self.push), 0, 0)


def solve(frame, found, w, fall):
    """All sub-steps; w and the way moved, both with a column for the geometry behind the bodies."""
    held = sorted(set(found.waves))
    waves = [Wave([one for one, wave in zip(found.found, found.waves) if wave == which]) for which in held]
    moved, base = np.zeros_like(w), w
    for substep in range(1, SUBSTEPS + 1):
        fallen = w.copy()
        fallen[:, :-1] = word(w[:, :-1] + ((substep * fall) >> 2) - (((substep - 1) * fall) >> 2))
        w = word(fallen + word(w - base)) if substep > 1 else fallen.copy()
        base = fallen
        for number in range(3 if substep == 1 else 2):
            for wave in waves:
                if number == 0:
                    wave.want(frame, moved >> 2)
                wave.solve(frame, w)
        moved += w
    for wave in waves:
        wave.relax(w)
    return w, moved


def calm(frame, found, slow):
    """Which bodies touch two at least, all of them slow, and are slow; the geometry is slow."""
    slow = np.append(slow, True)
    touched = np.zeros(len(slow), np.int64)
    restless = np.zeros(len(slow), bool)
    for a, b, *_ in found.found:
        for one, other in ((a, b), (b, a)):
            touched[one] += 1
            restless[one] |= not slow[other]
    return (slow & (touched >= 2) & ~restless)[:-1]


def step(state, world, values, gravity, gravity_before, damping):
    """Make one frame. `values`: the parameters in force; bodies at rest are already awake or not."""
    frame = Frame(world, values)
    alive = np.flatnonzero(state.alive)
    order, cells, first, held, s = places(frame, state.p[:, alive], state.capacity)
    slots = alive[order]
    moving, anybody = state.v[:, alive].any(axis=0), np.full(len(alive), True)
    asleep = sleeping(state, alive, cells, s, np.array_equal(gravity[:, 0], gravity_before), moving, anybody)[order]
    p, c, still = state.p[:, slots], state.c[:, slots], state.rest[slots] | asleep
    v = np.where(still, 0, state.v[:, slots])
    kind = np.minimum(state.type[slots], len(world.radius) - 1)
    radius, mobility = frame.radius[kind], np.where(still, 0, world.mobility[kind])
    changed = v + gravity + c
    changed -= (changed * damping + 2**15) >> 16
    change = np.where(still, 0, clamp(changed, MOST_V) - v)

    found = Waves(frame, mobility)
    found.capacity = state.capacity
    find_pairs(frame, p, v, radius, found, (cells[order], first, held, s))
    find_walls(frame, world, p, v, radius, found)
    start = clamp(v >> frame.shift, MOST_START)
    fall = clamp(change >> frame.shift, MOST_FALL)
    w = np.hstack([start, np.zeros((3, 1), np.int64)])
    w, moved = solve(frame, found, w, fall)

    fallen = 4 * start + sum((k * fall) >> 2 for k in range(1, 5))
    pushed = (w[:, :-1] - start - fall) << frame.shift
    shifted = ((moved[:, :-1] - fallen) << frame.shift) >> 2
    new_v = clamp(v + change + pushed, MOST_V)
    new_p = clamp(p + ((v + ((5 * change) >> 3) + shifted + 32) >> 6), MOST_P)
    new_c = clamp(c - ((c * values[4] + 2**15) >> 16), MOST_C)

    slow = still | np.all(np.abs(new_v) <= frame.threshold // 10, axis=0)
    turned, most = np.abs(gravity[:, 0] - gravity_before).max(), np.abs(gravity).max()
    quiet = calm(frame, found, slow) & ~still & (50 * turned <= most)
    frames = np.where(quiet, np.minimum(state.own[0, slots] + 1, CALM_FRAMES), 0)
    frames = np.where(asleep, CALM_FRAMES, frames)
    sleeps = frames == CALM_FRAMES
    state.own[0, slots] = frames
    state.p[:, slots] = np.where(still | sleeps, p, new_p)
    state.v[:, slots] = np.where(still, state.v[:, slots], np.where(sleeps, 0, new_v))
    state.c[:, slots] = np.where(still, c, new_c)
