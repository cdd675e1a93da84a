"""The thesis's table 5.3 in small: on every scene each step of its method takes fewer bits than the one before."""

import json
import subprocess
import sys
import unittest

PROGRAM = None  # first argument
BODIES = 5000
CODECS = ["none", "selective", "quantized", "entropy", "limited"]
SCENES = ["half_pipe", "cube", "four_cubes", "half_pipe_2", "half_pipe_3"]
# The thesis's rate limiter: 0.05 Mbit a frame, in bytes.
LIMITED_MBIT_PER_S = 0.05 * 30


class PaperOrder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        command = [PROGRAM, "bench", "bandwidth", "--scene", "all", "--bodies", BODIES, "--frames", 150]
        command += ["--codec", ",".join(CODECS), "--json"]
        done = subprocess.run(
            list(map(str, command)), stdout=subprocess.PIPE, text=True, timeout=240, check=True
        )
        cls.rows = {(row["scene"], row["codec"]): row for row in json.loads(done.stdout)["rows"]}

    def rate(self, scene, codec):
        return self.rows[scene, codec]["mbit_per_s"]

    def test_every_scene_and_codec_is_there(self):
        self.assertEqual(set(self.rows), {(scene, codec) for scene in SCENES for codec in CODECS})

    def test_without_compression_a_body_costs_24_bytes_a_frame(self):
        expected = 24 * 8 * BODIES * 30 / 2**20
        for scene in SCENES:
            self.assertAlmostEqual(self.rate(scene, "none") / expected, 1, delta=0.001, msg=scene)

    def test_each_step_of_the_method_saves(self):
        for scene in SCENES:
            rates = [self.rate(scene, codec) for codec in CODECS[:4]]
            self.assertEqual(rates, sorted(rates, reverse=True), scene)
            self.assertEqual(len(set(rates)), 4, scene)
            # As in the thesis: equal where the budget never binds.
            self.assertLessEqual(self.rate(scene, "limited"), rates[-1], scene)

    def test_the_limiter_limits(self):
        binds = 0
        for scene in SCENES:
            # Frame heads come on top of the budget: 0.1 % at this size.
            self.assertLessEqual(self.rate(scene, "limited"), LIMITED_MBIT_PER_S * 1.01, scene)
            binds += self.rate(scene, "limited") < self.rate(scene, "entropy")
        self.assertGreater(binds, 0, "the budget binds in no scene: nothing was shown")


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
