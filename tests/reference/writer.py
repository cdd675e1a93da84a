"""Writes what the reference decoder reads; for its tests and for the vectors of idl/vectors."""

import struct

import numpy as np

from tandem_reference import cdr, tracker


def leb128(value):
    """Unsigned LEB128, shortest form."""
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out) + bytes([value])


def section(kind, body):
    """A framed section."""
    return bytes([kind]) + leb128(len(body)) + body


def parameters(values):
    """{id: value} as bytes."""
    return b"".join(bytes([i]) + leb128(2 * v if v >= 0 else -2 * v - 1) for i, v in values.items())


def record(gap, kind, *content):
    """A lifecycle record: bytes objects joined behind its key."""
    return leb128(4 * gap + kind) + b"".join(content)


def position(p, v):
    """The content of the group position."""
    return struct.pack("<6i", *p, *v)


def joined_codes(codes):
    """(length, code) pairs as bytes, most significant bit first, zeros behind."""
    bits = "".join(format(code, f"0{length}b") for length, code in codes if length)
    bits += "0" * (-len(bits) % 8)
    return bytes(int(bits[i : i + 8], 2) for i in range(0, len(bits), 8))


class RangeEncoder:
    """The counterpart of the range decoder: `low` is a number of as many bytes as were shifted, and four."""

    def __init__(self, models):
        self.low, self.range, self.shifted = 0, 2**32 - 1, 0
        self.probabilities = models.p.tolist()

    def decide(self, model, one):
        """Write a decision of a model."""
        self.decision(self.probabilities[model], one)

    def decision(self, probability, one):
        """Write a decision with a probability."""
        bound = (self.range * probability) >> 16
        if one:
            self.range = bound
        else:
            self.low += bound
            self.range -= bound
        while self.range < 2**24:
            self.low, self.range, self.shifted = self.low << 8, self.range << 8, self.shifted + 1

    def finish(self):
        """The shortest bytes within the range that are not all zero."""
        size = 4 + self.shifted
        for kept in range(1, size + 1):
            unit = 256 ** (size - kept)
            value = max(-(-self.low // unit), 1) * unit
            if value < self.low + self.range:
                return value.to_bytes(size, "big").rstrip(b"\0")
        raise AssertionError("a range is never empty")


def write_steps(encoder, contexts, slot, steps):
    """The decisions of a corrected body."""
    moved = 0
    for axis in range(3):
        size = abs(steps[axis])
        if axis < 2 or moved:
            encoder.decide(int(contexts.zero[axis, slot]) + 2 * moved, size > 0)
        if not size:
            continue
        encoder.decide(int(contexts.sign[axis, slot]), steps[axis] < 0)
        for i in range(min(size, 14)):
            encoder.decide(int(contexts.magnitude[slot]) + 14 * moved + i, size > i + 1)
        if size > 14:
            number = size - 14
            bits = number.bit_length() - 1
            for i in range(min(bits + 1, 31)):
                encoder.decide(tracker.ESCAPE + i, bits > i)
            for i in range(bits - 1, -1, -1):
                encoder.decision(32768, number >> i & 1)
        moved += 1


def tracker_section(world, threshold, steps, renewed=None, block=0):
    """Corrections of one block, of {slot: steps}; `world` as after the lifecycle of the delta."""
    state = world.state
    renewed = np.zeros(state.capacity, bool) if renewed is None else renewed
    contexts = tracker.Contexts(state, renewed, threshold)
    encoder = RangeEncoder(world.models)
    first, end = state.block_slots(block)
    for slot in range(first, end):
        if state.alive[slot]:
            encoder.decide(int(contexts.flag[slot]), slot in steps)
    for slot in sorted(steps):
        write_steps(encoder, contexts, slot, steps[slot])
    return section(0x83, leb128(block) + encoder.finish())


def run(values, size, signed):
    """A run of a snapshot's column."""
    least = min(values)
    width = (max(values) - least).bit_length()
    head = bytes([width]) + int(least).to_bytes(size, "little", signed=signed)
    return head + joined_codes([(width, int(value) - int(least)) for value in values])


def column(values, size, signed=False):
    """A column of a snapshot."""
    values = [int(value) for value in values]
    return b"".join(run(values[i : i + 64], size, signed) for i in range(0, len(values), 64))


def snapshot(timeline, epoch=1, stream=0, generation=0):
    """The snapshot of a timeline's frame."""
    world, state, drive = timeline.world, timeline.world.state, timeline.drive
    slots = np.flatnonzero(state.alive)
    region = [leb128(0), struct.pack("<Q", state.region_hash())]
    region.append(np.packbits(state.alive, bitorder="little").tobytes())
    region += [column(state.reuse[slots], 1), column(state.type[slots], 2), column(state.rest[slots], 1)]
    region += [column(rows[axis, slots], 4, True) for rows in (state.p, state.v, state.c) for axis in range(3)]
    region += [column(row[slots] % 256, 1) for row in state.codec]
    if world.models:
        for weight, p in zip(world.models.weight, world.models.p):
            region.append(struct.pack("<BH", weight, p) if weight else b"\0")
    waiting = [
        struct.pack("<QQ3iH", number, frame, *act.gravity, act.damping)
        for number, (frame, act) in sorted(timeline.inputs.items())
    ]
    return b"".join(
        [
            b"TDSP\x01",
            struct.pack("<QIIQQ", epoch, stream, generation, timeline.frame, timeline.last_input),
            struct.pack("<3iH", *drive.gravity, drive.damping),
            struct.pack("<QI", state.hash(), state.capacity),
            section(0x82, parameters(world.parameters)),
            section(0x84, b"".join(waiting)) if waiting else b"",
            section(0x85, b"".join(region)),
        ]
    )


class CdrWriter:
    """Encodes what cdr.Decoder decodes."""

    def __init__(self):
        self.out = bytearray()

    def scalar(self, kind, value):
        """A number behind its padding."""
        code = "<" + cdr.SCALARS[kind]
        self.out += bytes(-len(self.out) % struct.calcsize(code)) + struct.pack(code, value)

    def value(self, kind, value):
        """A value of any kind; structs are dicts."""
        if kind == "string":
            self.scalar("uint32", len(value.encode()) + 1)
            self.out += value.encode() + b"\0"
        elif kind.startswith("["):
            self.scalar("uint32", len(value))
            for one in value:
                self.value(kind[1:-1], one)
        elif kind in cdr.TYPES:
            for field, name in cdr.TYPES[kind]:
                self.value(field, value[name])
        else:
            self.scalar(kind, value)


def sample(kind, /, **fields):
    """A sample of a topic type, with its encapsulation header."""
    writer = CdrWriter()
    writer.value(kind, fields)
    return cdr.ENCAPSULATION + bytes(writer.out)


def mcap_record(opcode, content):
    """A record of an MCAP file."""
    return struct.pack("<BQ", opcode, len(content)) + content


def mcap_text(value):
    """A text of an MCAP record."""
    return struct.pack("<I", len(value.encode())) + value.encode()


def mcap_file(messages, chunked=False, footer=True):
    """An MCAP file of (topic, bytes) messages."""
    records, channels = b"", {}
    for topic, data in messages:
        if topic not in channels:
            identity = channels[topic] = len(channels) + 1
            schema = struct.pack("<H", identity) + mcap_text(f"tandem::{topic}") + mcap_text("") + struct.pack("<I", 0)
            head = struct.pack("<HH", identity, identity)
            channel = head + mcap_text(topic) + mcap_text("cdr") + struct.pack("<I", 0)
            records += mcap_record(3, schema) + mcap_record(4, channel)
        records += mcap_record(5, struct.pack("<HIQQ", channels[topic], 0, 0, 0) + data)
    if chunked:
        head = struct.pack("<QQQI", 0, 0, len(records), 0) + mcap_text("") + struct.pack("<Q", len(records))
        records = mcap_record(6, head + records)
    magic = b"\x89MCAP0\r\n"
    whole = magic + mcap_record(1, mcap_text("") + mcap_text("test")) + records
    if footer:
        whole += mcap_record(15, bytes(4)) + mcap_record(2, bytes(20)) + magic
    return whole
