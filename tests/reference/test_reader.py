"""Integers of the protocol."""

import unittest

from refusals import RefusalCase
from tandem_reference.huffman import Bits
from tandem_reference.reader import Reader


def reader(text):
    return Reader(bytes.fromhex(text), "test")


class Integers(RefusalCase):
    def test_leb128_is_lowest_first(self):
        self.assertEqual(reader("00").leb128(4), 0)
        self.assertEqual(reader("7f").leb128(4), 127)
        self.assertEqual(reader("e58e26").leb128(4), 624485)

    def test_leb128_must_be_of_the_shortest_form(self):
        self.refused("leb128", reader("8000").leb128, 4)
        self.refused("leb128", reader("ff8000").leb128, 4)

    def test_leb128_must_not_be_longer_than_it_may(self):
        self.assertEqual(reader("ffffff7f").leb128(4), 2**28 - 1)
        self.refused("leb128", reader("8080808001").leb128, 4)

    def test_zigzag(self):
        self.assertEqual([reader(text).zigzag(5) for text in ("00", "01", "02", "03", "ffffffff0f")],
                         [0, -1, 1, -2, -(2**31)])  # fmt: skip

    def test_what_ends_too_soon_or_too_late_is_refused(self):
        self.refused("length", reader("0102").u32)
        self.refused("length", reader("80").leb128, 4)
        self.refused("length", reader("01").end)

    def test_bits_most_significant_first(self):
        bits = Bits(bytes.fromhex("a3"), "test")
        self.assertEqual([bits.number(3), bits.number(4)], [5, 1])
        self.refused("padding", bits.end)


if __name__ == "__main__":
    unittest.main()
