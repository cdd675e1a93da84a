#!/usr/bin/env python3
"""Scripts as LAMMPS reads them: one for each kind that a reader of our own got wrong. Each is left by LOAD in another process.

    scripts_test.py --program TANDEM_LAMMPS
"""

import argparse
import pathlib
import sys
import tempfile
import unittest

try:
    import numpy as np
    from door_server import DoorServer, Ended
except ImportError:
    print("skipped: numpy is missing")
    sys.exit(77)

ENVIRONMENT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
LIQUID = """
units lj
atom_style atomic
atom_modify	map array
lattice fcc 0.8442
region box block 0 3 0 3 0 3
create_box 1 box
create_atoms 1 box
mass 1 1.0
velocity all create 3.0 87287 loop geom
pair_style lj/cut 2.5
pair_coeff 1 1 1.0 1.0 2.5
fix 1 all nve
"""
# Lines that look otherwise than they are; what a variable was when it was made; runs in `if` and behind `every`; loops.
READ_BY_LAMMPS = (
    LIQUID
    + """
variable s string "a # within 'quotes'" # and a comment
fix p all print 5 "$(step) # ${s}" screen no file /dev/null
variable e equal pe
run 5
variable e0 equal $e
variable once equal $(random(0,1,4711))
print "it was ${once}"
fix m all ave/time 10 2 20 v_e
thermo_style custom step v_e f_m
thermo_modify format line "%d %g %g"
variable i loop 3
label again
if "$i >= 1" then &
  "print 'round $i'" "run 3"
next i
jump SELF again
run 6 every 2 "print 'piece at $(step)'"
variable k loop 100
label last
velocity all scale $(1+v_k)
run 10
next k
jump SELF last
"""
)
# Coefficients and bonds of a data file; sigma 0; r-RESPA, whose runs do not go on without a setup.
WATER_DATA = """water

6 atoms
2 atom types
4 bonds
1 bond types
2 angles
1 angle types
0 20 xlo xhi
0 20 ylo yhi
0 20 zlo zhi

Masses

1 15.9994
2 1.008

Pair Coeffs

1 0.1553 3.166
2 0 0

Bond Coeffs

1 554 1.0

Angle Coeffs

1 45.8 109.47

Atoms # full

1 1 1 -0.8 5 5 5
2 1 2 0.4 5.8 5.6 5
3 1 2 0.4 4.2 5.6 5
4 2 1 -0.8 8 5 5
5 2 2 0.4 8.8 5.6 5
6 2 2 0.4 7.2 5.6 5

Bonds

1 1 1 2
2 1 1 3
3 1 4 5
4 1 4 6

Angles

1 1 2 1 3
2 1 5 4 6
"""
WATER = """
units real
atom_style full
pair_style lj/cut/coul/cut 8.0
bond_style harmonic
angle_style harmonic
read_data {data}
velocity all create 300 4711 loop geom
run_style respa 2 2 bond 1 pair 2
timestep 0.5
fix 1 all nve
run 1000
"""
GRAINS = """
units lj
atom_style sphere
boundary f f f
region box block 0 10 0 10 0 10 units box
create_box 1 box
lattice sc 0.5
create_atoms 1 box
variable d atom 0.4+0.4*random(0,1,88)
set group all diameter v_d
set group all density 2.0
comm_modify vel yes
pair_style gran/hooke 20000.0 NULL 50.0 NULL 0.5 0
pair_coeff * *
fix 1 all nve/sphere
timestep 0.0001
run 1000
"""
# fix pour with molecules, which no restart file brings back.
POUR = """
units lj
atom_style sphere
atom_modify map array
boundary p p f
region box block 0 10 0 10 0 20 units box
create_box 1 box
fix prop all property/atom mol ghost yes
comm_modify vel yes cutoff 3
pair_style gran/hooke 4000.0 NULL 100.0 NULL 0.5 0
pair_coeff * *
molecule pair {molecule}
fix 1 all rigid/small molecule mol pair
fix 2 all gravity 1 vector 0 0 -1
region pour block 2 8 2 8 12 18 units box
fix 3 all pour 10 0 4711 region pour mol pair rigid 1
timestep 0.001
run 1000
"""
MOLECULE = "two grains\n\n2 atoms\n\nCoords\n\n1 0 0 0\n2 0.8 0 0\n\nTypes\n\n1 1\n2 1\n\nDiameters\n\n1 1\n2 1\n\nMasses\n\n1 1\n2 1\n"


class Scripts(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def file(self, name, text):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return path

    def engine(self, script, every=1):
        return DoorServer([OPTIONS.program, script, "--every", every], ENVIRONMENT)

    def goes_on_elsewhere(self, script, frames, every=1):
        """The door of the first process, after it saved and after another one loaded that."""
        saved = self.folder / "saved"
        with self.engine(script, every) as first:
            first.step(frames)
            self.assertGreater(first.save(saved), 0)
            frame = first.frame
            states = [first.step().state() for _ in range(4)]
        with self.engine(script, every) as second:
            self.assertTrue(second.load(saved, frame))
            for state in states:
                for expected, got in zip(state, second.step().state()):
                    np.testing.assert_array_equal(expected, got)
        return first

    def test_lines_mean_what_they_mean_in_lammps(self):
        script = self.file("in.read", READ_BY_LAMMPS)
        door = self.goes_on_elsewhere(script, 37)  # in the second round of the last loop: 5, 3 x 3, 6, 10, 7
        for line in ("round 1", "round 3", "piece at 16", "piece at 18", "piece at 20"):
            self.assertIn(line, door.text)
        self.assertNotIn("round 4", door.text)

    def test_a_run_within_if_is_shown(self):
        with self.engine(self.file("in.if", LIQUID + 'if "1 > 0" then "run 3" else "run 1"\n')) as door:
            before = door.position.copy()
            door.step()
            self.assertGreater(float(np.abs(door.position - before).max()), 0)
            before = door.position.copy()
            door.step(2)
            self.assertGreater(float(np.abs(door.position - before).max()), 0)
        self.assertNotIn("the script is over", door.text)

    def test_a_run_of_no_steps_shows_its_atoms(self):
        with self.engine(self.file("in.still", LIQUID + "run 0\n")) as door:
            before = door.position.copy()
            self.assertGreater(float(before.max()), 0)
            np.testing.assert_array_equal(door.step().position, before)

    def test_water_of_a_data_file(self):
        script = self.file("in.water", WATER.format(data=self.file("water.data", WATER_DATA)))
        door = self.goes_on_elsewhere(script, 5)
        # Sigma is 0 in the data file's coefficients alone, which a script does not show: half of the distance of atoms.
        self.assertEqual(len(door.lines("type")), 2)

    def test_a_type_without_sigma_has_a_radius(self):
        more = "pair_coeff * * 0.0 0.0\npair_coeff 1 1 1.0 1.2\nrun 10\n"
        text = LIQUID.replace("create_box 1", "create_box 2").replace("mass 1", "mass *").replace("pair_coeff 1 1 1.0 1.0 2.5\n", "")
        with self.engine(self.file("in.sigma", text + more)) as door:
            door.step()
            self.assertEqual([float(t[1]) for t in door.lines("type")], [0.6, 0.3])

    def test_grains_of_all_sizes_are_a_few_types(self):
        door = self.goes_on_elsewhere(self.file("in.grains", GRAINS), 2)
        radii = [float(t[1]) for t in door.lines("type")]
        self.assertIn(len(radii), range(20, 60))
        self.assertLess(max(b / a for a, b in zip(radii, radii[1:])), 1.021)
        self.assertIn(f"radii are shown in {len(radii)} sizes, wrong by", door.text)

    def test_what_a_restart_file_lacks_is_named(self):
        script = self.file("in.pour", POUR.format(molecule=self.file("two", MOLECULE)))
        with self.engine(script) as door:
            door.step(3)
            self.assertEqual(door.lines("save"), [])
        self.assertIn("no checkpoints are kept: a restart file does not bring back fix pour with mol", door.text)

    def test_a_script_that_waits_for_others_is_refused(self):
        with self.assertRaises(Ended) as raised, self.engine(self.file("in.imd", LIQUID + "fix 2 all imd 8888\nrun 10\n")):
            pass
        self.assertIn("fix imd waits for a viewer of its own", str(raised.exception))

    def test_more_types_than_a_hello_holds_are_refused(self):
        text = LIQUID.replace("create_box 1", "create_box 801").replace("mass 1", "mass *").replace("pair_coeff 1 1", "pair_coeff * *")
        with self.assertRaises(Ended) as raised, self.engine(self.file("in.types", text + "run 10\n")):
            pass
        self.assertIn("the script has 801 atom types; 1 to 800 can be shown", str(raised.exception))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--program")
    OPTIONS, rest = parser.parse_known_args()
    if not OPTIONS.program:
        print("skipped: LAMMPS or MPI is missing (deploy/install-packages lammps)")
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], *rest])
