"""`tandem bench framerate` end to end: a server and two users behind a slow link, as real processes."""

import json
import os
import subprocess
import sys
import unittest

PROGRAM = None  # first argument
SMALL = ["--scene", "half_pipe", "--bodies", "500", "--seconds", "2", "--json"]


def run(*arguments):
    return subprocess.run([PROGRAM, "bench", "framerate", *arguments], capture_output=True, text=True, timeout=200)


def may_make_networks():
    if os.geteuid() != 0 or not os.path.exists("/dev/net/tun"):
        return False
    tried = subprocess.run(["unshare", "--net", "true"], capture_output=True)
    return tried.returncode == 0 and os.access("/dev/net/tun", os.R_OK | os.W_OK)


class Framerate(unittest.TestCase):
    def test_rows_of_both_kinds_of_method_or_one_line_that_says_what_is_missing(self):
        done = run(*SMALL, "--method", "client-only,entropy", "--device", "native", "--users", "1")
        if not may_make_networks():
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertIn("--link memory", done.stderr)
            return
        self.assertEqual(done.returncode, 0, done.stderr)
        client_only, streamed = json.loads(done.stdout)["rows"]
        self.assertGreater(client_only["updates_per_s"], 0)
        self.assertGreater(streamed["updates_per_s"], 0)
        self.assertEqual(streamed["resyncs"], 0)
        # A frame crosses the link and its acknowledgement comes back, with two frames on their way.
        self.assertLess(streamed["updates_per_s"], 4 * 1000 / (5 + 5))

    def test_users_share_one_link_that_lets_no_more_through_than_its_rate(self):
        if not may_make_networks():
            return
        done = run(*SMALL, "--method", "none", "--device", "native", "--users", "2", "--rate", "1e6")
        self.assertEqual(done.returncode, 0, done.stderr)
        (row,) = json.loads(done.stdout)["rows"]
        self.assertEqual(row["users"], 2)
        self.assertGreater(row["updates_per_s"], 0)
        self.assertLess(row["updates_per_s"] * 500 * 24 * 8 * 2, 1.2e6)

    def test_client_only_needs_no_network_of_its_own(self):
        done = run(*SMALL, "--method", "client-only", "--device", "native")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_everybody_may_measure_in_memory(self):
        done = run(*SMALL, "--method", "none,entropy", "--device", "native", "--link", "memory", "--rate", "1e6")
        self.assertEqual(done.returncode, 0, done.stderr)
        none, entropy = json.loads(done.stdout)["rows"]
        self.assertGreater(none["updates_per_s"], 0)
        self.assertGreater(entropy["updates_per_s"], 4 * none["updates_per_s"], "the link is what bounds")

    def test_wrong_usage_is_named(self):
        done = run("--method", "telepathy")
        self.assertEqual(done.returncode, 2)
        self.assertIn("telepathy", done.stderr)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
