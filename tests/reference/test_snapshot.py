"""Snapshots."""

import unittest

import numpy as np
import worlds
import writer
from refusals import RefusalCase
from tandem_reference import predict, snapshot
from tandem_reference.reader import Reader
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
        self.region = xxh3_64(u64(leaf0) + u64(leaf1))
        self.state = xxh3_64(u64(self.region))

    def bytes(self, alive="02", reuse="0002", inputs="", tail=b""):
        """The snapshot, or one with a fault."""
        head = b"TDSP\1" + u64(11) + bytes.fromhex("02000000 03000000") + u64(40) + u64(9)
        head += bytes.fromhex("01000000 ffffffff 00000000 c800") + u64(self.state) + bytes.fromhex("03000000")
        values = bytes.fromhex("820e 01c801 0206 030a 04c00c 0500 0600")
        region = b"\0" + u64(self.region) + bytes.fromhex(alive + reuse + "000100 0001")
        region += b"".join(bytes([0]) + value.to_bytes(4, "little", signed=True) for value in (1, -2, 3)) + bytes(30)
        return head + values + bytes.fromhex(inputs) + writer.section(0x85, region + tail)

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
            ("snapshot", good[:79]),  # no region
            ("order", good[:63] + good[79:] + good[63:79]),
            ("padding", self.bytes(alive="0a")),
            ("hash", self.bytes(reuse="0003")),
            ("hash", good[:51] + bytes(8) + good[59:]),
            ("snapshot", self.bytes(reuse="2102" + "00" * 5)),  # 33 bits
            ("length", self.bytes(tail=b"\0")),
            ("length", good[:-1]),
            ("length", good[:50]),
        ):
            with self.subTest(rule=rule, size=len(bad)):
                self.refused(rule, snapshot.read, bad, self.stream)


class Runs(RefusalCase):
    def test_widths_and_least_values(self):
        body = Reader(bytes.fromhex("03 feff ffff 0e00"), "test")  # 3 bits: 0, 3, 4 -> 000 011 10|0
        self.assertEqual(snapshot.read_run(body, 4, True, 3).tolist(), [-2, 1, 2])
        wide = Reader(bytes.fromhex("20 00000080 ffffffff 00000000"), "test")
        self.assertEqual(snapshot.read_run(wide, 4, True, 2).tolist(), [2**31 - 1, -(2**31)])
        flat = Reader(bytes.fromhex("00 07"), "test")
        self.assertEqual(snapshot.read_run(flat, 1, False, 64).tolist(), [7] * 64)

    def test_a_value_beyond_its_type_and_unused_bits_are_refused(self):
        self.refused("snapshot", snapshot.read_column, Reader(bytes.fromhex("08 01 ff"), "test"), 1, False, 1)
        self.refused("padding", snapshot.read_column, Reader(bytes.fromhex("04 01 f1"), "test"), 1, False, 1)

    def test_columns_have_runs_of_64(self):
        values = np.arange(200) ** 2 - 20000
        read = snapshot.read_column(Reader(writer.column(values, 4, True), "test"), 4, True, 200)
        self.assertEqual(read.tolist(), values.tolist())


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
