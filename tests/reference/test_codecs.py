"""Tests the thesis's codecs."""

import struct
import unittest

import numpy as np
import worlds
import writer
from refusals import RefusalCase
from tandem_reference import huffman, payload, turn


class CodecCase(RefusalCase):
    def world(self, codec, slots=(1, 2, 6), tables=b"", capacity=8):
        self.stream = worlds.stream(codec, tables=tables, capacity=capacity)
        self.before = worlds.world(self.stream, {slot: ((slot, 0, 0), (0, slot, 0)) for slot in slots})
        self.before.state.c[:], self.before.state.rest[list(slots)] = 0, 1
        self.before.state.c[0, list(slots)] = 77

    def apply(self, body):
        return payload.apply_delta(self.before, self.stream, writer.section(0x83, body)).state


class Selections(CodecCase):
    def setUp(self):
        self.world("quantized")

    def moved(self, body, count):
        """The slots that lost their rest; six bytes each are added."""
        state = self.apply(body + bytes([1, 0, 0, 0, 0, 0]) * count)
        return [slot for slot in range(8) if state.alive[slot] and not state.rest[slot]]

    def test_three_forms(self):
        self.assertEqual(self.moved(bytes.fromhex("00 00 0200 0100 0600"), 2), [1, 6])
        self.assertEqual(self.moved(bytes.fromhex("00 01 44"), 2), [2, 6])
        self.assertEqual(self.moved(bytes.fromhex("00 02"), 3), [1, 2, 6])

    def test_the_second_block_counts_from_its_start(self):
        self.world("quantized", slots=(3, 16385), capacity=16390)
        state = self.apply(bytes.fromhex("01 01 02 010000000000"))
        self.assertEqual(state.p[0, [3, 16385]].tolist(), [3, 16388])

    def test_what_is_refused(self):
        six = bytes(6)
        for rule, bad in (
            ("selection", bytes.fromhex("00 00 0000")),
            ("selection", bytes.fromhex("00 00 0200 0200 0100") + six + six),
            ("selection", bytes.fromhex("00 00 0200 0200 0200") + six + six),
            ("selection", bytes.fromhex("00 00 0100 0800") + six),
            ("selection", bytes.fromhex("00 00 0100 0300") + six),
            ("selection", bytes.fromhex("00 01 00")),
            ("selection", bytes.fromhex("00 01 08") + six),
            ("selection", bytes.fromhex("00 03")),
            ("length", bytes.fromhex("00 00 0100 0200") + six[:5]),
            ("length", bytes.fromhex("00 00 0100 0200") + six + b"\0"),
        ):
            with self.subTest(bytes=bad.hex()):
                self.refused(rule, self.apply, bad)

    def test_unused_bits_of_a_mask_are_zero(self):
        self.world("quantized", slots=(1,), capacity=5)
        self.refused("padding", self.apply, bytes.fromhex("00 01 22") + bytes(6))

    def test_all_of_nothing_is_refused(self):
        self.world("quantized", slots=())
        self.refused("selection", self.apply, bytes.fromhex("00 02"))


class Values(CodecCase):
    def test_absolute_values(self):
        for codec in ("none", "selective"):
            self.world(codec)
            state = self.apply(bytes.fromhex("00 00 0100 0200") + struct.pack("<6i", 1, -2, 2**30, 3, -4, -(2**28)))
            self.assertEqual(state.p[:, 2].tolist(), [1, -2, 2**30])
            self.assertEqual(state.v[:, 2].tolist(), [3, -4, -(2**28)])
            self.assertEqual((state.c[0, 1], state.c[0, 2], state.rest[1], state.rest[2]), (77, 0, True, False))
            for bad in ((2**30 + 1, 0), (0, -(2**28) - 1)):
                far = bytes.fromhex("00 00 0100 0200") + struct.pack("<6i", bad[0], 0, 0, bad[1], 0, 0)
                self.refused("values", self.apply, far)

    def test_residuals_are_steps_and_leave_c(self):
        self.world("quantized")
        state = self.apply(bytes.fromhex("00 01 04 80 7f 00 00 01 ff"))
        self.assertEqual(state.p[:, 2].tolist(), [2 - 128 * 3, 127 * 3, 0])
        self.assertEqual(state.v[:, 2].tolist(), [0, 2 + 5, -5])
        self.assertEqual(state.c[:, 2].tolist(), [77, 0, 0])

    def test_sums_are_clamped(self):
        self.world("quantized")
        self.before.state.p[0, 2], self.before.state.v[2, 2] = -(2**30), 2**28
        state = self.apply(bytes.fromhex("00 01 04 80 00 00 00 00 7f"))
        self.assertEqual((state.p[0, 2], state.v[2, 2]), (-(2**30), 2**28))


class Turns(CodecCase):
    """Values of bodies with orientations."""

    def turning(self, codec, tables=b""):
        self.stream = worlds.stream(codec, tables=tables, turns=True)
        self.before = worlds.world(self.stream, {2: ((0, 0, 0), (0, 0, 0))})
        self.before.state.w[:, 2] = 10, 20, 30

    def test_absolute_values_have_orientations(self):
        for codec in ("none", "selective"):
            self.turning(codec)
            numbers = [1, 2, 3, 4, 5, 6, 0, turn.ONE, 0, 0, 7, -8, turn.MOST_W - 9]
            state = self.apply(bytes.fromhex("00 02") + struct.pack("<13i", *numbers))
            self.assertEqual([*state.p[:, 2], *state.v[:, 2], *state.q[:, 2], *state.w[:, 2]], numbers)
            self.refused("length", self.apply, bytes.fromhex("00 02") + struct.pack("<6i", *numbers[:6]))
            for at, bad in ((7, 0), (7, turn.ONE + 1), (6, turn.ONE), (10, turn.MOST_W), (12, -(2**31))):
                broken = [*numbers[:at], bad, *numbers[at + 1 :]]
                self.refused("values", self.apply, bytes.fromhex("00 02") + struct.pack("<13i", *broken))

    def test_residuals_turn_and_change_w(self):
        self.turning("quantized")
        state = self.apply(bytes.fromhex("00 02 010000 000000 00007f 80ff01"))
        by = np.array([[0], [0], [127 * worlds.TURN_PARAMETERS[7]]])
        self.assertEqual(state.q[:, 2].tolist(), turn.turned(self.before.state.q[:, [2]], by)[:, 0].tolist())
        step = worlds.TURN_PARAMETERS[8]
        self.assertEqual(state.w[:, 2].tolist(), [10 - 128 * step, 20 - step, 30 + step])
        self.assertEqual(state.p[:, 2].tolist(), [3, 0, 0])

    def test_what_leads_out_of_range_is_halved_together(self):
        self.turning("quantized")
        self.before.parameters.update({7: 2**24, 8: 2**24})
        self.before.state.w[:, 2] = 0, 1, turn.MOST_W
        state = self.apply(bytes.fromhex("00 02 000000 000000 804000 800004"))
        # w would be (-2^31, 1, 2^29 + 2^26): three halvings
        self.assertEqual(state.w[:, 2].tolist(), [-(2**28), 0, (2**29 + 2**26) >> 3])
        by = np.array([[-(2**28)], [2**27], [0]])
        twice = turn.turned(turn.turned(self.before.state.q[:, [2]], by), by)
        self.assertEqual(state.q[:, 2].tolist(), twice[:, 0].tolist())

    def test_each_vector_has_a_table(self):
        flat, steep = bytes([8]) * 256, worlds.huffman_lengths()
        self.turning("limited", steep + flat + flat + steep)
        # p 0 1 -1; v 1 -1 0 and r -128 0 2 of flat tables; w 0 0 1
        bits = "0 100 101 00000001 11111111 00000000 10000000 00000000 00000010 0 0 100".replace(" ", "")
        bits += "0" * (-len(bits) % 8)
        data = int(bits, 2).to_bytes(len(bits) // 8, "big")
        state = self.apply(b"\0\2" + data)
        self.assertEqual(state.p[:, 2].tolist(), [0, 3, -3])
        self.assertEqual(state.v[:, 2].tolist(), [5, -5, 0])
        self.assertEqual(state.w[:, 2].tolist(), [10, 20, 30 + worlds.TURN_PARAMETERS[8]])
        by = np.array([[-128], [0], [2]]) * worlds.TURN_PARAMETERS[7]
        self.assertEqual(state.q[:, 2].tolist(), turn.turned(self.before.state.q[:, [2]], by)[:, 0].tolist())
        self.refused("length", self.apply, b"\0\2" + data + b"\0")


class Huffman(CodecCase):
    def test_canonical_codes_by_hand(self):
        lengths = worlds.huffman_lengths()
        # 0: 0; 1: 100; -1 (index 255): 101; 2: 110000000; 3: ...001; -2 (index 254): ...010; then 4: 1100000110
        self.world("entropy", slots=(1, 2), tables=lengths + bytes([8]) * 256)
        # body 1: p 0 1 -1, v 1 -1 0 of the flat table; body 2: p 2 3 4, v 0 0 0
        bits = "0 100 101 00000001 11111111 00000000 110000000 110000001 1100000110" + " 00000000" * 3
        bits = bits.replace(" ", "")
        bits += "0" * (-len(bits) % 8)
        data = int(bits, 2).to_bytes(len(bits) // 8, "big")
        state = self.apply(b"\0\2" + data)
        self.assertEqual(state.p[:, 1].tolist(), [1, 3, -3])
        self.assertEqual(state.v[:, 1].tolist(), [5, 1 - 5, 0])
        self.assertEqual(state.p[:, 2].tolist(), [2 + 6, 9, 12])
        self.refused("length", self.apply, b"\0\2" + data + b"\0")
        self.refused("length", self.apply, b"\0\2" + data[:-1])
        self.assertNotEqual(len(bits.rstrip("0")) % 8, 0)
        self.refused("padding", self.apply, b"\0\2" + data[:-1] + bytes([data[-1] | 1]))

    def test_all_codes_are_different_and_none_begins_another(self):
        table = huffman.Table(worlds.huffman_lengths())
        codes = sorted(format(code, f"0{length}b") for length, code in table.residual_of)
        self.assertEqual(len(codes), 256)
        self.assertFalse(any(b.startswith(a) for a, b in zip(codes, codes[1:])))


if __name__ == "__main__":
    unittest.main()
