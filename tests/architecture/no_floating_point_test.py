"""no_floating_point.py on small trees of its own."""

import pathlib
import tempfile
import unittest

import no_floating_point


class NoFloatingPoint(unittest.TestCase):
    def check(self, text, path="sdk/core/codec/x.cpp"):
        with tempfile.TemporaryDirectory() as root:
            file = pathlib.Path(root, path)
            file.parent.mkdir(parents=True)
            file.write_text(text)
            return no_floating_point.violations(root)

    def test_uses_are_found_with_their_line(self):
        self.assertEqual(
            self.check("#include <cmath>\nint a;\ndouble b;\n"),
            [
                "sdk/core/codec/x.cpp:1: <cmath>: the core computes with integers",
                "sdk/core/codec/x.cpp:3: double: the core computes with integers",
            ],
        )
        self.assertEqual(len(self.check("auto x = static_cast<float>(1);")), 1)

    def test_words_in_comments_strings_and_names_are_none(self):
        self.assertEqual(self.check('// double\n/* float\nfloat */ int doubled; auto s = "a float";'), [])

    def test_other_folders_may(self):
        self.assertEqual(self.check("double b;", "services/host/x.cpp"), [])


if __name__ == "__main__":
    unittest.main()
