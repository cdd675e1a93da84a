#!/usr/bin/env python3
"""IMD: simulations as engines, by tandem-imd.

    imd_test.py --imd TANDEM_IMD --tandem TANDEM --tandemd TANDEMD
"""

import argparse
import contextlib
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import struct
import tempfile
import threading
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path += [str(HERE.parent / "lammps"), str(HERE.parent / "python")]
try:
    import numpy as np
    import stage
    from door_server import PUSH, DoorServer, Ended
    from imd_engine import COORDINATES, DISCONNECT, LIMIT_S, Engine, head
except ImportError:
    print("skipped: numpy is missing")
    sys.exit(77)

LIQUID = """
units lj
atom_style atomic
lattice fcc 0.8442
region box block 0 6 0 6 0 6
create_box 1 box
create_atoms 1 box
mass 1 1.0
velocity all create 1.44 87287 loop geom
pair_style lj/cut 2.5
pair_coeff 1 1 1.0 1.0 2.5
neigh_modify delay 0 every 20 check no
timestep 0.005
write_data {folder}/liquid.data
fix motion all nve
fix show all imd {port} trate 5 unwrap on nowait off
run 100000000
"""
ARGON_TOP = """
[ defaults ]
1 1 no 1.0 1.0
[ atomtypes ]
AR 39.948 0.0 A 6.2194e-3 9.6929e-6
[ moleculetype ]
AR 1
[ atoms ]
1 AR 1 AR AR 1 0.0 39.948
[ system ]
argon
[ molecules ]
AR {atoms}
"""
ARGON_MDP = """
integrator = md
dt = 0.002
nsteps = 100000000
cutoff-scheme = Verlet
rvdw = 1.0
rcoulomb = 1.0
nstlist = 20
gen-vel = yes
gen-temp = 100
nstenergy = 0
nstlog = 0
IMD-group = System
"""


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


@contextlib.contextmanager
def process(*command, environment=(), cwd=None, text=None):
    """Runs until the block ends; its output is appended to the list `text`."""
    with tempfile.TemporaryFile() as log:
        child = subprocess.Popen(
            list(map(str, command)), stdout=log, stderr=log, stdin=subprocess.DEVNULL, cwd=cwd, start_new_session=True,
            env={**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1", **dict(environment)},
        )  # fmt: skip
        try:
            yield child
        finally:
            if child.poll() is None:
                child.send_signal(signal.SIGINT)
            try:
                child.wait(15)
            except subprocess.TimeoutExpired:
                os.killpg(child.pid, signal.SIGKILL)
                child.wait()
            log.seek(0)
            output = log.read().decode(errors="replace")
            if text is not None:
                text.append(output)
            elif sys.exc_info()[0] is not None:
                print(f"--- {command[0]}\n{output[-3000:]}", file=sys.stderr)


class Imd(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.engine = Engine()
        self.addCleanup(self.engine.close)

    def topology(self, text="2 grain 0.5 FF0000FF 2\nbox 10 10 10\n"):
        path = self.folder / "topology"
        path.write_text(text, encoding="utf-8")
        return path

    def door(self, *options, port=None, topology=None):
        """The server's side before it has begun: enter it when the engine is about to accept."""
        address = f"127.0.0.1:{port or self.engine.port}"
        return DoorServer([OPTIONS.imd, address, "--topology", topology or self.topology(), *options])

    def start(self, version, first, order="<", velocities=None, **more):
        """(door, ...) with one frame sent, while the door waits for START."""
        def play():
            self.engine.accept(version, order)
            self.engine.send(first, velocities)

        thread = threading.Thread(target=play)
        thread.start()
        door = self.enterContext(self.door(**more))
        thread.join()
        return door

    def test_version_3_in_both_byte_orders(self):
        for order in ("<", ">"):
            with self.subTest(order):
                door = self.start(3, [[1, 2, 3], [4, 5, 6]], order, [[0, 0, 0], [0, 0, 0]])
                self.assertEqual(door.lines("type")[0][:3], ["grain", "0.5", "FF0000FF"])
                np.testing.assert_allclose(door.position.T, [[1, 2, 3], [4, 5, 6]])
                for step in range(1, 4):
                    self.engine.send([[1 + 0.1 * step, 2, 3], [4, 5, 6]], [[0.2, 0, 0], [0, 0, 0]], step)
                    door.step()
                # 0.1 a frame, of which 30 are a second; by the engine's time 0.2 * 0.5.
                np.testing.assert_allclose(door.velocity[:, 0], [3, 0, 0], rtol=1e-4)
                np.testing.assert_allclose(door.position[0], [1.3, 4], rtol=1e-5)
                self.engine.connection.close()

    def test_version_2_has_velocities_by_differences_and_holds_in_a_pause(self):
        door = self.start(2, [[1, 2, 3], [4, 5, 6]])
        for step in range(1, 4):
            self.engine.send([[1, 2 + 0.1 * step, 3], [4, 5, 6]])
            door.step()
        np.testing.assert_allclose(door.velocity[1], [3, 0], rtol=1e-4)
        door.step()
        np.testing.assert_allclose(door.velocity, 0)
        np.testing.assert_allclose(door.position[1], [2.3, 5], rtol=1e-5)
        self.engine.send([[1, 9, 3], [4, 5, 6]])
        self.assertEqual(list(door.step().alive), [2, 1])  # through the periodic box

    def test_pushes_are_forces_for_one_frame(self):
        door = self.start(2, [[1, 2, 3], [4, 5, 6]])
        door.input(PUSH, 1, 2, 3, 1, 0, 7, 0)
        self.engine.send([[1, 2, 3], [4, 5, 6]])
        self.assertEqual(self.engine.forces(), {0: (0, 14, 0)})  # mass 2
        door.step()
        self.engine.send([[1, 2, 3], [4, 5, 6]])
        door.step()
        self.assertEqual(self.engine.forces(), {0: (0, 0, 0)})

    def test_lies_are_refused_in_a_line(self):
        for answer, line in [
            (b"HTTP/1.1 400 Bad Request\r\n\r\n", "no IMD engine"),
            (struct.pack(">i", 4) + struct.pack("<i", 9), "version 9"),
            (struct.pack(">i", 4) + struct.pack("<i", 2) + head(COORDINATES, 3), "sends 3 atoms, but the topology has 2"),
            (struct.pack(">i", 4) + struct.pack("<i", 2) + head(99, 0), "type 99"),
            (struct.pack(">i", 4) + struct.pack("<i", 3) + head(10, 7) + bytes(7), "no coordinates"),
            (b"", "closed the connection after 0 frames"),
        ]:  # fmt: skip
            def play(answer=answer):
                connection, _ = self.engine.listener.accept()
                connection.sendall(answer)
                connection.shutdown(socket.SHUT_WR)
                with contextlib.suppress(OSError):
                    while connection.recv(100):
                        pass
                connection.close()

            thread = threading.Thread(target=play)
            thread.start()
            with self.subTest(line), self.assertRaises(Ended) as raised, self.door():
                pass
            thread.join()
            self.assertIn(line, str(raised.exception))
        with self.assertRaises(Ended) as raised, self.door(topology=self.topology("two grains\n")):
            pass
        self.assertIn("line 1: expected COUNT", str(raised.exception))

    def test_an_engine_that_ends_is_told_with_its_frames(self):
        door = self.start(2, [[1, 2, 3], [4, 5, 6]])
        self.engine.send([[1, 2, 3], [4, 5, 6]])
        self.engine.connection.sendall(head(DISCONNECT, 0))
        with self.assertRaises(Ended) as raised:
            door.step(3)
        self.assertIn("ended the connection after 2 frames", str(raised.exception))

    @unittest.skipUnless(shutil.which("lmp"), "LAMMPS is missing")
    def test_lammps_as_it_is(self):
        port = free_port()
        script = self.folder / "in.liquid"
        script.write_text(LIQUID.format(folder=self.folder, port=port), encoding="utf-8")
        with process("lmp", "-in", script, "-log", "none"):
            data = self.folder / "liquid.data"
            end = time.monotonic() + LIMIT_S
            while not data.exists() or "Velocities" not in data.read_text(encoding="utf-8"):
                self.assertLess(time.monotonic(), end)
                time.sleep(0.1)
            with self.door("--radius", 0.5, "--steps", 2, "--force", 20, port=port, topology=data) as door:
                self.assertEqual(len(door.alive), 864)
                door.step(10)
                before = door.position.copy()
                door.step(5)
                moved = door.position - before
                self.assertGreater(float(np.abs(moved).max()), 0.01)
                # Velocities point where atoms go; how many frames of the engine come until the next one varies.
                steps = [door.position.copy()]
                speeds = []
                for _ in range(6):
                    speeds.append(door.velocity.copy())
                    steps.append(door.step().position.copy())
                correlation = np.corrcoef(np.ravel(np.diff(steps, axis=0)), np.ravel(speeds))[0, 1]
                self.assertGreater(correlation, 0.4)
                centre = door.position.mean(axis=1)
                hit = np.linalg.norm(door.position.T - centre, axis=1) < 2
                before = door.position[0].copy()
                for _ in range(60):  # how many steps of LAMMPS a push lasts varies with the machine
                    door.input(PUSH, *map(float, centre), 2, 5, 0, 0)
                    moved = door.step().position[0] - before
                    if moved[hit].mean() > 0.02:
                        break
                self.assertGreater(moved[hit].mean(), 0.02)
                self.assertGreater(moved[hit].mean(), 3 * moved[~hit].mean())

    @unittest.skipUnless(shutil.which("gmx"), "GROMACS is missing")
    def test_gromacs_as_it_is(self):
        side, distance = 8, 0.38
        size = side * distance
        places = [(x, y, z) for x in range(side) for y in range(side) for z in range(side)]
        lines = [
            f"{i % 99999 + 1:5d}{'AR':<5s}{'AR':>5s}{i % 99999 + 1:5d}" + "".join(f"{(v + 0.5) * distance:8.3f}" for v in place)
            for i, place in enumerate(places)
        ]
        gro = self.folder / "argon.gro"
        gro.write_text(f"argon\n{len(lines)}\n" + "\n".join(lines) + f"\n{size:10.5f}{size:10.5f}{size:10.5f}\n", encoding="utf-8")
        (self.folder / "argon.top").write_text(ARGON_TOP.format(atoms=len(lines)), encoding="utf-8")
        (self.folder / "argon.mdp").write_text(ARGON_MDP, encoding="utf-8")
        grompp = ["gmx", "grompp", "-f", "argon.mdp", "-c", "argon.gro", "-p", "argon.top", "-o", "run.tpr", "-maxwarn", "9"]
        done = subprocess.run(grompp, cwd=self.folder, capture_output=True, text=True, timeout=LIMIT_S)
        self.assertEqual(done.returncode, 0, done.stderr[-2000:])
        port = free_port()
        command = ["gmx", "mdrun", "-s", "run.tpr", "-imdport", port, "-imdwait", "-imdpull", "-nt", 1, "-deffnm", "run"]
        with process(*command, cwd=self.folder):
            with self.door("--steps", 5, "--force", 100, port=port, topology=gro) as door:
                self.assertEqual(len(door.alive), side**3)
                self.assertLess(float(np.abs(door.position).max()), 20 * size)  # Angstrom
                self.assertGreater(float(door.position.max()), 5 * size)
                before = door.step(3).position.copy()
                door.step(10)
                self.assertGreater(float(np.abs(door.position - before).max()), 0.01)

    def test_tandemd_starts_it_for_an_address(self):
        def play():
            self.engine.accept(3)
            with contextlib.suppress(OSError):
                for step in range(2000):
                    self.engine.send([[1 + 0.01 * step, 2, 3], [4, 5, 6]], [[0.02, 0, 0], [0, 0, 0]], step)
                    time.sleep(0.02)

        threading.Thread(target=play, daemon=True).start()
        path = f"{pathlib.Path(OPTIONS.imd).parent}:{os.environ['PATH']}"
        command = [OPTIONS.tandemd, "--engine", f"imd://127.0.0.1:{self.engine.port}", "--topology", self.topology(), *stage.common("imd")]
        with process(*command, environment={"PATH": path}):
            done = stage.tool("join", *stage.common("imd"), "--timeout", LIMIT_S, "--seconds", 2, "--json")
            self.assertIn('"hash_mismatches":0', done.replace(" ", ""))
        for arguments in (["--engine", "imd://127.0.0.1:1"], ["--topology", "x", "--engine", "true"]):
            refused = subprocess.run([OPTIONS.tandemd, *arguments], capture_output=True, text=True, timeout=LIMIT_S)
            self.assertEqual(refused.returncode, 2)
            self.assertIn("topology", refused.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("--imd", "--tandem", "--tandemd"):
        parser.add_argument(name, required=True)
    OPTIONS, rest = parser.parse_known_args()
    os.environ.update(TANDEMD=OPTIONS.tandemd, TANDEM=OPTIONS.tandem)
    unittest.main(argv=[sys.argv[0], *rest])
