"""The judgement of deploy/quickstart: which hash logs it accepts, and what it says of the others."""

import importlib.util
import pathlib
import re
import subprocess
import unittest

path = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "quickstart-session.py"
spec = importlib.util.spec_from_file_location("quickstart_session", path)
quickstart = importlib.util.module_from_spec(spec)
spec.loader.exec_module(quickstart)


def log(first, last, epoch=7):
    return {(epoch, frame): f"hash-{frame}" for frame in range(first, last + 1)}


class Compare(unittest.TestCase):
    server = log(1, 100)

    def test_a_client_that_joined_late_is_fine(self):
        self.assertEqual(quickstart.compare(self.server, log(40, 90), 90), (51, None))

    def test_a_client_without_a_frame_is_not(self):
        self.assertEqual(quickstart.compare(self.server, {}, 100), (0, "applied no frame"))

    def test_a_missing_frame_is_named(self):
        client = log(40, 90)
        del client[7, 50]
        self.assertEqual(quickstart.compare(self.server, client, 90), (10, "frame 50 is missing"))

    def test_a_wrong_hash_is_named(self):
        client = log(40, 90)
        client[7, 41] = "other"
        compared, problem = quickstart.compare(self.server, client, 90)
        self.assertEqual(compared, 1)
        self.assertIn("frame 41", problem)

    def test_a_client_that_stopped_long_before_the_end_is_named(self):
        server = log(1, 600)
        self.assertEqual(quickstart.compare(server, log(1, 590), 600), (590, None))
        self.assertEqual(
            quickstart.compare(server, log(1, 300), 600), (300, "stopped at frame 300, the session went on to 600")
        )

    def test_frames_that_the_server_made_while_clients_were_leaving_do_not_count(self):
        self.assertEqual(quickstart.compare(log(1, 900), log(40, 600), 600), (561, None))

    def test_another_epoch_is_a_gap(self):
        self.assertIsNotNone(quickstart.compare(self.server, {**log(98, 100), **log(1, 3, epoch=8)}, 100)[1])

    def test_a_frame_that_the_server_never_published_is_named(self):
        self.assertEqual(quickstart.compare(self.server, log(99, 101), 101), (2, "frame 101 is not in the server's log"))


class LiveLine(unittest.TestCase):
    def test_waits_for_the_session(self):
        self.assertIn("waiting", quickstart.live_line(1, {}))

    def test_shows_bandwidth_and_the_lag_of_each_client(self):
        top = {
            "sessions": [
                {"session": "quickstart", "frame": 60, "mbit_per_s": 1.5, "raw_mbit_per_s": 50.0, "corrected_per_frame": 9}
            ],
            "clients": [
                {"client": "b", "role": "observer", "phase": "playing", "lag_ms": 3},
                {"client": "a", "role": "participant", "phase": "playing", "lag_ms": 2},
            ],
        }
        line = quickstart.live_line(2, top)
        self.assertIn("1.50 of 50.00 Mbit/s (3.00 %)", line)
        self.assertIn("participant 2 ms, observer 3 ms", line)


class Usage(unittest.TestCase):
    def test_what_is_of_the_viewer_goes_with_view(self):
        for flags in (["--port", "9000"], ["--lan"]):
            done = subprocess.run([path.with_name("quickstart"), *flags], capture_output=True, text=True, check=False, timeout=60)
            self.assertEqual((done.returncode, done.stderr), (2, f"quickstart: {flags[0]} needs --view\n"))


class Tilts(unittest.TestCase):
    def test_the_gravity_of_a_scene_is_read(self):
        self.assertEqual(quickstart.scene_strength("half_pipe"), 3)
        self.assertEqual(quickstart.scene_strength("no_such_scene"), 9.81)

    def test_gravity_keeps_its_strength_and_the_participants_take_turns(self):
        times = []
        for place in (0, 1):
            for line in quickstart.tilts(place, 3, 600).splitlines():
                time, x, y, z = map(float, re.findall(r": (-?[0-9.]+)", line))
                self.assertAlmostEqual((x * x + y * y + z * z) ** 0.5, 3, places=2)
                times.append(time)
        times.sort()
        self.assertEqual({round(after - before) for before, after in zip(times, times[1:])}, {quickstart.TILT_PERIOD_S // 2})


if __name__ == "__main__":
    unittest.main()
