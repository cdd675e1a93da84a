"""The vectors of the predictor `hard`."""

import writer
import worlds
from tandem_reference.predict import Drive
from vector_text import Vector

# Three types: the second is light, the third (small) is moved by nothing. A floor and a tilted wall.
HEAP = [1, 0, 0, 0, 0, 0, 0, 3, 2, 0, 0, 20000, 65536, 20000, 262144, 15000, 0,
        0, 2**30, 0, 0, -644245094, 858993459, 0, -100000]  # fmt: skip


def vectors():
    """All of them by name."""
    return {"hard": falling(), "hard_heap": heap(), "hard_asleep": asleep(), "hard_edges": edges(), "tracker_hard": tracker()}


def falling():
    """200 bodies among a plane, a box and a ball."""
    line = worlds.timeline(worlds.stream("none", "hard", 200))
    line.world.state = worlds.two_hundred_bodies(predictor="hard")
    vector = Vector("hard: 200 bodies of two types, a plane, a box, a ball; 40 steps", line)
    vector.predict(40)
    return vector


def piled():
    """Twelve bodies on each other."""
    return {
        i: ((40500 * (i % 3) + 300 * (i // 3), 19900 + 40100 * (i // 3), 20000 * (i % 2)), (0, -500 * i, 0))
        for i in range(12)
    }


def heap():
    """Bodies of different masses come to rest and sleep; gravity wakes them."""
    of = worlds.stream("none", "hard", 16, 3, constants=HEAP)
    places = piled()
    places[12] = (200000, 30000, 0), (64, 0, 0)
    line = worlds.timeline(of, places, Drive((0, -30000, 0), 200))
    line.world.state.type[:13] = [0, 1, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 2]
    line.world.state.rest[2] = 1
    line.world.state.c[1, 2] = 30000
    vector = Vector("hard: a heap of three types; slot 2 is at rest; bodies fall asleep and are woken", line)
    vector.predict(45)
    vector.say("less than a fiftieth of gravity: those asleep stay so")
    vector.input(1, line.frame + 1, Drive((300, -30300, 0), 200))
    vector.predict(3)
    vector.say("more wakes them")
    vector.input(2, line.frame + 1, Drive((3000, -30000, 0), 200))
    vector.predict(5)
    return vector


def asleep():
    """Two rows of bodies fall asleep; corrections rouse some, and who they hit."""
    of = worlds.stream("tracker", "hard", 200, 3, constants=HEAP)
    places = {i: ((40600 * (i % 12) - 400000, 20500, 20300 + 40600 * (i // 12)), (0, 0, 0)) for i in range(24)}
    line = worlds.timeline(of, places, Drive((0, -30000, 0), 200))
    state = line.world.state
    state.rest[[10, 14]] = 1
    state.c[1, [10, 14]] = 30000
    vector = Vector("hard: two rows asleep, 10 and 14 of them at rest; some are pushed; gravity changes", line)
    vector.predict(8)
    assert (state.own[0, :24] == 5).sum() > 16
    for steps, frames in ({15: [0, 1, 0]}, 14), ({1: [40, 0, 0]}, 4), ({20: [0, 9, 0]}, 3):
        vector.track(steps)
        vector.predict(frames)
    vector.input(1, line.frame + 1, Drive((0, -30001, 0), 200))
    vector.predict(3)
    return vector


def edges():
    """More bodies in one place than a cell holds, more contacts than waves, bodies beyond the limits."""
    of = worlds.stream("none", "hard", 64, 3, parameters={**worlds.HARD_PARAMETERS, 1: 50000}, constants=HEAP)
    places = {i: ((460000 + i // 18 * 40000 + i % 5, 400000, i % 3), (0, 0, 0)) for i in range(24)}
    for i in range(24, 30):
        places[i] = (-(2**30) + 60000 * i, 300000, 2**30 - 5), ((-1) ** i * 2**28, -(2**27), 2**26)
    places[30] = (30000, -50000, 0), (0, -(2**20), 0)
    line = worlds.timeline(of, places, Drive((0, 0, 0), 0))
    vector = Vector("hard: 24 bodies in two places, bodies at the limits, a body behind the floor; no gravity", line)
    vector.predict(4)
    return vector


def tracker():
    """With `tracker`: learned parameters, lifecycle, a snapshot."""
    of = worlds.stream("tracker", "hard", 16, 3, constants=HEAP)
    line = worlds.timeline(of, piled(), Drive((0, -30000, 0), 200))
    vector = Vector("hard with tracker: parameters that change, a teleport of a body asleep, a snapshot", line)
    vector.predict(34)
    vector.delta(writer.section(0x82, writer.parameters({1: 3000, 9: 500, 10: -50, 11: 512})))
    vector.predict(6)
    state = line.world.state
    assert state.own[0, 4] == 5, "a body asleep"
    vector.delta(worlds.teleported({4: ([int(x) for x in state.p[:, 4]], (0, 0, 0))}))
    vector.snapshot(writer.snapshot(line))
    vector.predict(3)
    return vector
