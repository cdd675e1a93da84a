"""What stands beside motion: keys and events, data of bodies."""

import unittest

import worlds
import writer
from news_vectors import FIELDS, record
from refusals import RefusalCase
from tandem_reference import payload, snapshot
from tandem_reference.xxh3 import xxh3_64

BODIES = {slot: ((9, 9, 9), (8, 8, 8)) for slot in (0, 2, 3)}


def u64(value):
    return value.to_bytes(8, "little")


def keys(*records):
    return writer.section(0x8C, b"".join(writer.key(*record) for record in records))


def events(*records):
    return writer.section(0x8D, b"".join(writer.event(*record) for record in records))


class News(RefusalCase):
    def setUp(self):
        self.stream = worlds.stream(features=["events", "keys"])
        self.before = worlds.world(self.stream, {2: ((9, 9, 9), (8, 8, 8))})

    def apply(self, data):
        return payload.apply_delta(self.before, self.stream, data)

    def test_the_world_hash_by_hand(self):
        self.assertEqual(self.before.news.hash(), xxh3_64(u64(0) + u64(0) + u64(xxh3_64(b""))))
        after = self.apply(keys((b"a", b"1")) + events((5, b"x", (3, 7)), (6,)))
        body = bytes.fromhex("05 04 07 01 78 06 00 00")
        hash_of_keys = xxh3_64(b"\1a" + bytes.fromhex("01000000") + b"1")
        world = xxh3_64(u64(xxh3_64(u64(0) + body)) + u64(2) + u64(hash_of_keys))
        self.assertEqual(after.news.hash(), world)
        self.assertEqual(after.hash(), xxh3_64(u64(after.state.leaves_hash()) + u64(world)))
        self.assertEqual(self.before.news.count, 0)

    def test_a_snapshot_holds_them(self):
        line = worlds.timeline(self.stream, {2: ((9, 9, 9), (8, 8, 8))})
        line.world = payload.apply_delta(line.world, self.stream, keys((b"a", b"1"), (b"b", b"")) + events((1,)))
        cut = snapshot.read(writer.snapshot(line), self.stream)
        self.assertEqual(cut.world.news, line.world.news)
        plain = worlds.stream()
        self.refused("critical", snapshot.read, writer.snapshot(line), plain)
        self.refused("snapshot", snapshot.read, writer.snapshot(worlds.timeline(plain)), self.stream)

    def test_keys_come_change_and_go(self):
        self.before = self.apply(keys((b"a", b"1"), (b"b", b"2")))
        self.assertEqual(self.apply(keys((b"a", b""), (b"b", None))).news.keys, {b"a": b""})

    def test_what_is_refused(self):
        for rule, bad in (
            ("order", events((1,)) + keys((b"a", b""))),
            ("order", events((1,)) * 2),
            ("order", writer.section(0x82, writer.parameters({4: 0})) + keys((b"a", b""))),
            ("keys", keys()),
            ("keys", keys((b"", b""))),
            ("keys", keys((b"\n", b""))),
            ("keys", keys((b"a" * 65, b""))),
            ("keys", keys((b"b", b""), (b"a", b""))),
            ("keys", keys((b"a", b""), (b"a", b""))),
            ("keys", keys((b"a", None))),
            ("keys", keys((b"a", bytes(65536)))),
            ("keys", keys(*((b"%03d" % i, b"") for i in range(257)))),
            ("length", keys((b"a", b"12"))[:-1]),
            ("length", writer.section(0x8C, b"\1a\3b")),
            ("events", events()),
            ("events", events((2**32,))),
            ("events", events((1, b"", (8, 0)))),
            ("events", events((1, bytes(1025)))),
            ("events", events(*[(1,)] * 65)),
            ("events", events(*[(1, bytes(1024))] * 16)),
            ("length", writer.section(0x8D, b"\1\0\1")),
        ):
            with self.subTest(bytes=bad[:20].hex()):
                self.refused(rule, self.apply, bad)
        self.stream = worlds.stream(features=["keys"])
        self.before = worlds.world(self.stream)
        self.refused("critical", self.apply, events((1,)))
        self.refused("session", lambda: worlds.stream(features=["keys", "events"]))

    def test_features_are_a_line_of_the_layout(self):
        self.assertIn("lead 0\nfeatures events keys\ngroups position\n", self.stream.layout_text())


class Data(RefusalCase):
    def setUp(self):
        self.stream = worlds.stream(data=FIELDS)
        self.before = worlds.world(self.stream, BODIES)

    def apply(self, data):
        return payload.apply_delta(self.before, self.stream, data)

    def section(self, changes, alive=None):
        alive = self.before.state.alive if alive is None else alive
        return writer.section(0x8B, writer.data(self.before.data, changes, alive))

    def test_every_value_is_told_to_the_bit(self):
        for after in (record(255), record(heat=float("nan")), record(heat=-0.0), record(colour=(1, 0, 255, 9)), record(score=-1)):
            told = self.apply(self.section({2: after}))
            self.assertEqual(told.data.bytes_of(told.data.records[2]), after)
            self.assertEqual(told.data.records[0], told.data.nothing)
            self.assertEqual(told.data.ages, [1, 0, 0, 1, 0, 0, 0, 0])

    def test_the_hash_by_hand(self):
        after = self.apply(self.section({2: record(7)}))
        records = bytes(2 * 11) + record(7) + bytes(5 * 11)
        expected = xxh3_64(u64(xxh3_64(records)) + u64(xxh3_64(bytes([1, 0, 0, 1, 0, 0, 0, 0]))))
        self.assertEqual(after.data.hash(), expected)
        self.assertEqual(after.hash(), xxh3_64(u64(after.state.leaves_hash()) + u64(expected)))
        self.assertEqual(self.before.data.ages, [0] * 8)

    def test_a_snapshot_holds_them(self):
        line = worlds.timeline(self.stream, BODIES)
        line.world = payload.apply_delta(line.world, self.stream, self.section({0: record(3, 1.5), 3: record(4)}))
        self.assertEqual(snapshot.read(writer.snapshot(line), self.stream).world.data, line.world.data)
        plain = worlds.stream()
        self.refused("critical", snapshot.read, writer.snapshot(line), plain)
        self.refused("snapshot", snapshot.read, writer.snapshot(worlds.timeline(plain)), self.stream)

    def test_births_and_deaths_begin_with_zeros(self):
        self.before = self.apply(self.section({0: record(3), 2: record(4)}))
        born = b"\1\0" + writer.position((1, 1, 1), (0, 0, 0))
        after = self.apply(writer.section(0x81, writer.record(0, 0) + writer.record(0, 1, born) + writer.record(2, 0)))
        self.assertEqual(after.data.records[0], after.data.nothing)
        self.assertEqual(after.data.records[2], after.data.nothing)
        self.assertEqual(after.data.ages, [0, 0, 0, 2, 0, 0, 0, 0])

    def test_what_is_refused(self):
        good = self.section({2: record(1)})
        for rule, bad in (
            ("order", good * 2),
            ("order", writer.section(0x82, writer.parameters({4: 0})) + good),
            ("data", self.section({})),
            ("data", self.section({2: record()})),
            ("data", writer.section(0x8B, b"\1\0")),
            ("data", writer.section(0x8B, writer.data(self.before.data, {2: record(1)}, self.before.state.alive) + b"\1" * 9)),
            ("critical", writer.section(0x8F, b"")),
        ):
            with self.subTest(bytes=bad[:20].hex()):
                self.refused(rule, self.apply, bad)
        plain = worlds.stream()
        self.refused("critical", payload.apply_delta, worlds.world(plain), plain, good)

    def test_fields_are_a_line_of_the_layout(self):
        line = "data health:u8 heat:f32 colour:rgba score:i16"
        self.assertIn(f"lead 0\n{line}\ngroups position data\n", self.stream.layout_text())
        for bad in ([("a", "u8")] * 2, [("A", "u8")], [("a", "u64")], [(f"a{i}", "u32") for i in range(5)], [("", "u8")]):
            self.refused("session", lambda bad=bad: worlds.stream(data=bad))


if __name__ == "__main__":
    unittest.main()
