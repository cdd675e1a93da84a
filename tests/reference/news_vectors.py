"""The test vectors of what stands beside motion: keys and events, data of bodies."""

import struct

import worlds
import writer
from vector_text import Vector

FIELDS = [("health", "u8"), ("heat", "f32"), ("colour", "rgba"), ("score", "i16")]


def keys(*records):
    """A section of keys."""
    return writer.section(0x8C, b"".join(writer.key(*record) for record in records))


def events(*records):
    """A section of events."""
    return writer.section(0x8D, b"".join(writer.event(*record) for record in records))


def news():
    """Keys and events in payloads and in a snapshot."""
    bodies = {slot: ((slot * 1000, 0, -slot), (64, 0, 0)) for slot in (0, 3)}
    line = worlds.timeline(worlds.stream("quantized", capacity=4, features=["events", "keys"]), bodies)
    vector = Vector("keys and events: part of the state hash, and of a snapshot", line)
    vector.predict()
    vector.say("two keys, an event about slot 3, in front of corrections")
    told = keys((b"phase", b"play"), (b"score", b"")) + events((7, b"goal", (3, 255)), (2**32 - 1,))
    vector.delta(told + writer.section(0x83, bytes.fromhex("00 01 01 010203 040506")))
    vector.delta(keys((b"phase", b"over"), (b"score", None)))
    vector.predict()
    vector.say("behind a section that may be skipped")
    vector.delta(writer.section(0x11, b"skip") + events((7,)))
    vector.snapshot(writer.snapshot(line))
    vector.refuse(events((1,)) + keys((b"a", b"")), "events before keys")
    vector.refuse(keys((b"score", None)), "a key goes that is not there")
    vector.refuse(keys((b"b", b""), (b"a", b"")), "keys that do not ascend")
    vector.refuse(keys((b"a\n", b"")), "a control character")
    vector.refuse(keys(*((b"%03d" % i, b"") for i in range(256))), "257 keys")
    vector.refuse(keys(), "no key")
    vector.refuse(events((1, b"", (4, 0))), "a slot that the session does not have")
    vector.refuse(events(*[(1,)] * 65), "65 events")
    vector.refuse(events((1, bytes(1025))), "1,025 bytes")
    vector.refuse(writer.section(0x8E, bytes(16)), "a section of snapshots")
    return vector


def record(health=0, heat=0.0, colour=(0, 0, 0, 0), score=0):
    """The bytes of a body's record."""
    return struct.pack("<Bf4Bh", health, heat, *colour, score)


def data():
    """Data in payloads and in a snapshot, over births and deaths."""
    bodies = {slot: ((slot * 1000, 0, -slot), (64, 0, 0)) for slot in (0, 3, 4, 7)}
    line = worlds.timeline(worlds.stream("quantized", capacity=9, data=FIELDS), bodies)
    vector = Vector("data of bodies: part of the state hash, and of a snapshot", line)

    def section(changes, alive=None):
        now = line.world.state.alive if alive is None else alive
        return writer.section(0x8B, writer.data(line.world.data, changes, now))

    vector.predict()
    vector.say("three of four bodies, in front of a change of type")
    told = {0: record(9), 3: record(0, -1.5, (255, 0, 1, 128)), 7: record(255, float("nan"), (1, 2, 3, 4), -32768)}
    vector.delta(section(told) + writer.section(0x81, writer.record(0, 3, b"\1")))
    vector.predict()
    vector.say("no change: all grow older")
    vector.delta(b"")
    vector.predict()
    vector.say("one field, by wrapping over; behind a section that may be skipped")
    vector.delta(writer.section(0x11, b"skip") + section({7: record(0, float("nan"), (1, 2, 3, 4), -32768)}))
    vector.snapshot(writer.snapshot(line))
    vector.predict()
    vector.say("slot 3 dies, slot 4 dies and is used anew, slot 5 is born with data: its record was zeros")
    born = b"\1\0" + writer.position((5, 5, 5), (0, 0, 0))
    lifecycle = writer.section(
        0x81, writer.record(3, 0) + writer.record(1, 0) + writer.record(0, 1, born) + writer.record(1, 1, born)
    )
    alive = [slot in (0, 4, 5, 7) for slot in range(9)]
    vector.delta(section({0: record(10), 5: record(7)}, alive) + lifecycle)
    vector.snapshot(writer.snapshot(line))
    good = section({0: record(11)})
    vector.refuse(writer.section(0x8B, b"\1\0"), "a zero at the end")
    vector.refuse(good + good, "two sections")
    vector.refuse(writer.section(0x8F, b""), "a section of snapshots")
    vector.refuse(lifecycle[:2] + lifecycle[2:] + good, "data behind the lifecycle")
    vector.refuse(writer.section(0x8B, writer.data(line.world.data, {}, alive)), "no body changes")
    vector.refuse(writer.section(0x8B, writer.data(line.world.data, {0: record(10)}, alive)), "a change by nothing")
    vector.refuse(good[:1] + bytes([good[1] + 9]) + good[2:] + b"\1" * 9, "bytes behind the code")
    return vector


def vectors():
    """By name."""
    return {"news": news(), "data": data()}
