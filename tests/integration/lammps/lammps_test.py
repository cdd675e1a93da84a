#!/usr/bin/env python3
"""tandem-lammps on one and two ranks: slots, inputs, losses, pours, loops of a script, saved worlds, refusals.

    lammps_test.py --program TANDEM_LAMMPS --tandem TANDEM
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
    from door_server import GRAVITY, LIMIT_S, PUSH, DoorServer, Ended
except ImportError:
    print("skipped: numpy is missing")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[3]
PILE = ROOT / "sdk/examples/lammps/pile.lammps"
# As root, in a container, and with more ranks than cores.
ENVIRONMENT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
GAS = """
units lj
atom_style sphere
boundary {boundary}
region box block 0 10 0 10 0 10 units box
create_box 1 box
{atoms}
set group all diameter 0.5
set group all density 1.0
pair_style gran/hooke 1000 NULL 10 NULL 0.5 1
pair_coeff * *
comm_modify vel yes
timestep 0.01
fix motion all nve/sphere
{more}
"""
# Computes, groups and lengths in lattice units, none of which a restart file has.
FLOW = """
dimension 2
boundary p s p
atom_style atomic
neighbor 0.3 bin
neigh_modify delay 5
lattice hex 0.7
region box block 0 20 0 10 -0.25 0.25
create_box 2 box
create_atoms 1 box
mass * 1.0
pair_style lj/cut 1.12246
pair_coeff * * 1.0 1.0 1.12246
region low block INF INF INF 1.25 INF INF
group low region low
group flow subtract all low
set group low type 2
compute mobile flow temp
velocity flow create 1.0 482748 temp mobile loop geom
fix 1 all nve
fix 2 flow temp/rescale 20 1.0 1.0 0.02 1.0
fix_modify 2 temp mobile
velocity low set 0 0 0
fix 3 low setforce 0 0 0
region hole sphere 10 4 0 3
delete_atoms region hole
fix 4 flow indent 100 sphere 10 4 0 4
fix 5 all enforce2d
timestep 0.003
thermo_modify temp mobile
run 20
variable more equal 1000
run ${more}
"""
TWO_ATOMS = "create_atoms 1 single 2 5 5 units box\ncreate_atoms 1 single 8 5 5 units box"


def mpirun(ranks, script, *options):
    return ["mpirun", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1", "-n", ranks, OPTIONS.program, script, *options]


def engine(ranks, script, *options):
    return DoorServer(mpirun(ranks, script, *options), ENVIRONMENT)


class Lammps(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def script(self, text, name="in.test"):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return path

    def gas(self, more, atoms=TWO_ATOMS, boundary="f f f"):
        return self.script(GAS.format(more=more, atoms=atoms, boundary=boundary))

    def test_two_ranks_give_the_slots_and_the_motion_of_one(self):
        states = []
        for ranks in (1, 2):
            with engine(ranks, PILE, "--var", "n=8", "--var", "layers=6") as door:
                states.append([tuple(door.step(5).state()) for _ in range(8)])
        for (x1, v1, alive1, type1), (x2, v2, alive2, type2) in zip(*states):
            np.testing.assert_array_equal(alive1, alive2)
            np.testing.assert_array_equal(type1, type2)
            np.testing.assert_allclose(x1, x2, atol=1e-3)
            self.assertLess(np.median(np.abs(v1 - v2)), 1e-3)

    def test_hello_tells_radii_walls_gravity_and_law(self):
        with engine(1, PILE) as door:
            self.assertEqual(door.lines("scene"), [["pile.lammps"]])
            self.assertEqual(door.lines("up"), [["z"]])
            self.assertEqual([float(v) for v in door.lines("gravity")[0]], [0, 0, -9.81])
            self.assertEqual([(t[0], float(t[1])) for t in door.lines("type")], [("type1", 0.5), ("type2", 0.45)])
            self.assertEqual(len(door.lines("plane")), 5)
            self.assertEqual(len(door.lines("law")), 1)
            self.assertAlmostEqual(float(door.lines("dt")[0][0]), 1 / 30)
            self.assertEqual(set(np.unique(door.type)), {0, 1})

    def test_gravity_and_pushes_act_on_all_ranks(self):
        for ranks in (1, 2):
            with engine(ranks, self.gas("fix down all gravity 0.5 vector 0 0 -1\nrun 100000"), "--every", 10) as door:
                speed = float(door.lines("dt")[0][0]) / 0.1
                door.step()
                np.testing.assert_allclose(door.velocity[2] * speed, -0.05, rtol=1e-5)
                door.input(GRAVITY, 0.4 / speed**2, 0, 0)
                door.step()
                np.testing.assert_allclose(door.velocity[0] * speed, 0.04, rtol=0.06)  # from the first half step on
                door.input(PUSH, 8, 5, 5, 1, 0, 0.3 / speed, 0)
                door.step()
                np.testing.assert_allclose(door.velocity[1] * speed, [0, 0.3], atol=1e-5)

    def test_a_lost_atom_leaves_its_slot_and_the_others_stay(self):
        more = "velocity all set 0 0 0\nset atom 2 vx 5.0\nrun 100000"
        for ranks in (1, 2):
            with engine(ranks, self.gas(more.replace("set atom 2 vx 5.0", "group b id 2\nvelocity b set 5 0 0")), "--every", 10) as door:
                door.step(10)
                self.assertEqual(list(door.alive != 0), [True, False])
                self.assertAlmostEqual(float(door.position[0][0]), 2, places=5)
            self.assertIn("1 atoms are gone", door.text)

    def test_deposited_atoms_get_free_slots(self):
        more = (
            "region top block 1 9 1 9 8 9 units box\nfix drop all deposit 6 1 20 4711 region top near 1\n"
            "group b id 2\nvelocity b set 8 0 0\nrun 100000"
        )
        with engine(2, self.gas(more), "--every", 10, "--capacity", 5) as door:
            seen = set()
            for _ in range(20):
                door.step()
                seen.add(tuple(door.alive))
            self.assertEqual(int((door.alive != 0).sum()), 5)
            self.assertGreater(int(door.alive[1]), 1)  # another atom where one was lost
        self.assertGreater(len(seen), 3)

    def test_a_crossing_of_a_periodic_box_is_another_body(self):
        more = "group b id 2\nvelocity b set 3 0 0\nrun 100000"
        with engine(1, self.gas(more, boundary="p p p"), "--every", 10) as door:
            door.step(10)
            self.assertEqual(list(door.alive), [1, 2])
            self.assertLess(float(door.position[0][1]), 2)

    def test_the_parts_of_a_script_run_in_their_order(self):
        part = self.script("print 'included: ${i}'\nrun 7\n", "in.part")
        more = (
            f"variable i loop 3\nlabel again\ninclude {part}\nnext i\njump SELF again\n"
            + 'variable k equal 4\nif "${k} > 3" then "jump SELF over" else "print never"\nprint "never printed"\nlabel over\n'
            'run $(v_k+5) upto\nrun 0\nif "${k} > 3" then "print \'the end\'"\nquit\nrun 1000'
        )
        script = self.gas(more)
        with engine(2, script, "--every", 7) as door:
            door.step(6)
            np.testing.assert_array_equal(door.velocity, 0)
        for line in ("included: 1", "included: 3", "the end", "the script is over"):
            self.assertIn(line, door.text)
        self.assertNotIn("never printed", door.text)

    def test_an_endless_script_goes_on(self):
        script = self.gas("fix down all gravity 0.5 vector 0 0 -1\nrun 15")
        with engine(1, script, "--every", 10, "--endless") as door:
            door.step(3)
            self.assertAlmostEqual(float(door.velocity[2][0]) * float(door.lines("dt")[0][0]) / 0.1, -0.15, places=5)

    def test_a_saved_world_goes_on_in_another_process_to_the_bit(self):
        options = ("--var", "n=6", "--var", "layers=5")
        for ranks in (1, 2):
            path = self.folder / f"saved{ranks}"
            with engine(ranks, PILE, *options) as door:
                door.step(10)
                door.input(GRAVITY, 3, 0, -9)
                door.step(2)
                self.assertEqual(door.save(path), path.stat().st_size)
                frame = door.frame
                states = [door.step().state() for _ in range(10)]
                self.assertFalse((self.folder / f"saved{ranks}.restart").exists())
            with engine(ranks, PILE, *options) as door:
                self.assertTrue(door.load(path, frame))
                for state in states:
                    for expected, got in zip(state, door.step().state()):
                        np.testing.assert_array_equal(expected, got)
            with engine(ranks, PILE, *options, "--capacity", 500) as door:
                self.assertFalse(door.load(path, frame))
                door.step()

    def test_what_a_restart_file_lacks_is_said_again(self):
        script = self.script(FLOW)
        path = self.folder / "saved"
        with engine(1, script) as door:
            door.step(20)  # within the second run
            door.save(path)
            frame = door.frame
            states = [door.step().state() for _ in range(5)]
        with engine(1, script) as door:
            self.assertTrue(door.load(path, frame))
            for state in states:
                for expected, got in zip(state, door.step().state()):
                    np.testing.assert_array_equal(expected, got)

    def test_engine_check_finds_nothing(self):
        command = [OPTIONS.tandem, "engine-check", "--frames", 20, "--", *mpirun(2, PILE, "--var", "n=6", "--var", "layers=5")]
        done = subprocess.run(list(map(str, command)), env={**os.environ, **ENVIRONMENT}, capture_output=True, text=True, timeout=LIMIT_S)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("the same to the bit", done.stdout)
        self.assertNotIn("Loop time", done.stdout)

    def test_what_cannot_be_streamed_is_said_in_a_line(self):
        for text, line in [
            ("units lj\n", "has no run"),
            ("run 10\n", "without a box"),
            ("jump nowhere x\n", "nowhere: cannot be read"),
            ("jump SELF nowhere\n", "has no label nowhere"),
            ("units nonsense\nrun 1\n", "Illegal units command"),
        ]:
            with self.subTest(text), self.assertRaises(Ended) as raised:
                with engine(2, self.script(text)):
                    pass
            self.assertIn(line, str(raised.exception))
        for words, code in [([], 2), (["--every", "0", "x"], 2), (["--nonsense", "x"], 2), (["--help"], 0), (["--version"], 0), (["/nowhere"], 1)]:
            done = subprocess.run([OPTIONS.program, *words], env={**os.environ, **ENVIRONMENT}, capture_output=True, text=True, timeout=LIMIT_S)
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)

    def test_all_ranks_end_with_the_server(self):
        with engine(2, PILE) as door:
            door.step()
            door.socket.close()
            self.assertIn(door.process.wait(LIMIT_S), range(256))
        self.assertIn("the server is gone", door.text)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--program")
    parser.add_argument("--tandem", required=True)
    OPTIONS, rest = parser.parse_known_args()
    if not OPTIONS.program or not shutil.which("mpirun"):
        print("skipped: LAMMPS or MPI is missing (deploy/install-packages lammps)")
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], *rest])
