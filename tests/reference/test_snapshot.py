"""Snapshots."""

import unittest

import worlds
import writer
from refusals import RefusalCase
from tandem_reference import predict, snapshot
from tandem_reference.range_decoder import Model, NumberDecoder, NumberModels
from tandem_reference.xxh3 import xxh3_64


def u64(value):
    return value.to_bytes(8, "little")


class ByHand(RefusalCase):
    def setUp(self):
        self.stream = worlds.stream(capacity=3)
        # One body in slot 1: reuse 2, type 1, at rest, p = 1 -2 3, all else zero.
        leaf0 = xxh3_64(bytes.fromhex("000100 000200 0000 0100 0000 000100"))
        column = "00000000 {} 00000000"
        p = "".join(column.format(x) for x in ("01000000", "feffffff", "03000000"))
        leaf1 = xxh3_64(bytes.fromhex(p) + bytes(72))
        self.hash = xxh3_64(u64(leaf0) + u64(leaf1))
        self.state = xxh3_64(u64(self.hash))

    def bodies(self, reuse=2, kind=1, x=1):
        """The code stream of the body."""
        world = worlds.world(self.stream, {1: ((x, -2, 3), (0, 0, 0))})
        state = world.state
        state.reuse[1], state.type[1], state.rest[1] = reuse, kind, 1
        return writer.bodies(world)[8:]

    def bytes(self, stream=None, inputs="", tail=b""):
        """The snapshot, or one with a fault."""
        head = b"TDSP\3" + u64(11) + bytes.fromhex("02000000 03000000") + u64(40) + u64(9)
        head += bytes.fromhex("01000000 ffffffff 00000000 c800") + u64(self.state) + bytes.fromhex("03000000")
        values = bytes.fromhex("820e 01c801 0206 030a 04c00c 0500 0600")
        bodies = u64(self.hash) + (self.bodies() if stream is None else stream)
        return head + values + bytes.fromhex(inputs) + writer.section(0x85, bodies + tail)

    def test_every_field(self):
        cut = snapshot.read(self.bytes(), self.stream)
        self.assertEqual((cut.epoch, cut.stream, cut.generation, cut.frame, cut.last_input), (11, 2, 3, 40, 9))
        self.assertEqual(cut.drive, predict.Drive((1, -1, 0), 200))
        self.assertEqual(cut.world.parameters, {1: 100, 2: 3, 3: 5, 4: 800, 5: 0, 6: 0})
        state = cut.world.state
        self.assertEqual(state.alive.tolist(), [False, True, False])
        self.assertEqual((state.reuse[1], state.type[1], state.rest[1]), (2, 1, True))
        self.assertEqual(state.p[:, 1].tolist(), [1, -2, 3])

    def test_inputs_to_act(self):
        one = "0800000000000000 2900000000000000 05000000 00000000 fbffffff 0700"
        cut = snapshot.read(self.bytes(inputs="841e" + one), self.stream)
        self.assertEqual(cut.inputs, {8: (41, predict.Drive((5, 0, -5), 7))})
        for bad in (one.replace("29", "28"), one.replace("08", "0a", 1), one.replace("05000000", "01000010")):
            self.refused("snapshot", snapshot.read, self.bytes(inputs="841e" + bad), self.stream)
        self.refused("snapshot", snapshot.read, self.bytes(inputs="843c" + one + one), self.stream)
        self.refused("snapshot", snapshot.read, self.bytes(inputs="8400"), self.stream)

    def test_unknown_sections(self):
        cut = snapshot.read(self.bytes(inputs="0101ff"), self.stream)
        self.assertEqual(cut.frame, 40)
        self.refused("critical", snapshot.read, self.bytes(inputs="8600"), self.stream)
        self.refused("critical", snapshot.read, self.bytes(inputs="8100"), self.stream)

    def test_what_is_refused(self):
        good = self.bytes()
        for rule, bad in (
            ("snapshot", b"TDSQ" + good[4:]),
            ("snapshot", good[:4] + b"\2" + good[5:]),
            ("snapshot", good[:21] + b"\1" + bytes(6) + b"\x40" + good[29:]),  # frame beyond 2^62
            ("snapshot", good[:59] + b"\4" + good[60:]),  # another capacity
            ("snapshot", good[:63] + good[79:]),  # no parameters
            ("snapshot", good[:79]),  # no bodies
            ("order", good[:63] + good[79:] + good[63:79]),
            ("hash", self.bytes(self.bodies(reuse=3))),
            ("hash", good[:51] + bytes(8) + good[59:]),
            ("snapshot", self.bytes(self.bodies(kind=2))),
            ("snapshot", self.bytes(self.bodies(x=2**30 + 1))),
            ("snapshot", self.bytes(tail=b"\0")),
            ("snapshot", self.bytes(tail=b"\1" * 8)),
            ("length", good[:-1]),
            ("length", good[:50]),
        ):
            with self.subTest(rule=rule, size=len(bad)):
                self.refused(rule, snapshot.read, bad, self.stream)


class Numbers(unittest.TestCase):
    # some:      bound 7fffffff of ffffffff: below: 1; range 7fffffff
    # length:    five decisions 0: code - 7bffffff, range 04000000; or four and a 1: code - 77ffffff, range 04000000
    # sign:      bound 02000000: below: 1, negative
    # next of 2: bound 01000000
    def test_by_hand(self):
        for data, number in (("80", 0), ("7c", -1), ("7e", 1), ("7b", 2), ("7a", 3)):
            with self.subTest(number=number):
                decoder = NumberDecoder(bytes.fromhex(data))
                self.assertEqual(decoder.number(NumberModels()), number)
                decoder.end()

    def test_models_learn_fast_then_slowly(self):
        model = Model()
        model.learn(True)
        self.assertEqual((model.p, model.seen), (49152, 2))
        model.learn(False)
        self.assertEqual((model.p, model.seen), (49152 - 12288, 3))
        for _ in range(2000):
            model.learn(False)
        self.assertEqual((model.p, model.seen), (127, 127))

    def test_columns_of_every_kind(self):
        numbers = [0, 0, 5, -(2**29), 2**30, -(2**30), 17, 1, -1] + [i * i - 300 for i in range(60)]
        at_rest = [i % 3 == 0 for i in range(len(numbers))]
        for how in (snapshot.ZERO, snapshot.BEFORE, snapshot.HALF):
            for shift in (0, 1):
                values = [number >> shift << shift for number in numbers]
                encoder = writer.NumberEncoder()
                writer.column(encoder, values, how, at_rest)
                decoder = NumberDecoder(encoder.finish())
                read = snapshot.read_column(decoder, snapshot.Guess(how), at_rest, (-(2**30), 2**30))
                self.assertEqual(read, values)
                decoder.end()


class WithOrientations(RefusalCase):
    def setUp(self):
        self.stream = worlds.stream(turns=True)
        self.line = worlds.timeline(self.stream, {slot: ((slot, 0, 0), (0, 0, 0)) for slot in (1, 2, 5)})
        self.state = self.line.world.state

    def test_a_stream_in_mid_turn_carries_on_from_its_snapshot(self):
        self.state.w[:, 1], self.state.w[:, 5] = (1000, -(2**28), 5), (0, 2**29, 0)
        self.state.rest[2] = 1
        self.line.predict()
        cut = snapshot.read(writer.snapshot(self.line), self.stream)
        self.assertTrue((cut.world.state.q == self.state.q).all() and (cut.world.state.w == self.state.w).all())
        other = type(self.line).of_snapshot(self.stream, cut)
        self.line.predict()
        other.predict()
        self.assertEqual(other.world.state.hash(), self.state.hash())

    def test_what_no_state_may_hold_is_refused(self):
        for rows, values in (
            (self.state.q, (0, 0, 0, 0)),
            (self.state.q, (0, 0, 0, 2**29)),
            (self.state.q, (2**30 + 1, 0, 0, 0)),
            (self.state.w, (2**29, 1, 0)),
            (self.state.w, (0, 0, -(2**29) - 1)),
        ):
            before = rows[:, 2].copy()
            rows[:, 2] = values
            self.refused("snapshot", snapshot.read, writer.snapshot(self.line), self.stream)
            rows[:, 2] = before


class WithModels(RefusalCase):
    def test_a_tracker_stream_carries_on_from_its_snapshot(self):
        of = worlds.stream("tracker", capacity=100)
        line = worlds.timeline(of, {slot: ((slot, 0, 0), (0, 0, 0)) for slot in range(0, 100, 7)})
        for i in range(6):
            line.predict()
            line.apply(writer.tracker_section(line.world, 100, {7: [i, -1, 200], 14: [0, 1, 0]}))
        line.add_input(1, 9, predict.Drive((0, 1, 0), 1))
        line.last_input = 1
        data = writer.snapshot(line)
        cut = snapshot.read(data, of)
        self.assertEqual(cut.world.state.hash(), line.world.state.hash())
        self.assertTrue((cut.world.models.p == line.world.models.p).all())
        self.assertTrue((cut.world.models.weight == line.world.models.weight).all())
        self.assertEqual(cut.inputs, line.inputs)
        self.assertEqual(writer.snapshot(type(line).of_snapshot(of, cut)), data)

    def test_an_age_of_255_and_a_last_step_of_minus_128_are_refused(self):
        of = worlds.stream("tracker")
        for row, value in ((0, 255), (2, -128)):
            line = worlds.timeline(of, {1: ((0, 0, 0), (0, 0, 0))})
            line.world.state.codec[row, 1] = value
            self.refused("snapshot", snapshot.read, writer.snapshot(line), of)


if __name__ == "__main__":
    unittest.main()
