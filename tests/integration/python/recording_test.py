#!/usr/bin/env python3
"""tandem.Recording on what `tandem record` wrote. Environment: as stage.py; PYTHONPATH names the package."""

import os
import pathlib
import struct
import tempfile
import unittest

import stage  # before tandem: it sets the network up

import numpy as np  # isort: skip
import tandem  # isort: skip
from tandem import Result, Shape  # isort: skip

BODIES = 500


class Recorded(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.file = cls.folder / "session.mcap"
        log = cls.folder / "hashes"
        with stage.server("recorded", "--scripted", "--rate", 120, bodies=BODIES):
            stage.tool("record", cls.file, *stage.common("recorded"), "--timeout", 60, "--seconds", 4, "--hash-log", log)
        cls.truth = stage.hashes(log)

    def refused(self, code):
        return stage.refused(self, code)

    def test_every_state_has_the_sessions_hash(self):
        with tandem.Recording(self.file) as recording:
            self.assertIsNone(recording.torn)
            scene = recording.scene()
            self.assertEqual((scene.capacity, scene.frame_rate_hz), (BODIES, 120))
            self.assertLess(scene.gravity[1], 0)
            self.assertTrue(all(solid.shape in (Shape.PLANE, Shape.BOX, Shape.SPHERE) for solid in recording.geometry()))
            self.assertTrue(recording.geometry())
            self.assertEqual(recording.types()[0].shape, Shape.SPHERE)
            self.assertEqual(scene.name, "half_pipe")
            states = list(recording)
            self.assertIsNone(recording.read())
        self.assertEqual([state.starts for state in states], [True] + [False] * (len(states) - 1))
        held = {(state.epoch, state.frame): state.state_hash for state in states[1:]}
        self.assertEqual(held, self.truth)
        for before, after in zip(states, states[1:]):
            self.assertEqual(after.frame, before.frame + 1)
            self.assertGreaterEqual(after.time_s, before.time_s)
        last = states[-1]
        self.assertEqual(last.positions.shape, (BODIES, 3))
        self.assertEqual((last.types.dtype, last.alive.dtype), (np.uint16, np.bool_))
        self.assertIsNone(last.orientations)
        # Bodies move by their velocities, up to the rounding to integers.
        moved = (last.positions - states[-2].positions) * 120
        np.testing.assert_allclose(moved[last.alive].mean(axis=0), last.velocities[last.alive].mean(axis=0), atol=0.5)

    def test_out_is_written_to_where_it_is(self):
        own = np.zeros(BODIES, [("positions", "f4", 3), ("mass", "f4")])
        with tandem.Recording(self.file) as one, tandem.Recording(self.file) as other:
            into, reused = tandem.State.into(own), tandem.State(["positions"])
            while state := one.read(into):
                positions = reused.positions
                other.read(reused)
                self.assertIs(state, into)
                np.testing.assert_array_equal(own["positions"], reused.positions)
            self.assertIs(reused.positions, positions)
            self.assertTrue((own["mass"] == 0).all())
        with tandem.Recording(self.file) as recording, self.refused(Result.CAPACITY):
            recording.read({"positions": np.zeros((BODIES - 1, 3), np.float32)})

    def test_seeking(self):
        frames = sorted(frame for _, frame in self.truth)
        with tandem.Recording(self.file) as recording:
            everything = {state.frame: state.positions for state in recording}
            for frame in (frames[-1], frames[0], frames[len(frames) // 2]):
                recording.seek(frame)
                state = recording.read()
                self.assertEqual(state.frame, frame)
                np.testing.assert_array_equal(state.positions, everything[frame])
                if frame != frames[-1]:
                    self.assertEqual(recording.read().frame, frame + 1)
            for frame, epoch in ((frames[-1] + 1, None), (frames[0], recording.epoch + 1)):
                with self.refused(Result.INVALID_ARGUMENT):
                    recording.seek(frame, epoch)
            recording.seek(frames[3], recording.epoch)
            self.assertEqual(recording.read().frame, frames[3])

    def test_a_torn_file_is_read_up_to_the_tear(self):
        torn = self.folder / "torn.mcap"
        whole = self.file.read_bytes()
        lengths = set()
        for tenth in range(1, 10):
            torn.write_bytes(whole[: len(whole) * tenth // 10])
            try:
                with tandem.Recording(torn) as recording:
                    self.assertTrue(0 < recording.torn <= torn.stat().st_size)
                    held = {(state.epoch, state.frame): state.state_hash for state in recording if not state.starts}
            except tandem.Error as error:  # before the first state
                self.assertEqual(error.code, Result.MALFORMED)
                continue
            self.assertLessEqual(held.items(), self.truth.items())
            lengths.add(len(held))
        self.assertGreater(len(lengths), 2, "where a file is torn decides how much of it is read")

    def test_bad_files(self):
        bad = self.folder / "bad.mcap"
        whole = self.file.read_bytes()
        for content, code in (
            (b"", Result.MALFORMED),
            (b"no recording at all", Result.MALFORMED),
            (whole[:60], Result.MALFORMED),
            (whole[:5] + b"1" + whole[6:], Result.UNSUPPORTED),
        ):
            bad.write_bytes(content)
            with self.subTest(content=content[:20]), self.refused(code):
                tandem.Recording(bad)
        with self.assertRaises(tandem.Error) as raised:
            tandem.Recording(self.folder / "none.mcap")
        self.assertEqual(raised.exception.code, Result.IO)
        self.assertIn("No such file", str(raised.exception))

    def test_what_is_damaged_is_passed_over_and_told(self):
        rotten = self.folder / "rotten.mcap"
        whole = bytearray(self.file.read_bytes())
        chunks, at = [], 8
        while at + 9 <= len(whole):
            opcode, size = struct.unpack_from("<BQ", whole, at)
            chunks += [at + 60] if opcode == 6 else []
            at += 9 + size
        whole[chunks[-1] : chunks[-1] + 64] = bytes(byte ^ 255 for byte in whole[chunks[-1] : chunks[-1] + 64])
        rotten.write_bytes(whole)
        with self.assertWarnsRegex(UserWarning, r"rotten\.mcap is damaged \(at byte \d+: .*left out"):
            with tandem.Recording(rotten) as recording:
                held = {(state.epoch, state.frame): state.state_hash for state in recording if not state.starts}
                self.assertRegex(recording.left_out, "is damaged")
        self.assertTrue(held)
        self.assertLess(held.items(), self.truth.items())

    def test_a_file_that_shrinks_is_an_error(self):
        shrinking = self.folder / "shrinking.mcap"
        shrinking.write_bytes(self.file.read_bytes())
        with tandem.Recording(shrinking) as recording:
            first = recording.read()
            os.truncate(shrinking, 1000)
            with self.assertRaises(tandem.Error) as raised:
                while recording.read():
                    pass
            self.assertIsNotNone(first)
        self.assertEqual(raised.exception.code, Result.IO)
        self.assertIn("shrinking.mcap: it became shorter while it was read", str(raised.exception))

    def test_what_is_no_regular_file_is_refused(self):
        fifo = self.folder / "fifo"
        os.mkfifo(fifo)
        for path, kind in ((fifo, "a FIFO"), (self.folder, "a directory"), ("/dev/zero", "a device")):
            with self.assertRaises(tandem.Error) as raised:
                tandem.Recording(path)
            self.assertEqual(raised.exception.code, Result.IO)
            self.assertIn(f"it is {kind}, and no regular file", str(raised.exception))

    def test_closed_twice_and_used_after(self):
        recording = tandem.Recording(self.file)
        recording.close()
        recording.close()
        for call in (recording.read, recording.types, lambda: recording.seek(1), lambda: recording.epoch):
            with self.refused(Result.INVALID_HANDLE):
                call()


if __name__ == "__main__":
    unittest.main(verbosity=2)
