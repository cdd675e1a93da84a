#!/usr/bin/env python3
"""tandem.Client against a real tandemd over loopback DDS. Environment: as stage.py; PYTHONPATH names the package."""

import importlib.util
import pathlib
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import stage  # before tandem: it sets the network up

import numpy as np  # isort: skip
import tandem  # isort: skip
from tandem import EventKind, Phase, Result, Role  # isort: skip

BODIES = 300
EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "sdk/examples"


def join(session="default", **options):
    return tandem.Client(session, stage.DOMAIN, **options)


def wait_for(ready, what):
    deadline = time.monotonic() + stage.LIMIT_S
    while not (found := ready()):
        assert time.monotonic() < deadline, f"waited {stage.LIMIT_S} s for {what}"
        time.sleep(0.01)
    return found


def event_of(client, kind, number=0):
    """The next event of that kind; those before it are taken too."""

    def look():
        return next((e for e in client.events() if e.kind == kind and e.number == number), None)

    return wait_for(look, kind.name)


class Playing(unittest.TestCase):
    """One server for all tests, a client for each."""

    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.log = pathlib.Path(folder) / "hashes"
        cls.enterClassContext(stage.server("default", "--stall-timeout", "off", bodies=BODIES, log=cls.log))

    def setUp(self):
        self.client = self.enterContext(join())
        self.client.wait_until_playing(stage.LIMIT_S)

    def refused(self, code):
        return stage.refused(self, code)

    def test_a_sample_has_a_row_for_each_slot(self):
        bodies = self.client.sample()
        shapes = {"positions": (3,), "velocities": (3,), "angular_velocities": (3,)}
        for name in ("positions", "velocities", "angular_velocities", "types", "alive", "reuse", "changes"):
            self.assertEqual(getattr(bodies, name).shape, (BODIES, *shapes.get(name, ())), name)
        self.assertEqual(bodies.positions.dtype, np.float32)
        self.assertEqual(bodies.types.dtype, np.uint16)
        self.assertEqual(bodies.alive.dtype, np.bool_)
        self.assertIsNone(bodies.orientations, "the bodies of this scene are points")
        self.assertEqual((bodies.capacity, bodies.alive_count), (BODIES, bodies.alive.sum()))
        self.assertEqual(bodies.phase, Phase.PLAYING)
        self.assertEqual(bodies.epoch, self.client.status().epoch)
        self.assertLess(np.abs(bodies.positions[bodies.alive]).max(), 1e4)
        self.assertGreater(bodies.frame, 0)

    def test_out_is_written_to_where_it_is(self):
        bodies = self.client.sample()
        positions, first = bodies.positions, bodies.frame
        address = positions.__array_interface__["data"][0]
        wait_for(lambda: self.client.sample(out=bodies).frame > first + 1, "another frame")
        self.assertIs(bodies.positions, positions)
        self.assertEqual(positions.__array_interface__["data"][0], address)

    def test_changes_are_told_against_the_sample_before(self):
        into = tandem.Sample.into({"changes": np.zeros(BODIES, np.uint8), "alive": np.zeros(BODIES, np.uint8)})
        self.client.sample(out=into)
        self.assertTrue((into.changes[into.alive == 1] == tandem.Change.NEW).all())
        self.client.sample(out=into)
        self.assertFalse((into.changes == tandem.Change.NEW).all())

    def test_only_the_columns_that_are_wanted(self):
        bodies = self.client.sample(out=tandem.Sample(["positions"]))
        self.assertIsNone(bodies.velocities)
        self.assertEqual(bodies.positions.shape, (BODIES, 3))

    def test_fields_of_a_structured_array_are_columns(self):
        fields = [("id", "u4"), ("positions", "f4", 3), ("alive", "u1"), ("types", "u2"), ("x", "f8")]
        own = np.zeros(BODIES + 7, np.dtype(fields, align=True))
        own["id"] = 9
        into = tandem.Sample.into(own)
        at = tandem.clock_ns() - 10**12  # the oldest that is held, for both
        sample = self.client.sample(tandem.SampleMode.INTERPOLATE, at_ns=at, smoothing=0, out=into)
        self.assertIs(sample, into)
        self.assertEqual(own["alive"][:BODIES].sum(), sample.alive_count)
        self.assertTrue((np.abs(own["positions"][:BODIES]).sum(axis=1) > 0)[own["alive"][:BODIES] == 1].all())
        self.assertTrue((own["id"] == 9).all() and (own["x"] == 0).all(), "other fields are left alone")
        self.assertTrue((own["positions"][BODIES:] == 0).all(), "rows behind the last slot are left alone")

    def test_arrays_of_any_stride_hold_the_same(self):
        wide = np.full((BODIES, 2, 3), -1, np.float32)
        tight = np.zeros((BODIES, 3), np.float32)
        # Nothing moves in a client that nobody updates.
        paused = self.enterContext(join(background=False, observe=True))
        paused.wait_until_playing(stage.LIMIT_S)
        at = tandem.clock_ns()
        for array in (tight, wide[:, 1]):
            paused.sample(tandem.SampleMode.INTERPOLATE, at_ns=at, smoothing=0, out={"positions": array})
        np.testing.assert_array_equal(tight, wide[:, 1])
        self.assertTrue((wide[:, 0] == -1).all())

    def test_arrays_that_do_not_fit_are_refused(self):
        for out, error in (
            ({"positions": np.zeros((BODIES, 3))}, TypeError),
            ({"positions": [[0, 0, 0]]}, TypeError),
            ({"positions": np.zeros((BODIES, 2), np.float32)}, ValueError),
            ({"positions": np.zeros(BODIES, np.float32)}, ValueError),
            ({"positions": np.zeros((3, BODIES), np.float32).T}, ValueError),
            ({"positions": np.zeros((BODIES, 3), np.float32)[::-1]}, ValueError),
            ({"positions": np.broadcast_to(np.float32(0), (BODIES, 3))}, ValueError),
            ({"types": np.zeros(BODIES, np.int16)}, TypeError),
            ({"places": np.zeros((BODIES, 3), np.float32)}, ValueError),
            (np.zeros((BODIES, 3), np.float32), ValueError),
            ([1], TypeError),
            ("positions", TypeError),
        ):
            with self.assertRaises(error):
                self.client.sample(out=out)
        short = tandem.Sample.into({"positions": np.zeros((BODIES - 1, 3), np.float32)})
        with self.refused(Result.CAPACITY):
            self.client.sample(out=short)
        self.assertEqual(short.capacity, BODIES)
        with self.refused(Result.INVALID_ARGUMENT):
            self.client.sample(mode=7)

    def test_an_event_tells_on_which_frame_an_input_acted(self):
        number = self.client.send_gravity((3, -9, 0))
        acted = event_of(self.client, EventKind.INPUT_ACTED, number)
        self.assertGreater(acted.frame, 0)
        self.assertLessEqual(acted.frame, self.client.status().frame)
        second = self.client.send_gravity(np.array([0, -9.81, 0]))
        self.assertEqual(second, number + 1)
        self.assertGreater(event_of(self.client, EventKind.INPUT_ACTED, second).frame, acted.frame)
        pushed = self.client.send_push(centre=(0, 5, 0), radius=2, velocity=(0, 1, 0))
        event_of(self.client, EventKind.INPUT_ACTED, pushed)
        refused = event_of(self.client, EventKind.INPUT_REFUSED, self.client.send_bytes(b"what is this?"))
        self.assertTrue(refused.reason)
        self.assertFalse(refused.text.startswith("input refused:"), f"not in the simulation's own words: {refused.text}")
        sought = event_of(self.client, EventKind.INPUT_REFUSED, self.client.send_seek(1.5))
        self.assertEqual(sought.reason, 3, "this session is no replay")
        with self.refused(Result.INVALID_ARGUMENT):
            self.client.send_seek(float("nan"))
        for what in ((float("nan"), 0, 0), (float("inf"), 0, 0)):
            with self.refused(Result.INVALID_ARGUMENT):
                self.client.send_gravity(what)
        with self.assertRaises(TypeError):
            self.client.send_gravity((1, 2))
        for what in (10, "text", None, [1, 2]):
            with self.assertRaises(TypeError):
                self.client.send_bytes(what)
        self.assertTrue(self.client.send_bytes(memoryview(bytearray(b"any buffer"))[::2]))

    def test_an_observer_may_not_send(self):
        with join(observe=True) as observer:
            observer.wait_until_playing(stage.LIMIT_S)
            self.assertEqual(observer.status().role, Role.OBSERVER)
            with self.refused(Result.OUT_OF_ORDER):
                observer.send_gravity((0, -1, 0))

    def test_every_frame_has_the_servers_hash(self):
        seen = {}

        def collect():
            status = self.client.status()
            seen[status.epoch, status.frame] = status.state_hash
            return len(seen) >= 30

        wait_for(collect, "30 frames")
        wait_for(lambda: max(stage.hashes(self.log)) >= max(seen), "the server's log")
        truth = stage.hashes(self.log)
        self.assertEqual(seen, {key: truth.get(key) for key in seen})
        self.assertEqual(self.client.status().hash_mismatches, 0)

    def test_scene_geometry_and_types(self):
        scene = self.client.scene()
        self.assertEqual((scene.capacity, scene.frame_rate_hz), (BODIES, 30))
        self.assertEqual(scene.name, self.client.status().scene)
        self.assertLess(scene.gravity[1], 0)
        self.assertAlmostEqual(scene.dt_s, 1 / 30)
        self.assertEqual((scene.up_axis, scene.continues_epoch, scene.continues_frame), (1, 0, 0))
        self.assertEqual(self.client.body_name(0), "", "a scene's bodies have no names")
        solids = self.client.geometry()
        self.assertTrue(solids)
        self.assertTrue(all(solid.shape in (tandem.Shape.PLANE, tandem.Shape.BOX, tandem.Shape.SPHERE) for solid in solids))
        types = self.client.types()
        self.assertEqual(types[0].shape, tandem.Shape.SPHERE)
        self.assertGreater(types[0].radius, 0)
        self.assertLess(self.client.sample().types.max(), len(types))

    def test_sessions_are_found(self):
        found = wait_for(lambda: [s for s in tandem.sessions(stage.DOMAIN, wait=0.5) if s.name == "default"], "the session")
        self.assertTrue(found[0].playable)
        self.assertEqual((found[0].capacity, found[0].frame_rate_hz), (BODIES, 30))
        self.assertEqual(tandem.sessions(stage.DOMAIN + 1, wait=0), [])

    def test_a_profile_is_the_kind_of_network(self):
        self.assertEqual(tandem.sessions(stage.DOMAIN + 2, wait=0, profile="loopback"), [])
        with tandem.Client(domain=stage.DOMAIN + 3, profile="loopback") as client:
            self.assertEqual(client.status().phase, Phase.SEARCHING)
            with self.refused(Result.INVALID_ARGUMENT):  # one process, one profile on a domain
                tandem.Client(domain=stage.DOMAIN + 3)
        for wrong in ("moon", "wan", "lan\0"):
            with self.refused(Result.INVALID_ARGUMENT):
                tandem.Client(domain=stage.DOMAIN + 4, profile=wrong)
        with self.refused(Result.TRANSPORT):
            tandem.sessions(stage.DOMAIN + 4, wait=0, profile="lan:interface=nowhere0")

    def test_an_application_updates_by_itself(self):
        with join(background=False) as client:
            with self.refused(Result.WRONG_THREAD):
                self.client.update()
            wait_for(lambda: client.update(0.1) or client.status().phase == Phase.PLAYING, "playing")
            before = client.status().frame
            wait_for(lambda: client.update(0.1) or client.status().frame > before + 10, "ten frames")

    def test_nothing_is_ready_without_a_session(self):
        with join("nobody") as client:
            self.assertEqual(client.status().phase, Phase.SEARCHING)
            for call in (client.sample, client.scene, client.types, lambda: client.send_gravity((0, 0, 0))):
                with self.refused(Result.NOT_READY):
                    call()
            with self.refused(Result.TIMEOUT):
                client.wait_until_playing(0.3)
            self.assertIsNone(client.next_event())

    def test_bad_arguments(self):
        for options in ({"session": "a*"}, {"session": "default\0x"}, {"session": ""}, {"domain": 231}, {"lead": 2**20}, {"threads": 65}):
            with self.refused(Result.INVALID_ARGUMENT):
                tandem.Client(**{"domain": stage.DOMAIN, **options})
        with self.assertRaises(TypeError):
            tandem.Client(domain=-1)
        with self.assertRaises(TypeError):
            join(log="not callable")

    def test_closed_twice_and_used_after(self):
        self.client.close()
        self.client.close()
        for call in (self.client.status, self.client.sample, self.client.next_event, self.client.update, self.client.scene):
            with self.refused(Result.INVALID_HANDLE):
                call()
        with self.refused(Result.INVALID_HANDLE):
            self.client.wait_until_playing(1)

    def test_closing_ends_what_another_thread_waits_for(self):
        client = join("nobody")
        codes = []

        def wait():
            try:
                client.wait_until_playing(stage.LIMIT_S)
            except tandem.Error as error:
                codes.append(error.code)

        waiting = threading.Thread(target=wait)
        waiting.start()
        client.close()
        waiting.join(stage.LIMIT_S)
        self.assertFalse(waiting.is_alive())
        self.assertEqual(codes, [Result.INVALID_HANDLE])

    def test_other_threads_go_on_while_one_waits(self):
        with join("nobody", background=False) as client:
            counted, beside = [0], threading.Event()

            def wait():
                while not beside.is_set():
                    before = counted[0]
                    client.update(1)
                    if counted[0] > before + 100:
                        beside.set()

            waiting = threading.Thread(target=wait, daemon=True)
            waiting.start()
            deadline = time.monotonic() + stage.LIMIT_S
            while not beside.is_set() and time.monotonic() < deadline:
                counted[0] += 1
            self.assertTrue(beside.is_set(), "within one update() this thread stood still")
            waiting.join(stage.LIMIT_S)

    def test_the_log_function_takes_the_lock_and_may_not_call(self):
        lines, codes = [], []

        def log(level, line):
            lines.append((level, line))
            try:
                client.status()
            except AttributeError:
                pass
            except tandem.Error as error:
                codes.append(error.code)
            raise RuntimeError("goes no further")

        unraised = []
        hook, sys.unraisablehook = sys.unraisablehook, unraised.append
        self.addCleanup(setattr, sys, "unraisablehook", hook)
        client = None  # the first line may come before join() has returned
        with join(log=log) as client:
            client.wait_until_playing(stage.LIMIT_S)
            wait_for(lambda: codes, "a line")
        self.assertTrue(all(isinstance(level, tandem.LogLevel) and line for level, line in lines))
        self.assertEqual(set(codes), {Result.IN_CALLBACK})
        self.assertTrue(unraised)


    def test_a_program_that_closes_nothing_ends(self):
        program = (
            "import sys, tandem\n"
            f"client = tandem.Client(domain={stage.DOMAIN}, log=lambda level, line: print(line))\n"
            "client.wait_until_playing(60)\n"
            "cycle = [tandem.Client(domain=int(sys.argv[1]), log=lambda level, line: cycle)]\n"
            "del client\n"
        )
        command = [sys.executable, "-c", program, str(stage.DOMAIN)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=stage.LIMIT_S, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertTrue(done.stdout)


class Restart(unittest.TestCase):
    def test_another_epoch_has_arrays_of_another_length(self):
        with join("restart") as client:
            with stage.server("restart", bodies=200):
                client.wait_until_playing(stage.LIMIT_S)
                bodies = client.sample()
                first = bodies.epoch
                self.assertEqual(bodies.positions.shape, (200, 3))
            event_of(client, EventKind.SESSION_ENDED)
            with stage.server("restart", bodies=250):
                wait_for(lambda: client.status().epoch != first and client.status().phase == Phase.PLAYING, "the next epoch")
                wait_for(lambda: client.sample(out=bodies).epoch != first, "a sample of it")
                self.assertEqual((bodies.positions.shape, bodies.alive.shape), ((250, 3), (250,)))


class Examples(unittest.TestCase):
    """They join domain 0; the tag keeps that apart from others."""

    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(stage.server("default", domain=0))

    def play(self, name, *arguments):
        program = EXAMPLES / name
        done = subprocess.run(
            [sys.executable, "-B", program, *arguments], capture_output=True, text=True, timeout=stage.LIMIT_S, check=False
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_hello(self):
        self.assertLessEqual(len((EXAMPLES / "hello.py").read_text(encoding="utf-8").splitlines()), 25)
        said = self.play("hello.py")
        self.assertEqual(said.count("body 0 at"), 5)

    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "python3-matplotlib is missing")
    def test_plot_energy(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "energy.png"
            said = self.play("plot_energy.py", "--seconds", "2", "--out", out)
            self.assertIn("kinetic energy", said)
            self.assertTrue(out.read_bytes().startswith(b"\x89PNG"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
