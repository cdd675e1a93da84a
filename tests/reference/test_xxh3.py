"""XXH3-64 against values of the C library."""

import unittest

from tandem_reference.xxh3 import text, xxh3_64


class Xxh3(unittest.TestCase):
    def test_known_values_of_every_branch(self):
        known = {
            b"": "2d06800538d394c2",
            b"a": "e6c632b61e964e1f",
            b"abc": "78af5f94892f3950",
            b"tandem": "9d9902d652a891e0",
        }
        for size, value in (
            (8, "3a1c2d7c85af88f8"),
            (16, "8355e3a6f61770db"),
            (17, "9ef341a99de37328"),
            (64, "6187eb9089b0ed55"),
            (128, "85c6174c7ff4c46b"),
            (129, "ec7642b431ba3e5a"),
            (240, "375a384d957fe865"),
            (241, "02e8cd95421c6d02"),
            (1024, "e5d78bafa45b2aa5"),
            (1025, "e95c42288f28186e"),
            (5000, "b418500fc42320ee"),
        ):
            known[bytes(i % 251 for i in range(size))] = value
        for data, value in known.items():
            with self.subTest(size=len(data)):
                self.assertEqual(text(xxh3_64(data)), value)


if __name__ == "__main__":
    unittest.main()
