"""Streams and states that several tests share."""

import math

import numpy as np
import writer

from tandem_reference import parameters as reference_parameters
from tandem_reference import payload
from tandem_reference.data import start_data
from tandem_reference.predict import Drive
from tandem_reference.state import State, start_news
from tandem_reference.stream import Stream
from tandem_reference.timeline import Timeline

PARAMETERS = {1: 100, 2: 3, 3: 5, 4: 800, 5: 26214, 6: 9830}
# Further parameters, for the thesis's codecs with residuals where bodies turn.
TURN_PARAMETERS = {7: 2**20, 8: 3 * 2**14}
ONE = 2**30
# Two sub-steps, two types, a plane, a box and a ball.
CONTACT = [
    2, 1820, 205, 205, 1820, 205, 205, 2, 1, 1, 1, 20000, 65536, 10000, 131072, 0, ONE, 0, 0,
    200000, 0, 0, 50000, 50000, 50000, ONE, 0, 0, 0, ONE, 0, 0, 0, ONE, -200000, 0, 0, 60000,
]  # fmt: skip
# The same with one sub-step a frame.
FIELD = [1, 3640, 102, 410, 3640, 102, 410, *CONTACT[7:]]
# The same for `hard`, whose solver ignores the forces. Its parameters: radii 1.5 % longer, walls 200 units nearer; `rigid` has round edges.
HARD = [1, 0, 0, 0, 0, 0, 0, *CONTACT[7:]]
HARD_PARAMETERS = {1: 2000, 2: 3, 3: 5, 4: 800, 5: 26214, 6: 9830, 9: 983, 10: 200, 11: 1000, 12: 4000}
# `rigid`: four sub-steps, a box, a ball, a capsule, a thin board that is heavy, among the shapes of CONTACT.
RIGID = [4, *HARD[1:7], 4, 1, 1, 1, 1, 65536, 1, 131072, 1, 65536, 1, 20000, *CONTACT[15:],
         1, 12000, 20000, 15000, 0, 14000, 0, 0, 0, 9000, 12000, 0, 1, 30000, 2500, 16000]  # fmt: skip
FALL = Drive((0, -3000, 0), 200)


def stream(
    codec="none", predictor="ballistic", capacity=8, types=2, parameters=None, tables=b"", turns=False, constants=(),
    features=(), data=(),
):
    """A small stream; with orientations where it `turns`. Predictors that read the world have constants of their own without others."""
    usual = {"contact": CONTACT, "field": FIELD, "hard": HARD, "rigid": RIGID}.get(predictor, [])
    constants = list(constants or usual)
    groups = ["position", "orientation"] if turns else ["position"]
    groups += ["data"] if data else []
    radii = [500 + kind for kind in range(types)] if turns else []
    values = dict(parameters or (HARD_PARAMETERS if predictor in ("hard", "rigid") else PARAMETERS))
    if turns and codec in reference_parameters.STEPPING:
        values |= TURN_PARAMETERS
    return Stream(
        capacity, types, codec, predictor, values, tables, constants, groups, radii, features=list(features), data=list(data)
    )


def world(of, bodies=()):
    """A world of bodies {slot: (p, v)}, not turned."""
    state = State(of.capacity, of.codec, of.orientation, of.predictor)
    for slot, (p, v) in dict(bodies).items():
        state.alive[slot] = 1
        state.p[:, slot], state.v[:, slot] = p, v
        if of.orientation:
            state.q[3, slot] = ONE
    return payload.World(state, dict(of.parameters), payload.start_models(of), start_news(of.features), start_data(of))


def timeline(of, bodies=(), drive=FALL, frame=0):
    """A timeline that starts with such a world."""
    return Timeline(of, world(of, bodies), frame, drive)


def random_numbers(seed=1):
    """A function next(limit): whole numbers from -limit up to limit - 1."""
    x = seed

    def following(limit):
        nonlocal x
        x = (1664525 * x + 1013904223) % 2**32
        return (x >> 8) % (2 * limit) - limit

    return following


def some_quaternion(following):
    """A quaternion; any as likely as any other of a cube."""
    numbers = [following(1000) + 0.5 for _ in range(4)]
    length = math.sqrt(sum(number * number for number in numbers))
    return [round(number / length * ONE) for number in numbers]


def some_spin(following):
    """An angular velocity of any order of magnitude, up to one near the limit."""
    w = [following(300000000) for _ in range(3)]
    small = abs(following(28))
    return [axis >> small for axis in w]


def teleported(places):
    """A lifecycle section that teleports bodies {slot: (p, v)}, slots ascending."""
    records, before = b"", 0
    for slot, (p, v) in places.items():
        records += writer.record(slot - before, 2, b"\1", writer.position(p, v))
        before = slot
    return writer.section(0x81, records)


def two_hundred_bodies(codec="none", predictor=""):
    """200 bodies of two types that fall among the shapes of CONTACT."""
    state = State(200, codec, predictor=predictor)
    following = random_numbers()
    state.alive[:] = 1
    state.type = np.arange(200) % 2
    for slot in range(200):
        state.p[:, slot] = following(160000), following(60000) + 80000, following(80000)
        state.v[:, slot] = [following(99999) for _ in range(3)]
    return state


def huffman_lengths():
    """A complete code: 1 bit for 0, 3 for 1 and -1, 9 for 2, -2 and 3, 10 for the other 250."""
    lengths = [10] * 256
    lengths[0] = 1
    lengths[1] = lengths[-1] = 3
    lengths[2] = lengths[-2] = lengths[3] = 9
    return bytes(lengths)
