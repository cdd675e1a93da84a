"""MCAP files: plain, in chunks, cut short."""

import unittest

import writer
from tandem_reference.mcap import McapError, McapFile

MESSAGES = [("TandemDelta", b"one"), ("TandemSession", b""), ("TandemDelta", b"three")]


def read(data):
    file = McapFile(data)
    return [(message.channel.topic, message.data) for message in file.messages()], file.problem


class Mcap(unittest.TestCase):
    def test_plain_and_chunked_files(self):
        for chunked in (False, True):
            found, problem = read(writer.mcap_file(MESSAGES, chunked))
            self.assertEqual(found, MESSAGES)
            self.assertIsNone(problem)

    def test_hand_made_bytes(self):
        data = (
            b"\x89MCAP0\r\n"
            + bytes.fromhex("01 0800000000000000 00000000 00000000")  # header
            + bytes.fromhex("04 1000000000000000 0500 0000 01000000") + b"t" + bytes.fromhex("01000000") + b"c"
            + bytes.fromhex("00000000")[:2]
        )  # fmt: skip
        self.assertEqual(read(data)[0], [])
        self.assertIn("cut short", read(data)[1])

    def test_a_file_cut_short_gives_what_is_whole_and_says_so(self):
        whole = writer.mcap_file(MESSAGES, footer=False)
        found, problem = read(whole)
        self.assertEqual(found, MESSAGES)
        self.assertIn("no footer", problem)
        found, problem = read(whole[:-2])
        self.assertEqual(found, MESSAGES[:2])
        self.assertIn("no footer", problem)

    def test_other_files_are_refused(self):
        for bad in (b"", b"TNDMCAP1"):
            with self.assertRaises(McapError):
                read(bad)

    def test_a_compressed_chunk_is_named(self):
        chunk = bytes(28) + writer.mcap_text("zstd") + bytes(8)
        with self.assertRaisesRegex(McapError, "zstd"):
            read(b"\x89MCAP0\r\n" + writer.mcap_record(6, chunk))


if __name__ == "__main__":
    unittest.main()
