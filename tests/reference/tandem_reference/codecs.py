"""Corrections of the paper's codecs: none, selective, quantized, entropy and limited."""

import numpy as np

from . import huffman, parameters
from .errors import Refused, require
from .integers import clamp
from .state import MOST_P, MOST_V

LIST, MASK, ALL = range(3)


def bits_of(data, count, rule, what):
    """The first `count` bits of some bytes, the lowest of each byte first; the others must be zero."""
    bits = np.unpackbits(np.frombuffer(data, np.uint8), bitorder="little")
    require(not bits[count:].any(), rule, f"{what}: unused bits that are not zero")
    return bits[:count].astype(bool)


def read_selection(body, alive):
    """The selected slots of a block, ascending, within the block; `alive` tells which may be."""
    form = body.u8()
    if form == LIST:
        count = body.u16()
        selected = np.frombuffer(body.take(2 * count), "<u2").astype(np.int64)
        require(np.all(np.diff(selected) > 0), "selection", "indices that do not ascend")
        require(count == 0 or selected[-1] < len(alive), "selection", "an index beyond the block")
    elif form == MASK:
        selected = np.flatnonzero(bits_of(body.take(-(-len(alive) // 8)), len(alive), "padding", "selection"))
    elif form == ALL:
        selected = np.flatnonzero(alive)
    else:
        raise Refused("selection", f"unknown form {form}")
    require(len(selected) > 0, "selection", "no body is selected")
    require(alive[selected].all(), "selection", "a slot is selected that is dead")
    return selected


def apply_corrections(world, stream, corrections):
    """Apply the sections of all blocks to a state after its lifecycle."""
    state = world.state
    for block, body in corrections:
        first, end = state.block_slots(block)
        slots = first + read_selection(body, state.alive[first:end])
        if stream.codec in ("none", "selective"):
            set_values(state, slots, body)
        else:
            add_residuals(state, slots, residuals(stream, body, len(slots)), parameters.named(world.parameters))
        body.end()
        state.rest[slots] = 0


def set_values(state, slots, body):
    """p and v as they stand in the section; c becomes 0."""
    values = np.frombuffer(body.take(24 * len(slots)), "<i4").astype(np.int64).reshape(-1, 6).T
    require(np.all(np.abs(values[:3]) <= MOST_P), "values", "a position out of range")
    require(np.all(np.abs(values[3:]) <= MOST_V), "values", "a velocity out of range")
    state.p[:, slots], state.v[:, slots], state.c[:, slots] = values[:3], values[3:], 0


def residuals(stream, body, bodies):
    """Six residuals for each body, one column a body."""
    if stream.codec == "quantized":
        return np.frombuffer(body.take(6 * bodies), np.int8).astype(np.int64).reshape(-1, 6).T
    return np.array(huffman.decode(body.rest(), stream.tables, bodies), np.int64).T


def add_residuals(state, slots, steps, values):
    """p and v move by steps of the sizes in force."""
    state.p[:, slots] = clamp(state.p[:, slots] + steps[:3] * values["position_step"], MOST_P)
    state.v[:, slots] = clamp(state.v[:, slots] + steps[3:] * values["velocity_step"], MOST_V)
