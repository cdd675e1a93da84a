"""State hash, layout hash and parameters."""

import unittest

import worlds
from tandem_reference import parameters, stream
from tandem_reference.errors import Refused
from tandem_reference.reader import Reader
from tandem_reference.state import State
from tandem_reference.xxh3 import xxh3_64


def u64(value):
    return value.to_bytes(8, "little")


class Hashes(unittest.TestCase):
    def test_one_slot_by_hand(self):
        state = State(1, "tracker")
        state.alive[0], state.reuse[0], state.type[0], state.rest[0] = 1, 2, 0x0304, 1
        state.codec[:, 0] = 5, 6, -1, 0, 127
        state.p[:, 0], state.v[:, 0], state.c[:, 0] = (1, -1, 2), (3, 4, 5), (6, 7, -8)
        leaf0 = xxh3_64(bytes.fromhex("01 02 0403 01 05 06 ff 00 7f"))
        leaf1 = xxh3_64(
            bytes.fromhex("01000000 ffffffff 02000000 03000000 04000000 05000000 06000000 07000000 f8ffffff")
        )
        self.assertEqual(state.leaves(0), [leaf0, leaf1])
        everything = xxh3_64(u64(leaf0) + u64(leaf1))
        self.assertEqual(state.hash(), xxh3_64(u64(everything)))

    def test_orientations_are_a_leaf_of_their_own(self):
        state = State(1, "none", True)
        state.alive[0] = 1
        state.q[:, 0], state.w[:, 0] = (1, -1, 2, 3), (4, 5, -6)
        orientation = xxh3_64(bytes.fromhex("01000000 ffffffff 02000000 03000000 04000000 05000000 faffffff"))
        self.assertEqual(state.leaves(0), [xxh3_64(b"\1\0\0\0\0"), xxh3_64(bytes(36)), orientation])
        state.clear(0)
        self.assertEqual(state.hash(), State(1, "none", True).hash())
        self.assertNotEqual(state.hash(), State(1, "none").hash())

    def test_columns_go_by_block(self):
        state = State(16385, "none")
        state.alive[[0, 16384]] = 1
        self.assertEqual(state.block_slots(1), (16384, 16385))
        self.assertEqual(state.leaves(1), [xxh3_64(b"\1\0\0\0\0"), xxh3_64(bytes(36))])
        leaves = state.leaves(0) + state.leaves(1)
        self.assertEqual(state.leaves_hash(), xxh3_64(b"".join(u64(leaf) for leaf in leaves)))

    def test_layout_text_of_the_specification(self):
        values = {1: 100, 2: 1, 3: 1, 4: 0, 5: 26214, 6: 9830}
        example = stream.Stream(10000, 2, "tracker", "ballistic", values, lattice_unit=2.0**-10, lead=1)
        self.assertEqual(
            example.layout_text(),
            "tandem-layout 4\ncapacity 10000\ntypes 2\nlattice_unit 3f50000000000000\nlead 1\n"
            "groups position\nradii\ncodec tracker\ncodec_tables 2d06800538d394c2\npredictor ballistic\n"
            "predictor_constants\nparameters 1=100 2=1 3=1 4=0 5=26214 6=9830\n",
        )


class Parameters(unittest.TestCase):
    def read(self, text):
        return parameters.read(Reader(bytes.fromhex(text), "test"), worlds.PARAMETERS)

    def test_id_and_zigzag_value(self):
        self.assertEqual(self.read("01c801 0400"), {1: 100, 4: 0})

    def test_what_is_refused(self):
        for bad in ("0000", "0702", "0100", "0101", "0202 0102", "0202 0202", "04808008"):
            with self.subTest(bytes=bad), self.assertRaises(Refused) as caught:
                self.read(bad)
            self.assertEqual(caught.exception.rule, "parameters")

    def test_a_session_names_all_that_its_stream_lists(self):
        both = ["position", "orientation"]
        turning = {**worlds.PARAMETERS, **worlds.TURN_PARAMETERS}
        for codec, groups, named in (
            ("quantized", ["position"], worlds.PARAMETERS),
            ("tracker", both, worlds.PARAMETERS),
            ("selective", both, worlds.PARAMETERS),
            ("quantized", both, turning),
            ("entropy", both, turning),
            ("limited", both, turning),
        ):
            known = parameters.listed(codec, groups)
            self.assertEqual(parameters.complete(list(named.items()), known), named)
            for wrong in (turning if named is worlds.PARAMETERS else worlds.PARAMETERS, {**named, 9: 1}):
                with self.assertRaises(Refused):
                    parameters.complete(list(wrong.items()), known)
            with self.assertRaises(Refused):
                parameters.complete(list(named.items())[:5], known)

    def test_steps_of_turns_are_known_where_they_are_listed(self):
        turning = {**worlds.PARAMETERS, **worlds.TURN_PARAMETERS}
        self.assertEqual(parameters.read(Reader(bytes.fromhex("0702 0880808010"), "test"), turning), {7: 1, 8: 2**24})
        for bad in ("0700", "0802 0702", "0882808010", "0902"):
            with self.subTest(bytes=bad), self.assertRaises(Refused):
                parameters.read(Reader(bytes.fromhex(bad), "test"), turning)


class Sessions(unittest.TestCase):
    def test_streams_that_cannot_be_played_are_refused(self):
        for changes in (
            {"capacity": 0},
            {"codec": "other"},
            {"predictor": "other"},
            {"tables": bytes(512)},
            {"codec": "entropy"},
            {"codec": "limited", "tables": bytes([8]) * 511 + b"\7"},
            {"codec": "limited", "tables": bytes([9]) * 512},
            {"codec": "entropy", "tables": bytes([8]) * 1024},
            {"codec": "entropy", "tables": bytes([8]) * 512, "turns": True},
        ):
            with self.subTest(changes=changes), self.assertRaises(Refused) as caught:
                worlds.stream(**changes)
            self.assertEqual(caught.exception.rule, "session")

    def test_groups_and_the_radii_that_they_need(self):
        both = ["position", "orientation"]
        self.assertTrue(self.grouped(both, [1, 2**30]).orientation)
        self.assertFalse(self.grouped(["position"], []).orientation)
        self.assertIn("groups position orientation\nradii 7 8\n", self.grouped(both, [7, 8]).layout_text())
        for groups, radii in (
            ([], []),
            (["orientation"], [1, 1]),
            (["orientation", "position"], [1, 1]),
            (["position", "position"], []),
            ([*both, "orientation"], [1, 1]),
            (["position", "colour"], []),
            (["position"], [1, 1]),
            (both, []),
            (both, [1]),
            (both, [1, 1, 1]),
            (both, [0, 1]),
            (both, [1, 2**30 + 1]),
        ):
            with self.subTest(groups=groups, radii=radii), self.assertRaises(Refused) as caught:
                self.grouped(groups, radii)
            self.assertEqual(caught.exception.rule, "session")

    def grouped(self, groups, radii):
        return stream.Stream(8, 2, "none", "ballistic", dict(worlds.PARAMETERS), groups=groups, radii=radii)


if __name__ == "__main__":
    unittest.main()
