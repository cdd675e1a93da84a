"""Checks that `tandem bench bandwidth --trajectory` reads what `generate` writes. recording_test.py PROGRAM"""

import array
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import recording
import rigid

DT_S, RADIUS = 1 / 30, 0.5
LOW, HIGH = (-3.0, 0.0, -3.0), (3.0, 8.0, 3.0)


class Recording(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def falling(self, bodies, frames):
        """Bodies that fall freely from a start block."""
        rows, start = array.array("f"), recording.start_block(bodies, RADIUS, LOW, HIGH, 7)
        for frame in range(frames + 1):
            t = frame * DT_S
            for x, y, z in start:
                rows.extend((x, y - t * t / 2, z, 0, -t, 0))
        info = {"dt_s": DT_S, "damping_per_s": 0, "radius": RADIUS, "threshold": 0.05, "scene": "x.textproto",
                "gravity": [[0, -1, 0]] * (frames + 1)}  # fmt: skip
        return rows.tobytes(), info

    def test_a_pair_is_measured_with_every_predictor(self):
        rows, info = self.falling(40, 5)
        npy = self.folder / "x.npy"
        recording.write_pair(npy, rows, 40, info)
        npy.with_suffix(".textproto").write_text(recording.world_text(DT_S, RADIUS, LOW, HIGH, 200, 3, 0.3))
        for predictor in ("ballistic", "field", "contact"):
            done = subprocess.run(
                [PROGRAM, "bench", "bandwidth", "--trajectory", npy, "--codec", "tracker", "--predictor", predictor, "--json"],
                capture_output=True, text=True, timeout=30, check=False,
            )  # fmt: skip
            self.assertEqual(done.returncode, 0, done.stderr)
            row = json.loads(done.stdout)["rows"][0]
            self.assertEqual((row["bodies"], row["frames"], row["predictor"]), (40, 5, predictor))
            self.assertLessEqual(row["max_error"], row["threshold"] + row["lattice_unit"])

    def test_every_rigid_world_is_a_plan_whose_recording_is_read_at_60_and_30_hz(self):
        for world in rigid.WORLDS:
            bodies = 120
            plan, info = rigid.plan(world, bodies, 4, 7)
            self.assertEqual((plan, info), rigid.plan(world, bodies, 4, 7))
            self.assertNotEqual(plan, rigid.plan(world, bodies, 4, 8)[0])
            self.assertEqual(len(info["shape_of"]), bodies)
            rows = array.array("f", [0, 1, 0, 0, 0, 0, 0.6, 0, 0.8, 0, 1, 2, 3] * (5 * bodies)).tobytes()
            for kept, told in ((rows, info), rigid.halved(rows, bodies, info)):
                npy = self.folder / f"{world}.npy"
                told["scene"] = f"{world}.textproto"
                npy.with_suffix(".textproto").write_text(rigid.scene(world, told["dt_s"]))
                recording.write_pair(npy, kept, bodies, told, 13)
                for predictor in ("ballistic", "field"):
                    done = subprocess.run([PROGRAM, "bench", "bandwidth", "--trajectory", npy, "--codec", "tracker", "--predictor",
                                           predictor, "--json"], capture_output=True, text=True, timeout=30, check=False)  # fmt: skip
                    self.assertEqual(done.returncode, 0, done.stderr)
                    self.assertEqual(json.loads(done.stdout)["rows"][0]["frames"], len(told["gravity"]) - 1)

    def test_positions_are_the_first_six_of_thirteen_columns(self):
        rows = array.array("f", [*range(13), *range(20, 33)])
        self.assertEqual(array.array("f", rigid.positions(rows.tobytes())), array.array("f", [*range(6), *range(20, 26)]))

    def test_a_scene_has_the_walls_of_its_world(self):
        self.assertEqual(rigid.scene("towers", DT_S).count("planes {"), 1)
        walls = [line for line in rigid.scene("mixed", DT_S).splitlines() if line.startswith("planes")]
        self.assertEqual(walls, [f"planes {{ through {{ {wall} }} }}" for wall in (
            "y: 0 } normal { y: 1", "x: -4.5 } normal { x: 1", "x: 4.5 } normal { x: -1", "z: -4.5 } normal { z: 1",
            "z: 4.5 } normal { z: -1")])  # fmt: skip

    def test_rows_that_do_not_fit_the_bodies_are_refused(self):
        rows, info = self.falling(4, 5)
        for bad_rows, bad_info in ((rows[:-1], info), (rows, {**info, "gravity": info["gravity"][1:]})):
            with self.assertRaisesRegex(ValueError, "x.npy"):
                recording.write_pair(self.folder / "x.npy", bad_rows, 4, bad_info)
        self.assertEqual(list(self.folder.iterdir()), [])

    def dump(self, *frames):
        path = self.folder / "rows.dump"
        path.write_text("".join(
            f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
            f"ITEM: ATOMS id x y z vx vy vz\n{atoms}" for step, atoms in frames))  # fmt: skip
        return path

    def test_a_dump_becomes_rows(self):
        first, second = "1 1 2 3 4 5 6\n2 .5 0 0 0 0 0\n", "1 7 8 9 0 0 0\n2 0 0 0 0 0 1e-3\n"
        rows = array.array("f", recording.rows_of_dump(self.dump((0, first), (80, second)), 2, 80))
        expected = [1, 2, 3, 4, 5, 6, 0.5, *[0] * 5, 7, 8, 9, *[0] * 8, 1e-3]
        self.assertEqual(rows, array.array("f", expected))

    def test_a_dump_with_gaps_lost_atoms_or_no_end_is_refused(self):
        good = "1 0 0 0 0 0 0\n2 0 0 0 0 0 0\n"
        for frames in (
            ((0, good), (160, good)), ((0, "2 0 0 0 0 0 0\n1 0 0 0 0 0 0\n"),), ((0, good[:14]),), ((0, good + "3 0\n"),),
            ((0, good[:-3]),),
        ):  # fmt: skip
            with self.assertRaisesRegex(ValueError, "rows.dump, frame"):
                recording.rows_of_dump(self.dump(*frames), 2, 80)

    def test_a_seed_gives_the_same_start_and_gravity_again(self):
        self.assertEqual(recording.start_block(9, RADIUS, LOW, HIGH, 3), recording.start_block(9, RADIUS, LOW, HIGH, 3))
        self.assertNotEqual(recording.start_block(9, RADIUS, LOW, HIGH, 3), recording.start_block(9, RADIUS, LOW, HIGH, 4))
        turned = recording.turning_gravity(300, DT_S, 9.81, 3)
        self.assertEqual(turned, recording.turning_gravity(300, DT_S, 9.81, 3))
        self.assertEqual(turned[0], [0, -9.81, 0])
        for g in turned:
            self.assertAlmostEqual(sum(x * x for x in g) ** 0.5, 9.81)
        with self.assertRaisesRegex(ValueError, "do not fit"):
            recording.start_block(10_000, RADIUS, LOW, HIGH, 3)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
