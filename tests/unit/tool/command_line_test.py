"""The stable part of `tandem`'s command line: exit codes, JSON on stdout and nothing else, files that fit together."""

import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

PROGRAM = None  # first argument


def run(*arguments, **environment):
    return subprocess.run(
        [PROGRAM, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, **environment},
    )


class CommandLine(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return pathlib.Path(self.folder.name) / name

    def assert_usage(self, expected, *arguments):
        done = run(*arguments)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertIn(expected, done.stderr)

    def test_help_and_version_are_no_errors(self):
        self.assertEqual(run("--help").returncode, 0)
        self.assertRegex(run("--version").stdout, r"^tandem \d+\.\d+\.\d+\n$")
        for command in ("join", "record", "replay", "bench", "export", "top", "doctor"):
            self.assertEqual(run(command, "--help").returncode, 0, command)

    def test_wrong_usage_exits_2_and_says_what_is_expected(self):
        self.assert_usage("subcommand")
        self.assert_usage("--bodies", "bench", "bandwidth", "--scene", "half_pipe", "--bodies", "0")
        self.assert_usage("--bodies", "bench", "bandwidth", "--scene", "half_pipe", "--bodies", 2**22 + 1)
        for codec in ("entropy", "tracker"):
            self.assert_usage("--predictor", "bench", "bandwidth", "--scene", "cube", "--codec", codec, "--predictor", "foo")
        self.assert_usage("--budget", "bench", "bandwidth", "--scene", "cube", "--codec", "tracker", "--budget", "63")
        for wrong in (("--threshold", "fine"), ("--threshold", "0"), ("--max-error", "1"), ("--target-bandwidth", "1")):
            self.assert_usage("--threshold", "bench", "bandwidth", "--scene", "cube", *wrong)
        for flag in ("--bodies", "--users", "--seed"):
            self.assert_usage(flag, "bench", "bandwidth", "--trajectory", "x.npy", flag, "5")
        self.assert_usage("--from", "export", "--out", "x.npy")
        self.assert_usage("--from", "export", "--scene", "cube", "--from", "x.mcap", "--out", "x.npy")
        self.assert_usage("--from", "export", "--scene", "cube", "--points", "p.mcap")
        self.assert_usage("--points", "export", "--from", "x.mcap", "--points", "p.mcap", "--out", "x.npy")
        self.assert_usage("--out", "export", "--from", "x.mcap")
        self.assert_usage("--every", "export", "--from", "x.mcap", "--out", "x.npy", "--every", "2")
        for flag in ("--bodies", "--frames", "--users", "--seed", "--threads"):
            self.assert_usage(flag, "export", "--from", "x.mcap", "--out", "x.npy", flag, "5")
        self.assert_usage("zip", "bench", "bandwidth", "--scene", "half_pipe", "--codec", "zip")
        for seed in ("-1", str(2**64)):
            self.assert_usage("--seed", "bench", "bandwidth", "--scene", "cube", "--seed", seed)
        self.assert_usage("--scene", "bench", "bandwidth")
        self.assert_usage("--out", "export", "--scene", "half_pipe")

    def test_an_unknown_scene_lists_the_known_ones(self):
        self.assert_usage("half_pipe_2", "bench", "bandwidth", "--scene", "nowhere", "--frames", "1")

    def test_a_malformed_scene_file_is_named_with_its_line(self):
        scene = self.path("broken.textproto")
        scene.write_text("number: 1\nnonsense: 2\n", encoding="utf-8")
        done = run("bench", "bandwidth", "--scene", scene, "--frames", "1")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("broken.textproto:2", done.stderr)

    def test_bandwidth_prints_one_json_object_with_a_row_per_scene_size_and_codec(self):
        done = run(
            "bench", "bandwidth", "--scene", "half_pipe,cube", "--bodies", "100,200", "--frames", "5",
            "--codec", "none,entropy", "--json",
        )  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = json.loads(done.stdout)["rows"]
        keys = [(row["scene"], row["number"], row["bodies"], row["codec"]) for row in rows]
        scenes = (("half_pipe", 1), ("cube", 2))
        self.assertEqual(
            keys, [(s, n, b, c) for s, n in scenes for b in (100, 200) for c in ("none", "entropy")]
        )
        for row in rows:
            self.assertEqual(row["frames"], 5)
            self.assertLessEqual(row["rms_error"], row["max_error"])

    def test_bandwidth_chooses_the_threshold_at_run_time_as_a_host_does(self):
        bench = ("bench", "bandwidth", "--scene", "half_pipe", "--bodies", "500", "--frames", "150", "--codec", "entropy")
        fixed = json.loads(run(*bench, "--json").stdout)["rows"][0]
        coarse = json.loads(run(*bench, "--threshold", "auto", "--target-bandwidth", "0.01", "--json").stdout)["rows"][0]
        self.assertGreater(coarse["threshold"], fixed["threshold"])
        self.assertLess(coarse["mbit_per_s"], fixed["mbit_per_s"])

    def test_another_number_of_users_is_not_the_papers_scene(self):
        done = run("bench", "bandwidth", "--scene", "half_pipe", "--bodies", "50", "--frames", "2", "--users", "4", "--json")
        self.assertTrue(all(row["number"] is None for row in json.loads(done.stdout)["rows"]), done.stderr)

    def test_a_bench_of_an_exported_trajectory_gives_the_rows_of_its_scene(self):
        scene = ("--scene", "half_pipe", "--bodies", "200", "--frames", "40")
        npy = self.path("x.npy")
        exported = run("export", *scene, "--out", npy)
        self.assertEqual(exported.returncode, 0, exported.stderr)
        header = npy.read_bytes()[:128]
        self.assertTrue(header.startswith(b"\x93NUMPY\x01\x00" + struct.pack("<H", 118)))
        self.assertIn(b"(41, 200, 6)", header)
        self.assertEqual(npy.stat().st_size, 128 + 41 * 200 * 6 * 4)
        sidecar = json.loads(self.path("x.json").read_text(encoding="utf-8"))
        self.assertEqual(set(sidecar), {"dt_s", "damping_per_s", "radius", "threshold", "scene", "gravity"})
        self.assertEqual(len(sidecar["gravity"]), 41)

        bench = ("bench", "bandwidth", "--frames", "40", "--codec", "none,selective", "--json")
        recorded = json.loads(run(*bench, "--trajectory", npy).stdout)["rows"]
        live = json.loads(run(*bench, "--scene", "half_pipe", "--bodies", "200").stdout)["rows"]
        for one, other in zip(recorded, live):
            self.assertIsNone(one["colliding_per_frame"])
            self.assertEqual(one["bodies"], other["bodies"])
            self.assertEqual(one["threshold"], other["threshold"])
            self.assertEqual(one["lattice_unit"], other["lattice_unit"])
            self.assertEqual(one["mbit_per_s"], other["mbit_per_s"])

    def test_what_is_no_recording_is_refused_in_one_line(self):
        bad = self.path("bad.mcap")
        for content, expected in (
            (None, "No such file"), (b"", "not an MCAP file"), (b"no recording", "not an MCAP file"),
            (b"\x89MCAP1\r\n", "another version"), (b"\x89MCAP0\r\n", "no snapshot"),
        ):  # fmt: skip
            if content is not None:
                bad.write_bytes(content)
            for out in (("--out", self.path("x.npy")), ("--points", self.path("p.mcap"))):
                done = run("export", "--from", bad, *out)
                self.assertEqual(done.returncode, 1, done.stderr)
                lines = [line for line in done.stderr.splitlines() if "cut short" not in line]
                self.assertEqual(len(lines), 1, lines)
                self.assertIn("bad.mcap", lines[0])
                self.assertIn(expected, lines[0])
                self.assertFalse(out[1].exists())

    def test_a_trajectory_that_names_its_scene_is_predicted_as_the_scene_itself(self):
        source = pathlib.Path(__file__).resolve().parents[3] / "services/engines/scenes/cube.textproto"
        scene = self.path("mine.textproto")
        scene.write_bytes(source.read_bytes())
        npy = self.path("x.npy")
        size = ("--bodies", "300", "--frames", "60")
        exported = run("export", "--scene", scene, *size, "--out", npy)
        self.assertEqual(exported.returncode, 0, exported.stderr)
        sidecar = self.path("x.json")
        info = json.loads(sidecar.read_text())
        self.assertEqual(info["scene"], str(scene))
        bench = ("bench", "bandwidth", "--codec", "tracker", "--json")
        live = {}
        for predictor in ("field", "contact", "auto"):
            live[predictor] = json.loads(run(*bench, "--scene", scene, *size, "--predictor", predictor).stdout)["rows"][0]
        # As a foreign program would write it: the file beside the sidecar.
        for reference in (str(scene), "mine.textproto"):
            sidecar.write_text(json.dumps({**info, "scene": reference}))
            for predictor, row in live.items():
                done = run(*bench, "--trajectory", npy, "--predictor", predictor)
                self.assertEqual(done.returncode, 0, done.stderr)
                recorded = json.loads(done.stdout)["rows"][0]
                for key in ("predictor", "mbit_per_s", "max_error", "rms_error"):
                    self.assertEqual(recorded[key], row[key], (reference, predictor, key))

    def test_a_trajectory_without_a_scene_has_ballistic_only(self):
        npy = self.path("x.npy")
        run("export", "--scene", "cube", "--bodies", "50", "--frames", "5", "--out", npy)
        sidecar = self.path("x.json")
        info = json.loads(sidecar.read_text())
        del info["scene"]
        sidecar.write_text(json.dumps(info))
        bench = ("bench", "bandwidth", "--trajectory", npy, "--codec", "tracker", "--json")
        self.assertEqual(json.loads(run(*bench).stdout)["rows"][0]["predictor"], "ballistic")
        for predictor in ("field", "contact"):
            done = run(*bench, "--predictor", predictor)
            self.assertEqual(done.returncode, 2)
            self.assertRegex(done.stderr.splitlines()[-1], rf"x\.json: no \"scene\"; --predictor {predictor} needs one")

    def test_a_trajectory_whose_scene_is_no_scene_is_refused_in_one_line(self):
        npy = self.path("x.npy")
        run("export", "--scene", "cube", "--bodies", "20", "--frames", "3", "--out", npy)
        sidecar = self.path("x.json")
        info = json.loads(sidecar.read_text())
        self.path("broken.textproto").write_text("nonsense: 2\n")
        for scene, expected in (
            ("nowhere", "unknown scene"), ("none.textproto", "none.textproto"), ("broken.textproto", "broken.textproto:1"),
            ("", "expected the name"), (3, "expected the name"),
        ):  # fmt: skip
            sidecar.write_text(json.dumps({**info, "scene": scene}))
            done = run("bench", "bandwidth", "--trajectory", npy, "--predictor", "field")
            self.assertEqual(done.returncode, 1, scene)
            self.assertRegex(done.stderr, r"^tandem bench bandwidth: \S*x\.json: \"scene\"[^\n]*\n$")
            self.assertIn(expected, done.stderr)

    def test_the_same_seed_gives_the_same_bits_on_any_number_of_threads_and_jobs(self):
        bench = ("bench", "bandwidth", "--scene", "half_pipe,cube", "--bodies", "300", "--frames", "60", "--json", "--peers")
        timed = ("threads", "step_ms", "predict_ms", "encode_ms", "decode_ms", "apply_ms")
        results = []
        for threads, jobs in ((1, 1), (2, 2), (3, 1)):
            done = run(*bench, "--threads", threads, "--jobs", jobs)
            self.assertEqual(done.returncode, 0, done.stderr)
            rows = json.loads(done.stdout)["rows"]
            results.append([{k: v for k, v in row.items() if k not in timed} for row in rows])
        self.assertEqual(results[0], results[1])
        self.assertEqual(results[0], results[2])

    def test_a_bad_trajectory_is_named_with_what_was_expected(self):
        bench = ("bench", "bandwidth", "--trajectory")
        exported = run("export", "--scene", "cube", "--bodies", "20", "--frames", "3", "--out", self.path("x.npy"))
        self.assertEqual(exported.returncode, 0, exported.stderr)
        sidecar = self.path("x.json")
        good = json.loads(sidecar.read_text())
        sidecar.write_text(json.dumps({**good, "dt_s": 0}))
        done = run(*bench, self.path("x.npy"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("x.json", done.stderr)
        self.assertIn("dt", done.stderr)
        sidecar.write_text(json.dumps({**good, "threshold": 1e30}))
        done = run(*bench, self.path("x.npy"))
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"x\.json: \"threshold\" is 1e\+30; expected a number > 0 and at most 1e\+09\n$")
        sidecar.unlink()
        done = run(*bench, self.path("x.npy"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("x.json", done.stderr)

    def test_an_unknown_command_is_named(self):
        done = run("jion")
        self.assertEqual((done.returncode, done.stderr), (2, "tandem: unknown command 'jion'; see tandem --help\n"))

    def test_a_broken_trajectory_is_named(self):
        npy = self.path("x.npy")
        npy.write_bytes(b"nothing")
        done = run("bench", "bandwidth", "--trajectory", npy)
        self.assertEqual(done.returncode, 1)
        self.assertIn(str(npy), done.stderr)

    def test_what_a_client_costs_needs_neither_processes_nor_dds(self):
        done = run("bench", "client", *"--bodies 300 --codec entropy --predictor ballistic --frames 20 --json".split())
        self.assertEqual(done.returncode, 0, done.stderr)
        (row,) = json.loads(done.stdout)["rows"]
        self.assertEqual((row["bodies"], row["codec"], row["predictor"]), (300, "entropy", "ballistic"))
        self.assertGreater(row["frame_ms"]["p50"], 0)

    def test_results_that_cannot_be_written_are_a_failure(self):
        with open("/dev/full", "wb") as full:
            for command in (("doctor", "--json"), ("bench", "bandwidth", "--scene", "cube", "--bodies", "50", "--frames", "2", "--codec", "none", "--json")):
                done = subprocess.run([PROGRAM, *command], stdout=full, stderr=subprocess.PIPE, timeout=60, check=False)
                self.assertEqual(done.returncode, 1, command)
                self.assertIn(b"stdout", done.stderr, command)

    def test_doctor_fails_on_a_configuration_that_cyclone_dds_refuses(self):
        def general(content):
            return f'<CycloneDDS><Domain id="any"><General>{content}</General></Domain></CycloneDDS>'

        for uri in (
            "file:///nowhere/cyclonedds.xml",
            "<CycloneDDS><Domain",
            general("<Interfcs/>"),
            general('<Interfaces><NetworkInterface name="nosuch0"/></Interfaces>'),
        ):
            done = run("doctor", "--json", CYCLONEDDS_URI=uri)
            self.assertEqual(done.returncode, 1, uri)
            checks = {check["name"]: check for check in json.loads(done.stdout)["checks"]}
            self.assertEqual(checks["CYCLONEDDS_URI"]["verdict"], "failure", uri)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
