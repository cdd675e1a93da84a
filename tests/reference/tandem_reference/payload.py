"""A delta: its sections, and what they do to the predicted state."""

from dataclasses import dataclass, field

import numpy as np

from . import codecs, parameters, tracker, turn
from .data import DATA
from .errors import require
from .reader import Reader
from .state import EVENTS, FEATURES, KEYS, MOST_P, MOST_V, read_events, read_keys
from .xxh3 import xxh3_64

LIFECYCLE, PARAMETERS, CORRECTIONS, LAST_CORRECTIONS, ROUNDING = 0x81, 0x82, 0x83, 0x86, 0x87
ORDER = KEYS, EVENTS, DATA, LIFECYCLE, PARAMETERS, ROUNDING, CORRECTIONS, LAST_CORRECTIONS
DESPAWN, SPAWN, TELEPORT, TYPE_CHANGE = range(4)


@dataclass
class World:
    """All that client and server hold in common after a frame."""

    state: object
    parameters: dict
    models: object
    news: object = None  # where the session has features
    data: object = None  # where the stream has data of bodies

    def copy(self):
        """The same in memory of its own."""
        models = self.models.copy() if self.models else None
        news, data = (part.copy() if part else None for part in (self.news, self.data))
        return World(self.state.copy(), dict(self.parameters), models, news, data)

    def hash(self):
        """The state hash."""
        hashes = [self.state.leaves_hash(), *(part.hash() for part in (self.news, self.data) if part)]
        return xxh3_64(b"".join(one.to_bytes(8, "little") for one in hashes))


def start_models(stream):
    """The models of a stream at its start; codecs other than `tracker` have none."""
    return tracker.Models(stream.orientation) if stream.codec == "tracker" else None


@dataclass
class Record:
    """One record of the section lifecycle."""

    slot: int
    kind: int
    reuse: int = 0
    type: int = 0
    columns: dict = field(default_factory=dict)  # those that it sets, by name


@dataclass
class Parsed:
    """The known sections of a payload."""

    records: list
    parameters: dict
    rounding: tuple  # bits of p, v, c, q and w
    corrections: list  # (block, Reader at what the codec says)
    keys: dict = field(default_factory=dict)
    events: tuple = ()  # count, bytes
    data: object = None  # Reader of section 0x8b


def sections(reader, known):
    """(type, Reader of the body) of every section with a known type; the others are skipped or refused."""
    while reader.left():
        kind = reader.u8()
        goes_on = kind == LAST_CORRECTIONS and kind in known
        body = reader.rest() if goes_on else reader.take(reader.leb128(4))
        if kind in known:
            yield kind, Reader(body, known[kind])
        else:
            require(kind < 0x80, "critical", f"unknown critical section 0x{kind:02x}")


def parse(data, world):
    """The known sections of a payload, in the order that the protocol asks for."""
    state = world.state
    known = {LIFECYCLE: "lifecycle", PARAMETERS: "parameters", ROUNDING: "rounding", CORRECTIONS: "corrections"}
    known[LAST_CORRECTIONS] = "corrections of the last block"
    known |= {FEATURES[feature]: feature for feature in (world.news.features if world.news else ())}
    known |= {DATA: "data"} if world.data else {}
    parsed = Parsed([], {}, (0, 0, 0, 0, 0), [])
    before = None
    for kind, body in sections(Reader(data, "payload"), known):
        ascends = before is None or ORDER.index(kind) > ORDER.index(before)
        require(ascends or kind == before == CORRECTIONS, "order", f"{known[kind]} behind section 0x{before or 0:02x}")
        before = kind
        if kind == KEYS:
            parsed.keys = read_keys(body)
            require(parsed.keys, "keys", "a section without any")
        elif kind == EVENTS:
            parsed.events = read_events(body, state.capacity)
        elif kind == DATA:
            parsed.data = body
        elif kind == LIFECYCLE:
            parsed.records = read_records(body, state.orientation)
        elif kind == PARAMETERS:
            parsed.parameters = parameters.read(body, world.parameters)
            require(parsed.parameters, "parameters", "a section that names none")
        elif kind == ROUNDING:
            parsed.rounding = read_rounding(body, state.orientation)
        else:
            block = body.leb128(4) if kind == CORRECTIONS else state.blocks() - 1
            require(block < state.blocks(), "corrections", f"block {block} does not exist")
            if parsed.corrections:
                require(block > parsed.corrections[-1][0], "order", "blocks that do not ascend")
            parsed.corrections.append((block, body))
    return parsed


def read_rounding(body, orientation):
    """How many bits of p, v, c, q and w are rounded away."""
    bits = tuple(body.u8() for _ in range(5 if orientation else 3))
    require(not body.left(), "length", "bytes behind a rounding")
    require(max(bits) <= 24, "rounding", f"rounding by {bits} bits")
    bits = (bits + (0, 0))[:5]
    require(bits[3] <= 18, "rounding", f"rounding q by {bits[3]} bits")
    return bits


def rounded(columns, bits):
    """The nearest multiples of 2^bits, halves up."""
    return ((columns + (1 << bits >> 1)) >> bits) << bits


def rounded_in_range(vectors, bits, is_in_range):
    """Round vectors; one whose result would be out of range stays as it is."""
    result = rounded(vectors, bits)
    return np.where(is_in_range(result), result, vectors)


def round_orientations(state, bits):
    """Round q of every body, and negate it where its w is below 0 then."""
    if state.orientation and bits:
        alive = state.alive == 1
        q = rounded_in_range(state.q[:, alive], bits, turn.is_quaternion)
        state.q[:, alive] = np.where(q[3] < 0, -q, q)


def read_position(body):
    """The content of the group `position`."""
    values = [body.i32() for _ in range(6)]
    p, v = tuple(values[:3]), tuple(values[3:])
    require(all(abs(value) <= MOST_P for value in p), "values", "a position out of range")
    require(all(abs(value) <= MOST_V for value in v), "values", "a velocity out of range")
    return {"p": p, "v": v}


def read_orientation(body):
    """The content of the group `orientation`."""
    values = [body.i32() for _ in range(7)]
    q, w = tuple(values[:4]), tuple(values[4:])
    require(turn.is_quaternion(np.array(q, np.int64)), "values", f"a quaternion of {q}")
    require(turn.is_spin(np.array(w, np.int64)), "values", f"an angular velocity of {w}")
    return {"q": q, "w": w}


def read_records(body, orientation):
    """The records of a lifecycle section; with the group `orientation` or without."""
    all_groups = 3 if orientation else 1
    records = []
    slot = 0
    while body.left() or not records:
        key = body.leb128(4)
        slot += key // 4
        record = Record(slot, key % 4)
        if records and records[-1].slot == slot:
            pair = records[-1].kind, record.kind
            require(pair == (DESPAWN, SPAWN), "lifecycle", f"slot {slot}: two records that may not follow each other")
        if record.kind == SPAWN:
            record.reuse = body.u8()
        if record.kind in (SPAWN, TYPE_CHANGE):
            record.type = body.leb128(3)
        groups = all_groups if record.kind == SPAWN else 0
        if record.kind == TELEPORT:
            groups = body.u8()
            require(1 <= groups <= all_groups, "lifecycle", f"slot {slot}: a teleport of the groups {groups:#x}")
        if groups & 1:
            record.columns |= read_position(body)
        if groups & 2:
            record.columns |= read_orientation(body)
        records.append(record)
    return records


def apply_records(state, records, types):
    """Apply the records. Return which bodies were renewed."""
    renewed = np.zeros(state.capacity, bool)
    for record in records:
        slot = record.slot
        require(slot < state.capacity, "lifecycle", f"slot {slot} does not exist")
        require(record.type < types, "lifecycle", f"slot {slot}: type {record.type} does not exist")
        if record.kind == SPAWN:
            require(not state.alive[slot], "lifecycle", f"slot {slot}: a spawn where a body lives")
            state.alive[slot] = 1
            state.reuse[slot] = record.reuse
        else:
            require(state.alive[slot], "lifecycle", f"slot {slot}: no body lives there")
        if record.kind == DESPAWN:
            state.clear(slot)
        if record.kind in (SPAWN, TYPE_CHANGE):
            state.type[slot] = record.type
        if record.kind in (SPAWN, TELEPORT):
            for name, values in record.columns.items():
                getattr(state, name)[:, slot] = values
            state.c[:, slot] = 0
            state.rest[slot] = 0
            state.codec[:, slot] = 0
            state.own[:, slot] = 0
            renewed[slot] = 1
    return renewed


def apply_delta(world, stream, data, gravity=(0, 0, 0)):
    """The world after a delta, from the one with the predicted state of its frame, which stays as it is.

    gravity is that of the drive in force at the frame.
    """
    parsed = parse(data, world)
    after = world.copy()
    after.parameters.update(parsed.parameters)
    if parsed.keys:
        after.news.change_keys(parsed.keys)
    if parsed.events:
        after.news.add_events(*parsed.events)
    state = after.state
    renewed = apply_records(state, parsed.records, stream.types)
    if after.data:
        spawned = {record.slot for record in parsed.records if record.kind == SPAWN}
        after.data.begin(spawned, {record.slot for record in parsed.records if record.kind == DESPAWN})
        changed = after.data.read_section(parsed.data, state.alive) if parsed.data else set()
        after.data.end(state.alive, spawned | changed)
    for_p, for_v, for_c, for_q, for_w = parsed.rounding
    state.p[:] = rounded(state.p, for_p)
    round_orientations(state, for_q)
    if stream.codec == "tracker":
        tracker.apply_corrections(after, stream, parsed.corrections, renewed, tracker.Setting(for_p, gravity))
    else:
        codecs.apply_corrections(after, stream, parsed.corrections)
    awake = state.rest == 0
    state.v[:, awake] = rounded(state.v[:, awake], for_v)
    state.c[:, awake] = rounded(state.c[:, awake], for_c)
    round_orientations(state, for_q)
    if state.orientation:
        state.w[:, awake] = rounded_in_range(state.w[:, awake], for_w, turn.is_spin)
    return after
