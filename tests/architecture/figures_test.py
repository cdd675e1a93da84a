"""sdk/package/figures.py --check on trees in which one place lacks a figure."""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import examples

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Figures(unittest.TestCase):
    def check(self, path, pattern, replacement):
        """What the check prints once `pattern` in one of its files is replaced."""
        with tempfile.TemporaryDirectory() as directory:
            tree = pathlib.Path(directory)
            for file in examples.FIGURES:
                (tree / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / file, tree / file)
            text = (tree / path).read_text(encoding="utf-8")
            changed = re.sub(pattern, replacement, text, count=1)
            self.assertNotEqual(changed, text, "the pattern is not there any more")
            (tree / path).write_text(changed, encoding="utf-8")
            ran = subprocess.run(
                [sys.executable, "-B", ROOT / "sdk/package/figures.py", "--check", tree], capture_output=True, text=True, check=False
            )
            self.assertEqual(ran.returncode, 1, ran.stderr)
            return ran.stdout

    def test_a_figure_that_its_list_lacks_is_found(self):
        found = self.check("sdk/include/tandem/client_figures.hpp", r'  visit\("join_ms".*\n', "")
        self.assertIn("each_client_figure() and ClientFigures differ: join_ms", found)

    def test_a_figure_under_another_name_is_found(self):
        found = self.check("sdk/include/tandem/server_figures.hpp", r'visit\("stalls"', 'visit("stall"')
        self.assertIn("each_server_count() and ServerCounts differ: stalls", found)

    def test_a_figure_that_the_header_of_c_lacks_is_found(self):
        found = self.check("sdk/include/tandem/tandem.h", r"  double jitter_ms;\n", "")
        self.assertIn("tandem_status has no `double jitter_ms;`", found)

    def test_a_figure_that_the_idl_lacks_or_has_elsewhere_is_found(self):
        found = self.check("idl/tandem.idl", r"    uint64 stalls;\n", "")
        self.assertIn("TandemServerStatus has no `uint64 stalls;`", found)
        found = self.check("idl/tandem.idl", r"(    uint64 stalls;\n)(    uint64 suspended_ms;\n)", r"\2\1")
        self.assertIn("TandemServerStatus has no `uint64 stalls;`", found)
        found = self.check("idl/tandem.idl", r"    uint64 inputs_refused;\n", "    uint32 inputs_refused;\n")
        self.assertIn("TandemClientStatus has no `uint64 inputs_refused;`", found)

    def test_bindings_that_were_not_written_anew_are_found(self):
        for path in ("sdk/python/tandem/figures.py", "sdk/web/tandem/figures.ts"):
            self.assertIn(f"{path} is not what the structs say", self.check(path, "resyncs", "rejoins"))

    def test_a_line_that_would_be_left_out_is_found(self):
        found = self.check("sdk/include/tandem/client_figures.hpp", r"  double jitter_ms = 0;", "  double jitter_ms = 0, more_ms = 0;")
        self.assertIn("a figure a line", found)


if __name__ == "__main__":
    unittest.main()
