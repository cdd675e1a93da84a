"""Writes what the reference decoder reads; for its tests and for the vectors of idl/vectors."""

import bisect
import math
import struct

import numpy as np

from tandem_reference import cdr, tracker
from tandem_reference import snapshot as reference
from tandem_reference.state import BLOCK
from tandem_reference.range_decoder import SHORT, Model, NumberModels


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


def orientation(q, w):
    """The content of the group orientation."""
    return struct.pack("<7i", *q, *w)


def joined_codes(codes):
    """(length, code) pairs as bytes, most significant bit first, zeros behind."""
    bits = "".join(format(code, f"0{length}b") for length, code in codes if length)
    bits += "0" * (-len(bits) % 8)
    return bytes(int(bits[i : i + 8], 2) for i in range(0, len(bits), 8))


class RangeEncoder:
    """The counterpart of the range decoder: `low` is a number of as many bytes as were shifted, and four."""

    def __init__(self, models=None):
        self.low, self.range, self.shifted = 0, 2**32 - 1, 0
        self.probabilities = models.p.tolist() if models else []

    def decide(self, model, one):
        """Write a decision of a model of the codec."""
        self.decision(self.probabilities[model], one)

    def decision(self, probability, one):
        """Write a decision with a probability."""
        bound = (self.range * probability) >> 16
        if one:
            self.range = bound
        else:
            self.low += bound
            self.range -= bound
        self.shift()

    def even_bits(self, value, count):
        """Write a number of up to 16 bits, each of which is as likely 0 as 1."""
        share = self.range >> count
        self.low += share * value
        self.range = self.range - share * value if value == (1 << count) - 1 else share
        self.shift()

    def shift(self):
        """Keep the range at 25 bits at least."""
        while self.range < 2**24:
            self.low, self.range, self.shifted = self.low << 8, self.range << 8, self.shifted + 1

    def finish(self, least=0):
        """The shortest bytes within the range, zeros left out behind, of a number of at least `least`."""
        size = 4 + self.shifted

        def value(kept):
            unit = 256 ** (size - kept)
            return max(-(-self.low // unit), least) * unit

        # Where so many bytes do, more do, too.
        kept = bisect.bisect_left(range(size), True, key=lambda kept: value(kept) < self.low + self.range)
        return value(kept).to_bytes(size, "big").rstrip(b"\0")


class NumberEncoder(RangeEncoder):
    """The counterpart of the number decoder."""

    def decide(self, model, one):
        """Write a decision, which teaches its model."""
        self.decision(model.p, one)
        model.learn(one)

    def number(self, models, x):
        """Write a number of a kind."""
        size = abs(x)
        self.decide(models.some, size > 0)
        if not size:
            return
        bits, node = size.bit_length(), 1
        for i in range(4, -1, -1):
            bit = (bits - 1) >> i & 1
            self.decide(models.length[node], bit)
            node = 2 * node + bit
        value, left = 1, bits - 1
        if bits > SHORT:
            high = min(left, 15)
            left -= high
            self.even_bits(2 * (size >> left & ((1 << high) - 1)) + (x < 0), high + 1)
        else:
            self.decide(models.sign[bits], x < 0)
            while left > 0 and value < 4:
                left -= 1
                self.decide(models.next[bits][value], size >> left & 1)
                value = size >> left
        if left > 0:
            self.even_bits(size & ((1 << left) - 1), left)


def write_correction(encoder, contexts, slot, correction, orientation):
    """The decisions of a corrected body."""
    encoder.decide(int(contexts.rest[slot]), correction.rest)
    if orientation:
        both, choice = bool(correction.steps and correction.turn), int(contexts.choice[slot])
        encoder.decide(tracker.BOTH + choice, both)
        if both:
            encoder.decide(tracker.FINE, correction.fine)
        else:
            encoder.decide(tracker.WHICH + choice, bool(correction.turn))
    if correction.steps:
        write_steps(encoder, contexts.position, slot, correction.steps)
    if correction.turn:
        write_steps(encoder, contexts.turn, slot, correction.turn)


def write_steps(encoder, contexts, slot, steps):
    """The decisions of the steps of a group."""
    moved = 0
    for axis in range(3):
        size = abs(steps[axis])
        if axis < 2 or moved:
            encoder.decide(int(contexts.zero[axis, slot]) + 2 * moved, size > 0)
        if not size:
            continue
        encoder.decide(int(contexts.sign[axis, slot]), steps[axis] < 0)
        write_size(encoder, int(contexts.size[axis, slot]) + 12 * tracker.longest_class([0, *steps[:axis]]), contexts, size)
        moved += 1


def write_size(encoder, models, contexts, size):
    """The decisions of the absolute value of steps that are not 0."""
    found = bisect.bisect_right(tracker.CLASSES, size) - 1
    for i in range(min(found + 1, 12)):
        encoder.decide(models + i, found > i)
    if found < 12:
        bits = (tracker.CLASSES[found + 1] - tracker.CLASSES[found]).bit_length() - 1
        place = size - tracker.CLASSES[found]
        if bits:
            encoder.decide(contexts.place + found - 4, place >> (bits - 1))
        for i in range(bits - 2, -1, -1):
            encoder.decision(32768, place >> i & 1)
        return
    number = size - 64
    bits = number.bit_length() - 1
    for i in range(min(bits + 1, 31)):
        encoder.decide(contexts.escape + i, bits > i)
    for i in range(bits - 1, -1, -1):
        encoder.decision(32768, number >> i & 1)


def tracker_section(world, threshold, steps, renewed=None, block=0, rests=()):
    """Corrections of one block, of {slot: steps of the position, or a Correction}.

    `world` is as after the lifecycle of the delta.
    """
    state = world.state
    renewed = np.zeros(state.capacity, bool) if renewed is None else renewed
    contexts = tracker.Contexts(state, renewed, threshold)
    encoder = RangeEncoder(world.models)
    first, end = state.block_slots(block)
    for slot in range(first, end):
        if state.alive[slot]:
            encoder.decide(int(contexts.flag[slot]), slot in steps)
    for slot in sorted(steps):
        correction = steps[slot]
        if isinstance(correction, list):
            correction = tracker.Correction(slot in rests, correction)
        write_correction(encoder, contexts, slot, correction, state.orientation)
    if block == state.blocks() - 1:
        return b"\x86" + encoder.finish(1)
    return section(0x83, leb128(block) + encoder.finish(1))


def shifted(numbers, values):
    """A column's shift, written, and its values without it."""
    values = [int(value) for value in values]
    used = 0
    for value in values:
        used |= value
    shift = (used & -used).bit_length() - 1 if used else 0
    numbers.even_bits(shift, 5)
    return shift, [value >> shift for value in values]


def column(numbers, values, how, at_rest):
    """A column of a snapshot."""
    _, values = shifted(numbers, values)
    kinds, guess = [NumberModels(), NumberModels()], reference.Guess(how)
    for x, rest in zip(values, at_rest):
        numbers.number(kinds[rest], x - guess.values[rest])
        guess.saw(rest, x)


def norm_column(numbers, q, at_rest):
    """The column w of quaternions."""
    shift, values = shifted(numbers, q[3])
    kinds = [NumberModels(), NumberModels()]
    for x, rest, others in zip(values, at_rest, q[:3].T.tolist()):
        guess = math.isqrt(max(0, 2**60 - sum(other * other for other in others))) >> shift
        numbers.number(kinds[rest], x - guess)


def same_column(numbers, values, at_rest):
    """A column in which 0 and the value of the body before change places."""
    _, values = shifted(numbers, values)
    kinds, before = [NumberModels(), NumberModels()], [0, 0]
    for x, rest in zip(values, at_rest):
        numbers.number(kinds[rest], {0: before[rest], before[rest]: 0}.get(x, x))
        before[rest] = x


def models_of(numbers, models, more_ones):
    """The models of the codec `tracker`; `more_ones` are told than those that explain P best."""
    weights, ones, rest = NumberModels(), [NumberModels() for _ in range(8)], NumberModels()
    starts = tracker.Models(len(models.p) > tracker.Models(False).p.size).p.tolist()
    for weight, p, start in zip(models.weight.tolist(), models.p.tolist(), starts):
        numbers.number(weights, -weight % 256)
        if weight:
            seen = (((weight + 1) * p - start + 2**15) >> 16) + more_ones
            numbers.number(ones[weight.bit_length() - 1], seen)
            guess = (start + 65536 * seen) // (weight + 1)
            numbers.number(rest, p - min(max(guess, 32), 65504))


def bodies(world, more_ones=0):
    """The body of section 0x85."""
    state, numbers = world.state, NumberEncoder()
    living, before = [Model(), Model()], 0
    for alive in state.alive.tolist():
        numbers.decide(living[before], alive)
        before = int(alive)
    slots = np.flatnonzero(state.alive)
    at_rest = [int(rest) for rest in state.rest[slots]]
    column(numbers, at_rest, reference.ZERO, [0] * len(slots))
    column(numbers, state.reuse[slots], reference.ZERO, at_rest)
    column(numbers, state.type[slots], reference.ZERO, at_rest)
    for rows, how in ((state.p, reference.BEFORE), (state.v, reference.HALF), (state.c, reference.HALF)):
        for axis in range(3):
            column(numbers, rows[axis, slots], how, at_rest)
    if state.orientation:
        for row in state.q[:3]:
            column(numbers, row[slots], reference.REST, at_rest)
        norm_column(numbers, state.q[:, slots], at_rest)
        for row in state.w:
            column(numbers, row[slots], reference.ZERO, at_rest)
    for i, row in enumerate(state.codec):
        values = (row[slots] + 128) % 256 - 128
        if i % tracker.GROUP < 2:
            same_column(numbers, values, at_rest)
        else:
            column(numbers, values, reference.ZERO, at_rest)
    for row in state.own:
        column(numbers, row[slots], reference.BEFORE, at_rest)
    if world.models:
        models_of(numbers, world.models, more_ones)
    return struct.pack("<Q", state.leaves_hash()) + numbers.finish()


def key(name, value):
    """A record of a key; value None: it goes."""
    return bytes([len(name)]) + name + (b"\0" if value is None else leb128(1 + len(value)) + value)


def event(kind, data=b"", body=None):
    """A record of an event; body: slot and reuse."""
    about = leb128(0) if body is None else leb128(1 + body[0]) + bytes([body[1]])
    return leb128(kind) + about + leb128(len(data)) + data


def world_news(news):
    """The body of the section world."""
    return struct.pack("<QQ", news.count, news.chain) + b"".join(key(*entry) for entry in sorted(news.keys.items()))


def data(data, changes, alive):
    """The body of section 0x8b: {slot: record as bytes} of the slots that change."""
    models, numbers, any_before = data.copy().models, NumberEncoder(), False
    for first in range(0, len(alive), BLOCK):
        living = [slot for slot in range(first, min(first + BLOCK, len(alive))) if alive[slot]]
        if not living:
            continue
        some = any(slot in changes for slot in living)
        numbers.decide(models.any[any_before], some)
        any_before, before = some, False
        for slot in living if some else ():
            changes_now = slot in changes
            numbers.decide(models.changed[2 * int(tracker.bucket(data.ages[slot])) + before], changes_now)
            before = changes_now
            if changes_now:
                data_record(numbers, models, data, data.records[slot], data.numbers_of(changes[slot]))
    return numbers.finish()


def data_record(numbers, models, data, before, after):
    """The fields of a body that change."""
    first, earlier = 0, False
    for index, (_, kind) in enumerate(data.fields):
        end = first + (4 if kind == "rgba" else 1)
        changes = before[first:end] != after[first:end]
        if earlier or index < len(data.fields) - 1:
            numbers.decide(models.fields[2 * index + earlier], changes)
        for i in range(first, end) if changes else ():
            numbers.number(models.numbers[i], data_step(data.bits[i], before[i], after[i]))
        first, earlier = end, earlier or changes


def data_step(bits, before, after):
    """What leads from one number to another."""
    half = 1 << (bits - 1)
    return (after - before + half) % (2 * half) - half


def all_data(data, alive):
    """The section of a snapshot."""
    numbers, living = NumberEncoder(), [slot for slot, lives in enumerate(alive) if lives]
    for index, bits in enumerate(data.bits):
        kind, before = NumberModels(), 0
        for slot in living:
            numbers.number(kind, data_step(bits, before, data.records[slot][index]))
            before = data.records[slot][index]
    kind, before = NumberModels(), 0
    for slot in living:
        numbers.number(kind, data.ages[slot] - before)
        before = data.ages[slot]
    for model in data.models.each():
        numbers.even_bits(model.seen, 7)
        if model.seen != 1:
            numbers.even_bits(model.p, 16)
    return numbers.finish()


def snapshot(timeline, epoch=1, stream=0, generation=0, more_ones=0):
    """The snapshot of a timeline's frame."""
    world, state, drive = timeline.world, timeline.world.state, timeline.drive
    waiting = [
        struct.pack("<QQ3iH", number, frame, *act.gravity, act.damping)
        for number, (frame, act) in sorted(timeline.inputs.items())
    ]
    return b"".join(
        [
            b"TDSP\x03",
            struct.pack("<QIIQQ", epoch, stream, generation, timeline.frame, timeline.last_input),
            struct.pack("<3iH", *drive.gravity, drive.damping),
            struct.pack("<QI", world.hash(), state.capacity),
            section(0x82, parameters(world.parameters)),
            section(0x84, b"".join(waiting)) if waiting else b"",
            section(0x85, bodies(world, more_ones)),
            section(0x8E, world_news(world.news)) if world.news else b"",
            section(0x8F, all_data(world.data, state.alive)) if world.data else b"",
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
