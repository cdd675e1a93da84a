"""`tandem bench client` end to end: a server and a client as processes, and what the client costs."""

import json
import subprocess
import sys
import unittest

PROGRAM, DOMAIN = None, None  # arguments
KINDS = {"receive", "predict", "decode", "hash", "acknowledge", "dds"}


def run(*arguments):
    return subprocess.run([PROGRAM, "bench", "client", *arguments], capture_output=True, text=True, timeout=100)


class ClientCost(unittest.TestCase):
    def test_a_row_holds_the_whole_process_by_kind_and_by_thread(self):
        done = run(*"--bodies 500 --codec entropy --predictor ballistic --runs 1 --seconds 2 --settle 2".split(),
                   "--domain", DOMAIN, "--json")  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        (row,) = json.loads(done.stdout)["rows"]
        self.assertEqual((row["bodies"], row["codec"], row["predictor"]), (500, "entropy", "ballistic"))
        self.assertEqual(set(row["kind_ms"]), KINDS)
        whole = row["cpu_ms"]["median"]
        self.assertAlmostEqual(sum(row["kind_ms"].values()), whole)
        self.assertAlmostEqual(sum(row["thread_ms"].values()), whole)
        self.assertIn("tandem", row["thread_ms"])
        for positive in ("engine_ms", "frames_per_s", "wakeups_per_s", "idle_wakeups_per_s", "resident_mb"):
            self.assertGreater(row[positive], 0, positive)

    def test_a_server_that_is_not_there_is_a_mistake_of_the_caller(self):
        done = run("--server", "/nowhere/tandemd")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("--server", done.stderr)

    def test_in_memory_neither_processes_nor_dds_are_needed(self):
        done = run(*"--in-memory --bodies 300 --codec entropy --predictor ballistic --frames 20 --json".split(),
                   "--server", "/nowhere/tandemd")  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        (row,) = json.loads(done.stdout)["rows"]
        self.assertGreater(row["frame_ms"]["p50"], 0)


if __name__ == "__main__":
    PROGRAM, DOMAIN = sys.argv.pop(1), sys.argv.pop(1)
    unittest.main()
