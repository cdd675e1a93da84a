"""The vectors of the predictor `rigid`."""

import math

import numpy as np
import worlds
import writer
from tandem_reference import turn
from tandem_reference.predict import Drive
from tandem_reference.tracker import Correction
from vector_text import Vector

# Two sub-steps, three types: a cube, a light board, a box that nothing moves. A floor and a tilted wall.
HEAP = [2, 0, 0, 0, 0, 0, 0, 3, 2, 0, 0, 1, 65536, 1, 262144, 1, 0,
        0, 2**30, 0, 0, -644245094, 858993459, 0, -100000,
        1, 20000, 20000, 20000, 1, 20000, 5000, 10000, 1, 8000, 9000, 10000]  # fmt: skip


def vectors():
    """All of them by name."""
    return {
        "rigid": falling(),
        "rigid_heap": heap(),
        "rigid_asleep": asleep(),
        "rigid_edges": edges(),
        "rigid_fast": fast(),
        "rigid_pairs": pairs(),
        "tracker_rigid": tracker(),
    }


def line_of(codec, capacity, types, places, drive, **more):
    """A timeline of `rigid`."""
    return worlds.timeline(worlds.stream(codec, "rigid", capacity, types, turns=True, **more), places, drive)


def turn_all(state, seed, spins=True):
    """Give all bodies some orientation and some spin."""
    following = worlds.random_numbers(seed)
    for slot in state.alive.nonzero()[0]:
        state.q[:, slot] = worlds.some_quaternion(following)
        if spins:
            state.w[:, slot] = [x >> 4 for x in worlds.some_spin(following)]


def falling():
    """Bodies of all kinds among a plane, a box and a ball."""
    following = worlds.random_numbers(41)
    places = {}
    for slot in range(24):
        near = 200000 * (slot % 3 - 1)
        at = near + following(40000), following(30000) + 60000 + 20000 * (near != 0) * 2, following(40000)
        places[slot] = at, tuple(following(90000) for _ in range(3))
    line = line_of("none", 24, 5, places, worlds.FALL)
    line.world.state.type[:24] = [slot * 7 % 5 for slot in range(24)]
    turn_all(line.world.state, 42)
    vector = Vector("rigid: 24 boxes, balls, capsules and boards, a plane, a box, a ball; 14 steps", line)
    vector.predict(14)
    return vector


def piled():
    """Twelve bodies on each other, in the order of their faces."""
    return {
        i: ((40500 * (i % 3) + 300 * (i // 3), 19900 + 40100 * (i // 3), 20000 * (i % 2)), (0, -500 * i, 0))
        for i in range(12)
    }


def heap():
    """Bodies of different masses come to rest and sleep; gravity wakes them."""
    places = piled()
    places[12] = (200000, 30000, 0), (64, 0, 0)
    places[13] = (-200000, 20050, 0), (0, 0, 0)
    line = line_of("none", 16, 3, places, Drive((0, -30000, 0), 200), constants=HEAP)
    state = line.world.state
    state.type[:13] = [0, 1, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 2]
    state.rest[2] = 1
    state.c[1, 2] = 30000
    vector = Vector("rigid: a heap of three types; slot 2 is at rest; bodies fall asleep and are woken", line)
    vector.predict(24)
    assert state.own[0, 13] == 5, "a body asleep"
    vector.say("less than a fiftieth of gravity: those asleep stay so")
    vector.input(1, line.frame + 1, Drive((300, -30300, 0), 200))
    vector.predict(3)
    vector.say("more wakes them")
    vector.input(2, line.frame + 1, Drive((3000, -30000, 0), 200))
    vector.predict(4)
    return vector


def asleep():
    """Two rows of bodies and two bodies alone fall asleep; corrections rouse some, and who they hit."""
    places = {i: ((41000 * (i % 12) - 400000, 20000, 41000 * (i // 12)), (0, 0, 0)) for i in range(24)}
    places |= {i: ((100000 * i - 2800000, 20000, 300000), (0, 0, 0)) for i in (24, 25)}
    of = worlds.stream("tracker", "rigid", 300, 3, turns=True, constants=HEAP)
    of.radii = [34642, 22913, 15653]
    line = worlds.timeline(of, places, Drive((0, -30000, 0), 200))
    state = line.world.state
    state.rest[[10, 14]] = 1
    state.c[1, [10, 14]] = 30000
    vector = Vector("rigid: two rows asleep, 10 and 14 of them at rest; some are pushed or turned; gravity changes", line)
    vector.predict(8)
    assert (state.own[0, :24] == 5).sum() > 16
    turned = Correction(0, None, [0, 3, 0])
    for steps, frames in ({15: [0, 1, 0], 24: [3, 0, 0]}, 8), ({22: turned, 25: turned}, 2), ({1: [40, 0, 0]}, 4):
        vector.track(steps)
        vector.predict(frames)
    vector.input(1, line.frame + 1, Drive((0, -30001, 0), 200))
    vector.predict(3)
    return vector


def edges():
    """All bodies in one place, beyond the limits of speed, and a cell that is too full."""
    parameters = {**worlds.HARD_PARAMETERS, 1: 50000}
    places = {i: ((500000 + i % 5, 400000, i % 3), (0, 0, 0)) for i in range(50)}
    for i in range(50, 56):
        places[i] = (-(2**30) + 60000 * i, 300000, 2**30 - 5), ((-1) ** i * 2**28, -(2**27), 2**26)
    places[56] = (30000, -50000, 0), (0, -(2**20), 0)
    constants = [1, *worlds.RIGID[1:]]
    line = line_of("none", 64, 5, places, Drive((0, 0, 0), 0), parameters=parameters, constants=constants)
    state = line.world.state
    state.type[:57] = [slot * 3 % 5 for slot in range(57)]
    state.w[0, 3], state.w[2, 51] = 2**29, -(2**29)
    vector = Vector("rigid: 50 bodies in one place, bodies at the limits, a body behind the floor; no gravity", line)
    vector.predict(1)
    return vector


def fast():
    """Impulses and friction at their limits: bodies that hit the floor faster than one impulse can stop."""
    parameters = {**worlds.HARD_PARAMETERS, 11: 4096}
    places = {i: ((90000 * i - 100000, 60000, 150000), (2**23, -(2**23), 2**22)) for i in range(5)}
    line = line_of("none", 8, 5, places, Drive((0, 0, 0), 0), parameters=parameters)
    line.world.state.type[:5] = range(5)
    turn_all(line.world.state, 44)
    vector = Vector("rigid: one body of each kind hits the floor at a high speed, with much friction", line)
    vector.predict(3)
    return vector


def pairs():
    """Pairs that overlap a little in any position: capsules, boxes, boards, boxes that are almost parallel."""
    following = worlds.random_numbers(43)
    places, kinds = {}, {}
    for slot in range(0, 96, 2):
        kind, far = ((2, 24000), (0, 33000), (4, 20000), (0, 30000))[slot // 2 % 4]
        middle = [200000 * (slot // 2 % 4) - 300000, 200000 * (slot // 8 % 4) + 100000, 200000 * (slot // 32) - 200000]
        way = [following(1000) for _ in range(3)]
        length = math.sqrt(sum(x * x for x in way))
        places[slot] = middle, (0, 0, 0)
        places[slot + 1] = [x + round(far * y / length) for x, y in zip(middle, way)], (0, 0, 0)
        kinds[slot] = kinds[slot + 1] = kind
    line = line_of("none", 96, 5, places, Drive((0, 0, 0), 0))
    state = line.world.state
    for slot, kind in kinds.items():
        state.type[slot] = kind
        state.q[:, slot] = worlds.some_quaternion(following)
        if slot % 8 == 7:  # almost as the one before it
            tilt = [[x << 16] for x in (following(400), following(400), following(400))]
            state.q[:, slot] = turn.turned(state.q[:, slot - 1 : slot], np.array(tilt))[:, 0]
    vector = Vector("rigid: 48 pairs, some of boxes that are almost parallel; no gravity", line)
    vector.predict(2)
    return vector


def tracker():
    """With `tracker`: learned parameters, lifecycle, a snapshot."""
    places = {slot: place for slot, place in piled().items() if slot < 6}
    line = line_of("tracker", 8, 3, places, Drive((0, -30000, 0), 200), constants=HEAP)
    vector = Vector("rigid with tracker: parameters that change, a teleport of a body asleep, a snapshot", line)
    vector.predict(16)
    vector.delta(writer.section(0x82, writer.parameters({1: 3000, 9: 500, 10: -50, 11: 512, 12: 9000})))
    vector.predict(2)
    state = line.world.state
    asleep = [slot for slot in range(6) if state.own[0, slot] == 5]
    assert asleep, "a body asleep"
    vector.delta(worlds.teleported({asleep[0]: ([int(x) for x in state.p[:, asleep[0]]], (0, 0, 0))}))
    vector.snapshot(writer.snapshot(line))
    vector.predict(3)
    return vector
