"""security_tests.py finds lines without a test, and tests that are not there."""

import pathlib
import tempfile
import unittest

from security_tests import findings

PAGE = """
| what | bound | where |
|---|---|---|
| a table without tests | 1 | `nowhere` |

| action | test |
|---|---|
| one | `Suite.Test`, IG `scenario` |
| two | `Suite`, `a_case`, `a_test.cpp` |
| three | |
| four | `Suite.Other` |
"""


class SecurityTests(unittest.TestCase):
    def test_finds_what_is_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "tests").mkdir()
            (root / "SECURITY.md").write_text(PAGE)
            (root / "tests" / "a_test.cpp").write_text("TEST_F(Suite, Test) {}\n")
            (root / "tests" / "cases.py").write_text("def a_case(stage):\n    pass\n")
            (root / "tests" / "CMakeLists.txt").write_text("foreach(each scenario another)\n")
            self.assertEqual(
                list(findings(root)),
                ["SECURITY.md: three: names no test", "SECURITY.md: four: there is no test Suite.Other"],
            )


if __name__ == "__main__":
    unittest.main()
