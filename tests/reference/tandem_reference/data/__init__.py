"""The data of bodies: records beside their motion, their ages, and the models of their coding."""

import copy
import struct
from dataclasses import dataclass, field

from ..errors import require
from ..range_decoder import Model, NumberDecoder, NumberModels
from ..state import BLOCK
from ..tracker import bucket
from ..xxh3 import xxh3_64

DATA, ALL_DATA = 0x8B, 0x8F
KINDS = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "f32": 4, "rgba": 4}  # in the order of their numbers
SIGN = 1 << 31


def check_fields(fields):
    """Refuse fields [(name, kind)] that no session may have."""
    require(len(fields) <= 16, "session", f"{len(fields)} fields of data")
    letters = set("abcdefghijklmnopqrstuvwxyz0123456789_")
    for name, kind in fields:
        require(1 <= len(name) <= 32 and set(name) <= letters, "session", f"a field called {name!r}")
        require(kind in KINDS, "session", f"a field of kind {kind}")
    require(len({name for name, _ in fields}) == len(fields), "session", "a field's name twice")
    require(sum(KINDS[kind] for _, kind in fields) <= 16, "session", "data of more than 16 bytes")


@dataclass
class Models:
    """All models of section 0x8b."""

    any: list = field(default_factory=lambda: [Model() for _ in range(2)])
    changed: list = field(default_factory=lambda: [Model() for _ in range(2 * 15)])
    fields: list = field(default_factory=lambda: [Model() for _ in range(2 * 16)])
    numbers: list = field(default_factory=list)

    def each(self):
        """In the order of snapshots."""
        yield from self.any + self.changed + self.fields
        for kind in self.numbers:
            yield kind.some
            yield from kind.length + kind.sign
            for of_length in kind.next:
                yield from of_length


class Data:
    """Records as lists of numbers, one list a slot, and ages."""

    def __init__(self, fields, capacity):
        self.fields = fields
        self.bits = [bits for _, kind in fields for bits in ([8] * 4 if kind == "rgba" else [8 * KINDS[kind]])]
        nothing = self.numbers_of(bytes(sum(KINDS[kind] for _, kind in fields)))
        self.nothing = nothing
        self.records = [list(nothing) for _ in range(capacity)]
        self.ages = [0] * capacity
        self.models = Models(numbers=[NumberModels() for _ in self.bits])

    def __eq__(self, other):
        same = self.records == other.records and self.ages == other.ages
        return same and all((a.p, a.seen) == (b.p, b.seen) for a, b in zip(self.models.each(), other.models.each()))

    def copy(self):
        """The same in memory of its own."""
        return copy.deepcopy(self)

    def numbers_of(self, record):
        """A record's bytes as numbers."""
        numbers, at = [], 0
        for _, kind in self.fields:
            size = KINDS[kind]
            part = record[at : at + size]
            at += size
            if kind == "rgba":
                numbers += part
                continue
            number = int.from_bytes(part, "little")
            if kind == "f32":
                number = ~number & 0xFFFFFFFF if number & SIGN else number ^ SIGN
            numbers.append(number)
        return numbers

    def bytes_of(self, numbers):
        """Numbers as the bytes of a record."""
        out, left = b"", iter(numbers)
        for _, kind in self.fields:
            if kind == "rgba":
                out += bytes(next(left) for _ in range(4))
                continue
            number = next(left)
            if kind == "f32":
                number = number ^ SIGN if number & SIGN else ~number & 0xFFFFFFFF
            out += struct.pack("<Q", number)[: KINDS[kind]]
        return out

    def hash(self):
        """The data hash."""
        hashes = b""
        for first in range(0, len(self.ages), BLOCK):
            records = b"".join(self.bytes_of(record) for record in self.records[first : first + BLOCK])
            for part in (records, bytes(self.ages[first : first + BLOCK])):
                hashes += xxh3_64(part).to_bytes(8, "little")
        return xxh3_64(hashes)

    def begin(self, spawned, dead):
        """A frame's lifecycle: these slots have no record now."""
        for slot in spawned | dead:
            self.records[slot] = list(self.nothing)
            self.ages[slot] = 0

    def end(self, alive, young):
        """The frame is over; `young`: slots that were spawned, or changed."""
        for slot, lives in enumerate(alive):
            self.ages[slot] = 0 if slot in young or not lives else min(self.ages[slot] + 1, 254)

    def step(self, reader, kind, index, before):
        """A number that moves on from `before`, by a kind of numbers."""
        step, half = reader.number(kind), 1 << (self.bits[index] - 1)
        require(-half <= step < half, "data", f"a step of {step} in {2 * half} values")
        return (before + step) % (2 * half)

    def read_section(self, body, alive):
        """Section 0x8b, behind begin(): the slots that change."""
        reader = NumberDecoder(body.rest(), "data")
        changed, any_before = set(), False
        for first in range(0, len(alive), BLOCK):
            living = [slot for slot in range(first, min(first + BLOCK, len(alive))) if alive[slot]]
            if not living:
                continue
            any_before = reader.decide(self.models.any[any_before])
            before, some = False, False
            for slot in living if any_before else ():
                before = reader.decide(self.models.changed[2 * bucket(self.ages[slot]) + before])
                if before:
                    self.read_record(reader, slot)
                    changed.add(slot)
                    some = True
            require(some == any_before, "data", "a block that changes, and no body of it does")
        require(changed, "data", "a section in which no body changes")
        reader.end()
        return changed

    def read_record(self, reader, slot):
        """The fields of a body that change."""
        record, first, earlier = self.records[slot], 0, False
        for index, (_, kind) in enumerate(self.fields):
            count = 4 if kind == "rgba" else 1
            must = index == len(self.fields) - 1 and not earlier
            if must or reader.decide(self.models.fields[2 * index + earlier]):
                before = record[first : first + count]
                for i in range(first, first + count):
                    record[i] = self.step(reader, self.models.numbers[i], i, record[i])
                require(record[first : first + count] != before, "data", "a field that changes by nothing")
                earlier = True
            first += count

    def read_all(self, body, alive):
        """The section of a snapshot."""
        reader = NumberDecoder(body.rest(), "data")
        living = [slot for slot, lives in enumerate(alive) if lives]
        for index in range(len(self.bits)):
            kind, value = NumberModels(), 0
            for slot in living:
                value = self.records[slot][index] = self.step(reader, kind, index, value)
        kind, age = NumberModels(), 0
        for slot in living:
            age += reader.number(kind)
            require(0 <= age <= 254, "data", f"an age of {age}")
            self.ages[slot] = age
        for model in self.models.each():
            model.seen = reader.even_bits(7)
            if model.seen != 1:
                model.p = reader.even_bits(16)
            require(model.seen and model.p, "data", "an impossible model")
        reader.end()


def start_data(stream):
    """The data of a stream at its start; None without fields."""
    return Data(stream.data, stream.capacity) if stream.data else None
