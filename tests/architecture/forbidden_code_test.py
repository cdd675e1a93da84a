"""forbidden_code.py on small trees of its own."""

import pathlib
import tempfile
import unittest

import forbidden_code


class ForbiddenCode(unittest.TestCase):
    def check(self, text, path="sdk/core/codec/x.cpp"):
        with tempfile.TemporaryDirectory() as root:
            file = pathlib.Path(root, path)
            file.parent.mkdir(parents=True)
            file.write_text(text)
            return forbidden_code.violations(root)

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

    def test_the_browsers_module_uses_no_ranges(self):
        for path in ("sdk/client/session/x.cpp", "sdk/wire/x.hpp", "sdk/transport/websocket/web_port.cpp"):
            self.assertEqual(
                self.check("\nauto i = std::ranges::find(a, 1);", path),
                [f"{path}:2: std::ranges::: WebAssembly's libc++ lacks it"],
            )

    def test_other_folders_may(self):
        self.assertEqual(self.check("double b;", "sdk/wire/x.cpp"), [])
        for path in ("services/host/x.cpp", "sdk/client/api/x.cpp", "sdk/transport/websocket/websocket_port.cpp"):
            self.assertEqual(self.check("double b; std::ranges::sort(a);", path), [])


if __name__ == "__main__":
    unittest.main()
