"""The test vector of keys and events."""

import worlds
import writer
from vector_text import Vector


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


def vectors():
    """By name."""
    return {"news": news()}
