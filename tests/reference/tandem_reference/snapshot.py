"""A snapshot: all that a joiner needs to start after the delta of its frame."""

from dataclasses import dataclass

import numpy as np

from . import parameters
from .codecs import bits_of
from .errors import require
from .payload import PARAMETERS, World, sections, start_models
from .predict import Drive
from .reader import Reader
from .state import State
from .xxh3 import text

INPUTS, REGION = 0x84, 0x85
MOST_GRAVITY = 2**28
MOST_INPUTS = 256


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


def read_run(body, size, signed, count):
    """Up to 64 values of a column of `size` bytes a value."""
    width = body.u8()
    require(width <= 32, "snapshot", f"a run of {width} bits a value")
    least = body.signed(size) if signed else body.unsigned(size)
    bits = np.unpackbits(np.frombuffer(body.take(-(-width * count // 8)), np.uint8))
    require(not bits[width * count :].any(), "padding", "snapshot: unused bits of a run that are not zero")
    values = bits[: width * count].reshape(count, width).astype(np.int64)
    return least + values @ (2 ** np.arange(width - 1, -1, -1, dtype=np.int64))


def read_column(body, size, signed, count):
    """A column over the alive slots; every value fits its type."""
    runs = [read_run(body, size, signed, min(64, count - at)) for at in range(0, count, 64)]
    values = np.concatenate([np.zeros(0, np.int64), *runs])
    most = 2 ** (8 * size - signed) - 1
    require(not np.any(values > most), "snapshot", "a value beyond its column's type")
    return values


def read_region(body, stream):
    """The state of the one region, and its models."""
    require(body.leb128(4) == 0, "snapshot", "a region that does not exist")
    announced = body.u64()
    state = State(stream.capacity, stream.codec)
    mask = body.take(-(-stream.capacity // 8))
    state.alive = bits_of(mask, stream.capacity, "padding", "snapshot")
    slots = np.flatnonzero(state.alive)

    def column(size, signed=False):
        return read_column(body, size, signed, len(slots))

    state.reuse[slots] = column(1)
    state.type[slots] = column(2)
    rest = column(1)
    require(not np.any(rest > 1), "snapshot", "a rest that is neither 0 nor 1")
    state.rest[slots] = rest
    for rows in (state.p, state.v, state.c):
        for axis in range(3):
            rows[axis, slots] = column(4, signed=True)
    for i, row in enumerate(state.codec):
        values = column(1)
        row[slots] = values if i < 2 else values - 256 * (values > 127)
    require(not len(state.codec) or not np.any(state.codec[0] > 254), "snapshot", "an age of 255")
    require(not np.any(state.codec[2:] < -127), "snapshot", "a last step of -128")
    state.check_ranges(stream.types, "snapshot")
    models = start_models(stream)
    if models:
        models.read(body)
    body.end()
    computed = state.region_hash()
    require(computed == announced, "hash", f"snapshot: region hash {text(announced)}, computed {text(computed)}")
    return state, models


def read(data, stream):
    """A snapshot from its bytes."""
    reader = Reader(data, "snapshot")
    require(reader.take(4) == b"TDSP", "snapshot", "its first four bytes are others")
    version = reader.u8()
    require(version == 1, "snapshot", f"version {version}")
    epoch, stream_id, generation = reader.u64(), reader.u32(), reader.u32()
    frame, last_input = reader.u64(), reader.u64()
    require(frame <= 2**62, "snapshot", f"frame {frame}")
    drive, announced, capacity = read_drive(reader), reader.u64(), reader.u32()
    require(capacity == stream.capacity, "snapshot", f"capacity {capacity} instead of {stream.capacity}")

    known = {PARAMETERS: "parameters", INPUTS: "inputs", REGION: "region"}
    values, inputs, loaded, before = None, {}, None, 0
    for kind, body in sections(reader, known):
        require(kind > before, "order", f"snapshot: section 0x{kind:02x} behind 0x{before:02x}")
        before = kind
        if kind == PARAMETERS:
            values = parameters.complete(list(parameters.read(body).items()))
        elif kind == INPUTS:
            inputs = read_inputs(body, frame, last_input)
        else:
            loaded = read_region(body, stream)
    require(values is not None and loaded is not None, "snapshot", "a section that every snapshot has is missing")
    state, models = loaded
    require(state.hash() == announced, "hash", f"snapshot: state hash {text(announced)}, computed {text(state.hash())}")
    return Snapshot(
        epoch, stream_id, generation, frame, last_input, drive, announced, World(state, values, models), inputs
    )
