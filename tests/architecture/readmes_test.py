"""Tests of readmes.py."""

import pathlib
import tempfile
import unittest

import readmes


class Readmes(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.root = pathlib.Path(directory.name)

    def write(self, folder, *names):
        (self.root / folder).mkdir(parents=True, exist_ok=True)
        for name in names:
            (self.root / folder / name).write_text("", encoding="utf-8")

    def write_sources(self, folder, count):
        self.write(folder, *(f"a{number}.cpp" for number in range(count)))

    def without(self):
        return readmes.folders_without(self.root)

    def test_a_wing_with_sources_needs_a_readme(self):
        self.write_sources("sdk/wire", 1)
        self.assertEqual(self.without(), ["sdk/wire"])
        self.write("sdk/wire", "README.md")
        self.assertEqual(self.without(), [])

    def test_a_small_room_shares_that_of_its_wing(self):
        self.write("sdk/core", "README.md")
        self.write_sources("sdk/core/predict/ballistic", readmes.LARGE)
        self.assertEqual(self.without(), [])

    def test_a_large_room_needs_its_own(self):
        self.write("sdk/core", "README.md")
        self.write_sources("sdk/core/predict", readmes.LARGE + 1)
        self.assertEqual(self.without(), ["sdk/core/predict"])

    def test_that_of_the_root_describes_no_wing(self):
        self.write(".", "README.md")
        self.write("sdk", "README.md")
        self.write_sources("sdk/workers", 1)
        self.assertEqual(self.without(), ["sdk/workers"])

    def test_a_folder_without_sources_needs_none(self):
        self.write("sdk/empty", "CMakeLists.txt")
        self.write("build/ci/sdk", "a.cpp")
        self.assertEqual(self.without(), [])


if __name__ == "__main__":
    unittest.main()
