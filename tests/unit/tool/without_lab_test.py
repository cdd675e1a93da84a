"""`tandem` built without the evaluation, as the quickstart builds it: it says so, and does not offer it."""

import subprocess
import sys
import unittest

PROGRAM = None  # first argument


def run(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=60, check=False)


class WithoutLab(unittest.TestCase):
    def test_the_evaluation_is_named_as_missing_in_one_line(self):
        for arguments in (("bench",), ("bench", "bandwidth", "--scene", "cube"), ("export", "--help")):
            done = run(*arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertEqual(done.stdout, "")
            self.assertRegex(done.stderr, rf"^tandem: {arguments[0]} is not in this build; .*TANDEM_BUILD_LAB=ON .*\n$")

    def test_help_lists_only_what_is_there(self):
        done = run("--help")
        self.assertEqual(done.returncode, 0)
        commands = {line.split()[0] for line in done.stdout.splitlines() if line.startswith("  ")}
        self.assertLessEqual({"join", "top", "doctor"}, commands)
        self.assertTrue(commands.isdisjoint({"bench", "export"}), commands)

    def test_an_unknown_command_is_still_unknown(self):
        done = run("benches")
        self.assertEqual(done.returncode, 2)
        self.assertIn("unknown command 'benches'", done.stderr)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
