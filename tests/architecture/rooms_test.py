import pathlib
import tempfile
import unittest

import rooms


class RoomsTest(unittest.TestCase):
    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.addCleanup(self.scratch.cleanup)
        self.root = pathlib.Path(self.scratch.name)

    def plant(self, path, text=""):
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def test_a_folder_may_be_full(self):
        for number in range(rooms.MOST):
            self.plant(f"sdk/a/{number}.cpp")
        self.assertEqual(rooms.full_folders(self.root), [])

    def test_but_not_fuller(self):
        for number in range(rooms.MOST + 1):
            self.plant(f"sdk/a/{number}.cpp")
        self.assertEqual(len(rooms.full_folders(self.root)), 1)

    def test_an_order_is_no_circle(self):
        self.plant("sdk/a/a.hpp", '#include "sdk/b/b.hpp"\n#include "sdk/c/c.hpp"\n')
        self.plant("sdk/b/b.hpp", '#include "sdk/c/c.hpp"\n')
        self.assertEqual(rooms.circles(self.root), [])

    def test_a_circle_over_three_folders_is_found_at_each(self):
        self.plant("sdk/a/a.hpp", '#include "sdk/b/b.hpp"\n')
        self.plant("sdk/b/b.hpp", '#include "sdk/c/c.hpp"\n')
        self.plant("sdk/c/c.hpp", '#include "sdk/a/other.hpp"\n')
        self.assertEqual(len(rooms.circles(self.root)), 3)

    def test_a_folder_and_its_own_subfolder_are_two(self):
        self.plant("sdk/a/a.hpp", '#include "sdk/a/b/b.hpp"\n')
        self.plant("sdk/a/b/b.hpp", '#include "sdk/a/base.hpp"\n')
        self.assertEqual(len(rooms.circles(self.root)), 2)


if __name__ == "__main__":
    unittest.main()
