"""Corrections of the thesis's codecs: none, selective, quantized, entropy and limited."""

import numpy as np

from . import huffman, parameters, turn
from .errors import Refused, require
from .integers import clamp
from .state import MOST_P, MOST_V

LIST, MASK, ALL = range(3)


def bits_of(data, count, rule, what):
    """Return the first `count` bits of some bytes, the lowest of each byte first; the others must be zero."""
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
    """Set p, v, q and w to the values in the section; c becomes 0."""
    numbers = 13 if state.orientation else 6
    values = np.frombuffer(body.take(4 * numbers * len(slots)), "<i4").astype(np.int64).reshape(-1, numbers).T
    p, v, q, w = np.split(values, (3, 6, 10)) if state.orientation else (values[:3], values[3:], None, None)
    require(np.all(np.abs(p) <= MOST_P), "values", "a position out of range")
    require(np.all(np.abs(v) <= MOST_V), "values", "a velocity out of range")
    if state.orientation:
        require(turn.is_quaternion(q).all(), "values", "a quaternion that is none")
        require(turn.is_spin(w).all(), "values", "an angular velocity out of range")
        state.q[:, slots], state.w[:, slots] = q, w
    state.p[:, slots], state.v[:, slots], state.c[:, slots] = p, v, 0


def residuals(stream, body, bodies):
    """Six residuals for each body, twelve with orientations, one column a body."""
    numbers = 12 if stream.orientation else 6
    if stream.codec == "quantized":
        return np.frombuffer(body.take(numbers * bodies), np.int8).astype(np.int64).reshape(-1, numbers).T
    return np.array(huffman.decode(body.rest(), stream.tables, bodies), np.int64).T


def add_residuals(state, slots, steps, values):
    """Change p, v, q and w by steps of the sizes in force."""
    state.p[:, slots] = clamp(state.p[:, slots] + steps[:3] * values["position_step"], MOST_P)
    state.v[:, slots] = clamp(state.v[:, slots] + steps[3:6] * values["velocity_step"], MOST_V)
    if state.orientation:
        state.q[:, slots], _ = turn.turned_by(state.q[:, slots], steps[6:9] * values["turn_step"])
        state.w[:, slots] = turn.limited(state.w[:, slots] + steps[9:] * values["spin_step"])
