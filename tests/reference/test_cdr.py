"""XCDR version 1 from hand-made bytes."""

import unittest

import writer
from tandem_reference import cdr
from tandem_reference.errors import Refused


class Cdr(unittest.TestCase):
    def test_alignment_counts_from_behind_the_header(self):
        sample = bytes.fromhex(
            "00010000"
            "0100000000000000 0200000000000000 0300000000000000"  # epoch, number, frame
            "0400000000000000 0500000000000000"  # source client, source number
            "01000000 02000000 ffffffff 07000000"  # kind, two values
        )
        message = cdr.decode("TandemScheduledInput", sample)
        self.assertEqual([message.epoch, message.number, message.frame], [1, 2, 3])
        self.assertEqual([message.kind, message.values], [1, [-1, 7]])

    def test_padding_before_eight_bytes(self):
        sample = bytes.fromhex(
            "00010000"
            "0100000000000000 0200000000000000 03000000 04000000 05000000 00000000"  # 3 x u32, 4 bytes of padding
            "0600000000000000 0700000000000000"  # highest input, client's clock
            "0800000000000000 01000000 00000000"  # server's time, one entry, padding
            "0900000000000000 0a00000000000000 0b000000"
            "01000000 0900000000000000 02000000 7900"  # one text, "y"
        )
        reply = cdr.decode("TandemReply", sample)
        self.assertEqual([reply.role, reply.phase, reply.reason, reply.highest_input], [3, 4, 5, 6])
        self.assertEqual([(one.number, one.text) for one in reply.texts], [(9, "y")])
        self.assertEqual([reply.entries[0].number, reply.entries[0].frame, reply.entries[0].code], [9, 10, 11])

    def test_strings_and_nested_sequences(self):
        sample = bytes.fromhex(
            "00010000"
            "0100000000000000 01000000 10000000"  # epoch, version, capacity
            "0000000000003e40 000000000000a03f 000000000000503f"  # 30 Hz, 2^-5 s, 2^-10
            "0000000000000000 00000000000024c0 0000000000000000"  # gravity 0, -10, 0
            "01000000 01000000 18000000 00000000 00000000 00000000"  # up, lead, window, role, rank, padding
            "0200000000000000 0300000000000000"  # continued epoch and frame
            "0400000000000000 05000000"  # hash and bytes of a topology
            "02000000 6100 0000 01000000 00 000000 02000000 7800 0000"  # session "a", scene "", description "x"
            "01000000 0000003f ff0000ff 01000000 02000000 6200 0000 00000000"  # one type "b", no values
            "00000000"  # no streams
            "01000000 07000000 02000000 02000000 6300 0000"  # one name, of slot 7 and reuse 2: "c"
            "01000000 02000000 6400 0000 01000000 06000000 02000000 6500"  # one feature "d", one field "e" of kind 6
        )
        session = cdr.decode("TandemSession", sample)
        self.assertEqual([session.session, session.scene, session.scene_json], ["a", "", "x"])
        self.assertEqual([session.frame_rate_hz, session.lattice_unit], [30.0, 2.0**-10])
        self.assertEqual([(one.name, one.radius, one.shape_values) for one in session.types], [("b", 0.5, [])])
        self.assertEqual(session.streams, [])
        self.assertEqual([session.dt_s, session.gravity_y, session.up_axis], [2.0**-5, -10.0, 1])
        self.assertEqual([session.continues_epoch, session.continues_frame], [2, 3])
        self.assertEqual([(one.slot, one.reuse, one.name) for one in session.names], [(7, 2, "c")])
        self.assertEqual([session.topology_hash, session.topology_bytes, session.features], [4, 5, ["d"]])
        self.assertEqual([(one.kind, one.name) for one in session.data], [(6, "e")])

    def test_every_topic_type_comes_back(self):
        zero = {"string": "abc", "[octet]": b"\1\2\3", "float": 0.5, "double": -2.0}

        def example(kind):
            if kind in cdr.TYPES:
                return {name: example(field) for field, name in cdr.TYPES[kind]}
            if kind in zero:
                return zero[kind]
            return [example(kind[1:-1])] * 3 if kind.startswith("[") else 7

        def plain(value):
            if isinstance(value, cdr.Message):
                return {k: plain(v) for k, v in vars(value).items() if k != "type_name"}
            return [plain(one) for one in value] if isinstance(value, list) else value

        self.assertEqual(len(cdr.TOPICS), 13)
        for kind in cdr.TOPICS:
            with self.subTest(kind=kind):
                self.assertEqual(plain(cdr.decode(kind, writer.sample(kind, **example(kind)))), example(kind))

    def test_padding_behind_a_sample_and_the_option_that_counts_it(self):
        good = writer.sample("TandemInput", client=1, epoch=2, number=3, origin=0, client_frame=4, kind=16, values=[], bytes=b"a")
        for padded in (good, good + bytes(3), b"\0\1\0\3" + good[4:] + bytes(3)):
            self.assertEqual(cdr.decode("TandemInput", padded).bytes, b"a")

    def test_broken_samples_are_refused(self):
        good = writer.sample(
            "TandemScheduledInput", epoch=1, number=2, frame=3, source_client=4, source_number=5, kind=1, values=[1]
        )
        other_headers = [b"\0\0\0\0" + good[4:], b"\0\1\0\4" + good[4:], b"\0\1\0"]
        too_many = good[:-8] + b"\xff\xff\xff\x7f" + good[-4:]
        for bad in (good[:-1], good + bytes(4), too_many, *other_headers):
            with self.assertRaises(Refused):
                cdr.decode("TandemScheduledInput", bad)


if __name__ == "__main__":
    unittest.main()
