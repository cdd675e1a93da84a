"""The checker of vectors, and bytes with faults. That the committed vectors agree is the test reference_vectors."""

import pathlib
import random
import unittest

import tracker_vectors
from tandem_reference import payload, snapshot, vectors
from tandem_reference.errors import Refused

FOLDER = pathlib.Path(__file__).parents[2] / "idl" / "vectors"
SMALL = """
capacity 4
types 1
codec none
predictor ballistic
parameters 1=100 2=3 3=5 4=800 5=0 6=0
drive 0 -64 0 0
bodies
    0 0 0 0  0 0 0  0 0 0  0 0 0
"""


def check(steps, header=SMALL):
    return vectors.Vector(header + steps).check()


class Checker(unittest.TestCase):
    def wrong(self, message, steps, header=SMALL):
        with self.assertRaisesRegex(vectors.Wrong, message):
            check(steps, header)

    def test_a_hash_that_differs_names_its_line(self):
        self.wrong("line 11: hash: 0000000000000000 expected in frame 1", "predict\nhash 0000000000000000")

    def test_hex_may_be_cut_anywhere_and_comments_are_skipped(self):
        self.assertEqual(check("delta 81 # despawn\n   01\n\t00\nhash " + self.empty_hash()), 1)

    def empty_hash(self):
        with self.assertRaises(vectors.Wrong) as caught:
            check("delta\n 810100\nhash 0000000000000000")
        return str(caught.exception).split()[-1]

    def test_refusals(self):
        self.assertEqual(check("delta\n 8400\nrefuse critical whatever stands here"), 1)
        self.wrong("by another rule", "delta\n 8400\nrefuse order")
        self.wrong("were accepted", "delta\nrefuse order")
        self.wrong("critical", "delta\n 8400\nhash 0000000000000000")
        self.assertEqual(check("refuse session", SMALL.replace("codec none", "codec other")), 1)

    def test_what_is_badly_written(self):
        self.wrong("unknown key", "step\n")
        self.wrong("followed by hash", "predict\npredict\n")
        self.wrong("behind the first step", "predict\nhash 0000000000000000\ncapacity 3")
        self.wrong("not hex", "delta xx\nhash 0000000000000000")
        self.wrong("capacity is missing", "", SMALL.replace("capacity 4", ""))
        self.wrong("13 numbers", "", SMALL.replace("0 0 0  0 0 0  0 0 0", "0 0 0"))
        self.wrong("20 numbers", "", SMALL + "groups position orientation\nradii 1\n")

    def test_turns_stand_in_a_file_of_their_own(self):
        good = "turn 0 0 0 1073741824  1 -1 1  2 -2 2 1073741824\n"
        self.assertEqual(check(2 * good, ""), 2)
        self.wrong("computed", good.replace("-2 2 ", "-2 3 "), "")
        self.wrong("no quaternion", good.replace("0 0 0 1073741824  1", "0 0 0 1073741825  1"), "")
        self.wrong("instead of 11", "turn 1 2 3", "")
        self.wrong("without a header", good)


class Faults(unittest.TestCase):
    """Bytes that are changed at random are decoded or refused; nothing else is ever raised."""

    def faulty(self, data, dice):
        data = bytearray(data)
        for _ in range(dice.randrange(1, 4)):
            at = dice.randrange(len(data) + 1)
            data[at : at + dice.randrange(2)] = dice.randbytes(dice.randrange(3))
        return bytes(data)

    def test_vectors_with_faults(self):
        names = ("absolute", "quantized", "huffman", "lifecycle", "sections", "tracker_contact", "orientation",
                 "absolute_turns", "quantized_turns", "huffman_turns", "tracker_turns")  # fmt: skip
        for seed, name in enumerate(names):
            dice = random.Random(seed)
            vector = vectors.Vector((FOLDER / f"{name}.txt").read_text(encoding="utf-8"))
            of = vector.stream()
            before = vector.start(of).world
            for line in vector.steps:
                for _ in range(8 if line.key == "delta" and line.values else 0):
                    data = self.faulty(line.hex(), dice)
                    try:
                        payload.apply_delta(before, of, data)
                    except Refused:
                        pass
                    except Exception as error:
                        self.fail(f"{name}, seed {seed}: {data.hex()}: {error!r}")

    def test_snapshots_with_faults(self):
        dice = random.Random(1)
        vector = vectors.Vector((FOLDER / "snapshot.txt").read_text(encoding="utf-8"))
        of = vector.stream()
        for _ in range(300):
            data = self.faulty(vector.steps[0].hex(), dice)
            try:
                snapshot.read(data, of)
            except Refused:
                pass
            except Exception as error:
                self.fail(f"{data.hex()}: {error!r}")


class Written(unittest.TestCase):
    def test_the_same_vectors_are_written_each_time(self):
        self.assertEqual(tracker_vectors.deltas("ballistic", 3).text(), tracker_vectors.deltas("ballistic", 3).text())


if __name__ == "__main__":
    unittest.main()
