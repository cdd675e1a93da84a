"""Sections and lifecycle."""

import unittest

import worlds
import writer
from refusals import RefusalCase
from tandem_reference import payload

P, V = (1, -2, 3), (4, 5, -6)
PLACE = writer.position(P, V)


def records(*records):
    return writer.section(0x81, b"".join(records))


class Lifecycle(RefusalCase):
    def setUp(self):
        self.stream = worlds.stream()
        self.before = worlds.world(self.stream, {2: ((9, 9, 9), (8, 8, 8)), 5: ((7, 7, 7), (6, 6, 6))})
        self.before.state.c[:, 2], self.before.state.rest[2], self.before.state.reuse[2] = (1, 2, 3), 1, 40

    def apply(self, data):
        return payload.apply_delta(self.before, self.stream, data).state

    def slot(self, state, slot):
        scalars = int(state.alive[slot]), int(state.reuse[slot]), int(state.type[slot]), int(state.rest[slot])
        return *scalars, state.p[:, slot].tolist(), state.v[:, slot].tolist(), state.c[:, slot].tolist()

    def test_an_empty_delta_changes_nothing(self):
        self.assertEqual(self.apply(b"").hash(), self.before.state.hash())

    def test_a_despawn_zeroes_the_slot(self):
        zero = [0, 0, 0]
        self.assertEqual(self.slot(self.apply(bytes.fromhex("810108")), 2), (0, 0, 0, 0, zero, zero, zero))

    def test_a_spawn_sets_everything(self):
        state = self.apply(bytes.fromhex("811b 0d 07 01") + PLACE)
        self.assertEqual(self.slot(state, 3), (1, 7, 1, 0, list(P), list(V), [0, 0, 0]))

    def test_a_teleport_wakes_and_clears_c(self):
        state = self.apply(bytes.fromhex("811a 0a 01") + PLACE)
        self.assertEqual(self.slot(state, 2), (1, 40, 0, 0, list(P), list(V), [0, 0, 0]))

    def test_a_type_change_wakes_nobody(self):
        state = self.apply(bytes.fromhex("8102 0b 01"))
        self.assertEqual(self.slot(state, 2), (1, 40, 1, 1, [9, 9, 9], [8, 8, 8], [1, 2, 3]))

    def test_despawn_and_spawn_of_one_slot(self):
        state = self.apply(records(writer.record(2, 0), writer.record(0, 1, b"\x29\1", PLACE), writer.record(3, 0)))
        self.assertEqual(self.slot(state, 2), (1, 41, 1, 0, list(P), list(V), [0, 0, 0]))
        self.assertFalse(state.alive[5])

    def test_rounding_goes_to_the_nearest_multiple_and_leaves_rest_alone(self):
        state = self.apply(writer.section(0x87, bytes([2, 2, 1])))
        self.assertEqual(self.slot(state, 2), (1, 40, 0, 1, [8, 8, 8], [8, 8, 8], [1, 2, 3]))
        self.assertEqual(self.slot(state, 5), (1, 0, 0, 0, [8, 8, 8], [8, 8, 8], [0, 0, 0]))

    def test_what_is_refused(self):
        far = writer.position((2**30 + 1, 0, 0), V)
        despawn = writer.record(2, 0)
        fast = writer.position(P, (0, 0, -(2**28) - 1))
        for rule, bad in (
            ("lifecycle", records(writer.record(3, 0))),  # despawn of a dead slot
            ("lifecycle", records(writer.record(2, 1, b"\0\0", PLACE))),  # spawn where one lives
            ("lifecycle", records(writer.record(3, 2, b"\1", PLACE))),  # teleport of a dead slot
            ("lifecycle", records(writer.record(3, 3, b"\1"))),  # type change of a dead slot
            ("lifecycle", records(writer.record(8, 1, b"\0\0", PLACE))),  # beyond the capacity
            ("lifecycle", records(writer.record(3, 1, b"\0\2", PLACE))),  # unknown type
            ("lifecycle", records(writer.record(2, 2, b"\0"))),  # no group
            ("lifecycle", records(writer.record(2, 2, b"\3", PLACE))),  # a group that is not listed
            ("lifecycle", records(writer.record(2, 3, b"\1"), writer.record(0, 2, b"\1", PLACE))),
            ("lifecycle", records(writer.record(3, 1, b"\0\0", PLACE), writer.record(0, 0))),
            ("lifecycle", records(despawn, writer.record(0, 1, b"\0\0", PLACE), writer.record(0, 3, b"\1"))),
            ("values", records(writer.record(3, 1, b"\0\0", far))),
            ("values", records(writer.record(2, 2, b"\1", fast))),
            ("length", writer.section(0x81, b"")),
            ("length", bytes.fromhex("810208")),
            ("leb128", bytes.fromhex("81038880 00")),
            ("leb128", writer.section(0x81, writer.record(3, 1, b"\0\x81\x80\x80\0", PLACE))),
        ):
            with self.subTest(bytes=bad.hex()):
                self.refused(rule, self.apply, bad)


class Orientations(RefusalCase):
    Q, W = (2**29, -(2**29), 2**29, 2**29), (0, 0, -(2**29))
    TURN = writer.orientation(Q, W)

    def setUp(self):
        self.stream = worlds.stream(turns=True)
        self.before = worlds.world(self.stream, {2: ((9, 9, 9), (8, 8, 8))})
        self.before.state.w[:, 2] = 7
        self.before.state.c[:, 2], self.before.state.rest[2] = 3, 1

    def apply(self, data):
        return payload.apply_delta(self.before, self.stream, data).state

    def slot(self, state, slot):
        return [tuple(rows[:, slot].tolist()) for rows in (state.p, state.v, state.q, state.w)]

    def test_a_spawn_holds_both_groups(self):
        state = self.apply(bytes.fromhex("8137 0d 07 01") + PLACE + self.TURN)
        self.assertEqual(self.slot(state, 3), [P, V, self.Q, self.W])

    def test_a_teleport_sets_the_groups_that_it_names(self):
        old = self.slot(self.before.state, 2)
        for groups, content, expected in (
            (b"\1", PLACE, [P, V, *old[2:]]),
            (b"\2", self.TURN, [*old[:2], self.Q, self.W]),
            (b"\3", PLACE + self.TURN, [P, V, self.Q, self.W]),
        ):
            with self.subTest(groups=groups):
                state = self.apply(records(writer.record(2, 2, groups, content)))
                self.assertEqual(self.slot(state, 2), expected)
                self.assertEqual((state.rest[2], state.c[:, 2].tolist()), (False, [0, 0, 0]))

    def test_a_despawn_zeroes_the_orientation(self):
        self.assertFalse(self.apply(records(writer.record(2, 0))).q.any())

    def test_what_is_refused(self):
        half = 2**29
        for rule, bad in (
            ("length", records(writer.record(3, 1, b"\0\0", PLACE))),
            ("lifecycle", records(writer.record(2, 2, b"\0"))),
            ("lifecycle", records(writer.record(2, 2, b"\4", self.TURN))),
            ("lifecycle", records(writer.record(3, 2, b"\2", self.TURN))),
            ("values", records(writer.record(3, 1, b"\0\0", PLACE, writer.orientation((0, 0, 0, 0), self.W)))),
            ("values", records(writer.record(2, 2, b"\2", writer.orientation((half, half, half, 0), self.W)))),
            ("values", records(writer.record(2, 2, b"\2", writer.orientation(self.Q, (half, 0, 1))))),
        ):
            with self.subTest(bytes=bad.hex()):
                self.refused(rule, self.apply, bad)


class Sections(RefusalCase):
    def setUp(self):
        self.stream = worlds.stream("quantized")
        self.before = worlds.world(self.stream, {2: ((9, 9, 9), (8, 8, 8))})

    def apply(self, data):
        return payload.apply_delta(self.before, self.stream, data)

    def test_unknown_sections_are_skipped_anywhere(self):
        unknown = bytes.fromhex("01 02 ffff") + bytes.fromhex("7f00")
        data = unknown + bytes.fromhex("8102 0b01") + unknown + bytes.fromhex("8202 0400") + unknown
        after = self.apply(data)
        self.assertEqual((after.state.type[2], after.parameters[4]), (1, 0))
        self.assertEqual((self.before.state.type[2], self.before.parameters[4]), (0, 800))

    def test_parameters_hold_in_the_delta_that_carries_them(self):
        correction = writer.section(0x83, b"\0" + bytes.fromhex("02 01ff00 000002"))
        after = self.apply(writer.section(0x82, writer.parameters({2: 1000, 3: 50})) + correction)
        self.assertEqual(after.state.p[:, 2].tolist(), [1009, -991, 9])
        self.assertEqual(after.state.v[:, 2].tolist(), [8, 8, 108])

    def test_what_is_refused(self):
        change, correct = bytes.fromhex("8102 0b01"), bytes.fromhex("8308 00 02 010000 000000")
        for rule, bad in (
            ("critical", bytes.fromhex("8400")),
            ("critical", bytes.fromhex("ff00")),
            ("order", correct + change),
            ("order", change + change),
            ("order", bytes.fromhex("82020400") * 2),
            ("order", correct + bytes.fromhex("82020400")),
            ("order", correct + correct),
            ("corrections", bytes.fromhex("8308 01 02 010000 000000")),
            ("parameters", bytes.fromhex("8200")),
            ("length", bytes.fromhex("0103 0000")),
            ("length", bytes.fromhex("01")),
            ("leb128", bytes.fromhex("01 ffffffff 0f")),
        ):
            with self.subTest(bytes=bad.hex()):
                self.refused(rule, self.apply, bad)


if __name__ == "__main__":
    unittest.main()
