"""`bench_lab` end to end: what each command prints has all that its numbers in the documents need."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM, DOMAIN = None, None  # arguments
STAGES = ("step", "quantise", "predict", "encode", "apply", "publish", "client_predict", "client_decode", "client_apply")
KINDS = {"receive", "predict", "decode", "hash", "acknowledge", "dds"}


def bench(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=100, check=False)


def run(*arguments):
    return bench("scale", "--domain", DOMAIN, *arguments)


class Client(unittest.TestCase):
    def test_a_row_holds_the_whole_process_by_kind_and_by_thread(self):
        done = bench("client", *"--bodies 500 --codec entropy --predictor ballistic --runs 1 --seconds 2 --settle 2".split(),
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


class Memory(unittest.TestCase):
    def test_each_part_holds_at_least_the_state_of_its_slots(self):
        done = bench("memory", "--bodies", "1000", "--frames", "5", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = json.loads(done.stdout)["rows"]
        self.assertEqual([row["bodies"] for row in rows], [1000, 2000])
        for row in rows:
            # Six floats, alive and type of the engine; alive, generation, type and nine integers of the others.
            for part, state_bytes in (("engine", 27), ("server", 40), ("client", 40)):
                self.assertEqual(row[part]["slot_bytes"], row[part]["total_bytes"] / row["bodies"])
                self.assertGreater(row[part]["slot_bytes"], state_bytes, part)


class Engine(unittest.TestCase):
    def test_the_engine_alone_steps_for_as_long_as_it_was_told(self):
        done = bench("engine", *"--bodies 100 --seconds 0.2 --json".split())
        self.assertEqual(done.returncode, 0, done.stderr)
        row = json.loads(done.stdout)
        self.assertGreaterEqual(row["seconds"], 0.2)
        self.assertAlmostEqual(row["updates_per_s"], row["frames"] / row["seconds"], 3)


class Door(unittest.TestCase):
    def test_an_engine_behind_the_door_makes_the_frames_of_one_that_is_linked_in(self):
        done = bench("door", *"--bodies 100 --frames 20 --scene-bodies 100 --json".split())
        self.assertEqual(done.returncode, 0, done.stderr)
        said = json.loads(done.stdout)
        self.assertGreater(next(row for row in said["hand_over"] if row["engine"] == "C")["done_ms"], 0)
        for side in ("linked", "door"):
            self.assertGreater(said[side]["whole_ms"], 0)


class Scale(unittest.TestCase):
    def test_rows_hold_every_stage_and_a_chart_is_drawn(self):
        with tempfile.TemporaryDirectory() as folder:
            chart = pathlib.Path(folder) / "chart.svg"
            done = run(*"--bodies 300,900 --threads 1 --state moving --frames 30 --json --svg".split(), chart)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("client_decode", chart.read_text())
        said = json.loads(done.stdout)
        self.assertGreater(said["memory_bytes_per_s"]["1"], 0)
        self.assertEqual([row["bodies"] for row in said["rows"]], [300, 900])
        for row in said["rows"]:
            for stage in STAGES:
                self.assertLessEqual(row[f"{stage}_ms"]["p50"], row[f"{stage}_ms"]["p99"], stage)
            for positive in ("mbit_per_s", "frames_per_s", "engine_bytes_a_body", "server_bytes_a_body", "client_bytes_a_body"):
                self.assertGreater(row[positive], 0, positive)
        self.assertIn("step moving ballistic x1", said["slopes"])

    def test_a_settled_row_begins_when_all_bodies_stand_still(self):
        done = run(*"--bodies 500 --threads 1 --state settled --frames 20 --json".split())
        self.assertEqual(done.returncode, 0, done.stderr)
        row = json.loads(done.stdout)["rows"][0]
        self.assertEqual(row["standing"], 1)
        self.assertLess(row["steps_before"], 3000)
        done = run(*"--bodies 500 --threads 1 --state settled --settled-after 30 --frames 20 --json".split())
        row = json.loads(done.stdout)["rows"][0]
        self.assertEqual((row["steps_before"], row["standing"]), (30, 0))

    def test_a_stirred_row_settles_first_and_then_moves(self):
        done = run(*"--bodies 500 --threads 1 --state stirred --frames 60 --json".split())
        self.assertEqual(done.returncode, 0, done.stderr)
        row = json.loads(done.stdout)["rows"][0]
        self.assertEqual(row["standing"], 1)
        self.assertGreater(row["corrected_per_frame"], 0)

    def test_peers_have_a_row_each_and_say_if_they_were_not_run(self):
        done = run(*"--peers --bodies 600 --threads 1,2 --frames 20 --settled-after 20 --json".split())
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = json.loads(done.stdout)["rows"]
        self.assertEqual([(row["engine"], row["threads"]) for row in rows], [("tandem", 1), ("tandem", 2), ("lammps", 1), ("bullet", 1)])
        for row in rows:
            if "not_run" in row:
                self.assertNotEqual(row["engine"], "tandem")
                continue
            for state in ("moving", "settled"):
                self.assertGreater(row[f"{state}_ns_a_body"]["wall"], 0)

    def test_what_cannot_be_measured_is_refused_before_anything_starts(self):
        done = run("--scene", "towers", "--bodies", "300")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("particles", done.stderr)
        done = run("--bodies", "300,4194305")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("4194304", done.stderr)
        self.assertEqual(done.stdout, "")
        done = run("--bodies", "300", "--codec", "zip")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("zip", done.stderr)
        self.assertEqual(done.stdout, "")


if __name__ == "__main__":
    PROGRAM, DOMAIN = sys.argv.pop(1), sys.argv.pop(1)
    unittest.main()
