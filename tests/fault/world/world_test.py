"""tandem_world is a function of its seed: the same seed gives the same run, and another command line is refused.

    python3 world_test.py TANDEM_WORLD
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop(1)


def run(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)


class World(unittest.TestCase):
    def test_the_same_seed_gives_the_same_run_to_the_byte(self):
        for seed in range(1, 6):
            once, again = (run("--seed", str(seed), "--seconds", "40", "--timeline").stdout for _ in range(2))
            timeline = [text.rpartition(";")[0] for text in (once, again)]  # without the processor's time
            self.assertEqual(timeline[0], timeline[1])
            self.assertIn("digest", timeline[0])

    def test_recording_a_world_changes_nothing_in_it(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "world.mcap"
            plain = run("--seed", "3", "--seconds", "40").stdout.split("digest ")[1][:16]
            recorded = run("--seed", "3", "--seconds", "40", "--record", str(file)).stdout.split("digest ")[1][:16]
            self.assertEqual(plain, recorded)
            self.assertIn(b"foxglove.Log", file.read_bytes())

    def test_another_seed_or_another_plan_gives_another_run(self):
        digests = [
            run("--seconds", "40", *words).stdout.split("digest ")[1][:16]
            for words in (["--seed", "4"], ["--seed", "5"], ["--seed", "4", "--without", "0"], ["--seed", "4", "--faults", "none"])
        ]
        self.assertEqual(len(set(digests)), 4)

    def test_a_wrong_command_line_is_refused(self):
        self.assertEqual(run("--seed").returncode, 2)
        self.assertEqual(run("--seconds", "1").returncode, 2)
        unknown = run("--faults", "rain")
        self.assertEqual(unknown.returncode, 2)
        self.assertIn("torn-write", unknown.stderr)
        self.assertEqual(run("--help").returncode, 0)


if __name__ == "__main__":
    unittest.main()
