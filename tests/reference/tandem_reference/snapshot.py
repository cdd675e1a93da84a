"""A snapshot: all that a joiner needs to start after the delta of its frame."""

import math
from dataclasses import dataclass

import numpy as np

from . import parameters, tracker, turn
from .data import ALL_DATA, start_data
from .errors import require
from .range_decoder import Model, NumberDecoder, NumberModels
from .payload import PARAMETERS, World, sections, start_models
from .predict import Drive
from .reader import Reader
from .state import MOST_C, MOST_P, MOST_V, WORLD, State, read_world
from .tracker import GROUP
from .xxh3 import text

INPUTS, BODIES = 0x84, 0x85
MOST_GRAVITY = 2**28
MOST_INPUTS = 256
ZERO, BEFORE, HALF, REST = range(4)


@dataclass
class Snapshot:
    """A snapshot, decoded and checked."""

    epoch: int
    stream: int
    generation: int
    frame: int
    last_input: int
    drive: Drive
    hash: int
    world: World
    inputs: dict  # number: (frame, Drive)


def check_drive(gravity, damping, rule):
    """A drive, refused where it is out of range."""
    require(all(abs(axis) <= MOST_GRAVITY for axis in gravity), rule, f"a gravity of {gravity}")
    require(0 <= damping <= 65535, rule, f"a damping of {damping}")
    return Drive(tuple(gravity), damping)


def read_drive(reader):
    """Gravity and damping, 14 bytes."""
    gravity = [reader.i32() for _ in range(3)]
    return check_drive(gravity, reader.u16(), "snapshot")


def read_inputs(body, frame, last_input):
    """The scheduled inputs still to act."""
    require(0 < body.left() <= 30 * MOST_INPUTS, "snapshot", "no scheduled inputs, or too many")
    inputs, before = {}, 0
    while body.left():
        number, acts_on = body.u64(), body.u64()
        require(before < number <= last_input, "snapshot", f"scheduled input {number} out of order")
        require(acts_on > frame, "snapshot", f"scheduled input {number} does not act beyond the snapshot")
        inputs[number] = acts_on, read_drive(body)
        before = number
    return inputs


class Guess:
    """The guess of a column's next number: 0, the number before, or half way to it; by whether bodies are at rest."""

    def __init__(self, how):
        self.how = how
        self.values = [0, 0]  # of bodies not at rest, and at rest

    def saw(self, rest, x):
        """Learn the number of a body."""
        if self.how == BEFORE or (self.how != ZERO and rest):
            self.values[rest] = x
        elif self.how == HALF:
            self.values[rest] = (self.values[rest] + x) >> 1


def read_column(numbers, guess, at_rest, most):
    """Read a column over bodies, of which some are at rest. `most`: minimum and maximum allowed."""
    shift = numbers.even_bits(5)
    kinds = [NumberModels(), NumberModels()]
    values = []
    for rest in at_rest:
        x = guess.values[rest] + numbers.number(kinds[rest])
        guess.saw(rest, x)
        value = x << shift
        require(most[0] <= value <= most[1], "snapshot", f"a value of {value}")
        values.append(value)
    return values


def read_norm(numbers, at_rest, others, most):
    """Read the column qw. The guess gives a length of 1 with qx, qy and qz (`others`)."""
    shift = numbers.even_bits(5)
    kinds = [NumberModels(), NumberModels()]
    values = []
    for rest, vector in zip(at_rest, others.T.tolist()):
        guess = math.isqrt(max(0, 2**60 - sum(x * x for x in vector))) >> shift
        value = (guess + numbers.number(kinds[rest])) << shift
        require(-most <= value <= most, "snapshot", f"a value of {value}")
        values.append(value)
    return values


def read_same(numbers, at_rest):
    """Read a column of bytes in which 0 and the value of the body before change places."""
    shift = numbers.even_bits(5)
    kinds, before = [NumberModels(), NumberModels()], [0, 0]
    values = []
    for rest in at_rest:
        x = numbers.number(kinds[rest])
        x = {0: before[rest], before[rest]: 0}.get(x, x)
        before[rest] = x
        require(-128 <= x << shift <= 127, "snapshot", f"a value of {x << shift}")
        values.append(x << shift)
    return values


def read_bodies(body, stream):
    """The state and the codec's models."""
    announced = body.u64()
    numbers = NumberDecoder(body.rest())
    state = State(stream.capacity, stream.codec, stream.orientation, stream.predictor)
    living, before = [Model(), Model()], 0
    for slot in range(stream.capacity):
        before = int(numbers.decide(living[before]))
        state.alive[slot] = before
    slots = np.flatnonzero(state.alive)
    at_rest = [0] * len(slots)

    def column(how, least, most):
        return read_column(numbers, Guess(how), at_rest, (least, most))

    at_rest = column(ZERO, 0, 1)
    state.rest[slots] = at_rest
    state.reuse[slots] = column(ZERO, 0, 255)
    state.type[slots] = column(ZERO, 0, stream.types - 1)
    for rows, how, most in ((state.p, BEFORE, MOST_P), (state.v, HALF, MOST_V), (state.c, HALF, MOST_C)):
        for axis in range(3):
            rows[axis, slots] = column(how, -most, most)
    if stream.orientation:
        for axis in range(3):
            state.q[axis, slots] = column(REST, -turn.ONE, turn.ONE)
        state.q[3, slots] = read_norm(numbers, at_rest, state.q[:3, slots], turn.ONE)
        for axis in range(3):
            state.w[axis, slots] = column(ZERO, -turn.MOST_W, turn.MOST_W)
    state.check_ranges(stream.types, "snapshot")
    for i, row in enumerate(state.codec):
        if i % tracker.GROUP in (tracker.AGE, tracker.INTERVAL):
            row[slots] = np.array(read_same(numbers, at_rest), np.int64) % 256
            require(i % tracker.GROUP == tracker.INTERVAL or not np.any(row > 254), "snapshot", "an age of 255")
        else:
            row[slots] = column(ZERO, -128, 127)
            require(not np.any(row < -127), "snapshot", "a last step of -128")
    for row in state.own:
        row[slots] = column(BEFORE, 0, 255)
    models = start_models(stream)
    if models:
        models.read(numbers)
    numbers.end()
    computed = state.leaves_hash()
    require(computed == announced, "hash", f"snapshot: hash of all leaves {text(announced)}, computed {text(computed)}")
    return state, models


def read(data, stream):
    """A snapshot from its bytes."""
    reader = Reader(data, "snapshot")
    require(reader.take(4) == b"TDSP", "snapshot", "its first four bytes are others")
    version = reader.u8()
    require(version == 3, "snapshot", f"version {version}")
    epoch, stream_id, generation = reader.u64(), reader.u32(), reader.u32()
    frame, last_input = reader.u64(), reader.u64()
    require(frame <= 2**62, "snapshot", f"frame {frame}")
    drive, announced, capacity = read_drive(reader), reader.u64(), reader.u32()
    require(capacity == stream.capacity, "snapshot", f"capacity {capacity} instead of {stream.capacity}")

    known = {PARAMETERS: "parameters", INPUTS: "inputs", BODIES: "bodies"}
    known |= {WORLD: "world"} if stream.features else {}
    known |= {ALL_DATA: "data"} if stream.data else {}
    values, inputs, loaded, news, data, before = None, {}, None, None, None, 0
    for kind, body in sections(reader, known):
        require(kind > before, "order", f"snapshot: section 0x{kind:02x} behind 0x{before:02x}")
        before = kind
        if kind == PARAMETERS:
            values = parameters.complete(list(parameters.read(body, stream.parameters).items()), stream.parameters)
        elif kind == INPUTS:
            inputs = read_inputs(body, frame, last_input)
        elif kind == WORLD:
            news = read_world(body, stream.features)
        elif kind == ALL_DATA:
            require(loaded is not None, "snapshot", "data before the bodies")
            data = start_data(stream)
            data.read_all(body, loaded[0].alive)
        else:
            loaded = read_bodies(body, stream)
    require(values is not None and loaded is not None, "snapshot", "a section that every snapshot has is missing")
    require((news is not None) == bool(stream.features), "snapshot", "its world is missing")
    require((data is not None) == bool(stream.data), "snapshot", "its data are missing")
    state, models = loaded
    world = World(state, values, models, news, data)
    require(world.hash() == announced, "hash", f"snapshot: state hash {text(announced)}, computed {text(world.hash())}")
    return Snapshot(
        epoch, stream_id, generation, frame, last_input, drive, announced, world, inputs
    )
