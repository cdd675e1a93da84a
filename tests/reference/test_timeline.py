"""Scheduled inputs, captures and the command line."""

import contextlib
import io
import pathlib
import tempfile
import unittest

import worlds
import writer
from refusals import RefusalCase
from tandem_reference import __main__ as command
from tandem_reference import capture
from tandem_reference.predict import Drive
from tandem_reference.timeline import Timeline

DRIVES = [Drive((0, y, 0), 0) for y in range(4)]


class ScheduledInputs(RefusalCase):
    def test_they_act_on_their_frame_and_the_highest_number_counts(self):
        line = worlds.timeline(worlds.stream(), drive=DRIVES[0])
        line.add_input(1, 2, DRIVES[1])
        line.add_input(2, 4, DRIVES[2])
        line.add_input(3, 2, DRIVES[3])
        seen = []
        for _ in range(5):
            line.predict()
            seen.append(line.drive)
        self.assertEqual(seen, [DRIVES[0], DRIVES[3], DRIVES[3], DRIVES[2], DRIVES[2]])

    def test_one_for_a_frame_that_is_over_is_refused(self):
        line = worlds.timeline(worlds.stream(), frame=7)
        self.refused("input", line.add_input, 1, 7, DRIVES[0])

    def test_one_that_the_snapshot_counted_changes_nothing(self):
        line = Timeline(worlds.stream(), worlds.world(worlds.stream()), 5, DRIVES[0], last_input=3)
        line.add_input(3, 6, DRIVES[1])
        self.assertEqual(line.inputs, {})


class Capture:
    """The samples of a short session: one stream of the codec tracker, inputs, a snapshot in parts."""

    def __init__(self, codec="tracker"):
        self.of = worlds.stream(codec, types=1)
        self.line = worlds.timeline(self.of, {1: ((0, 0, 0), (0, 0, 0)), 2: ((9, 9, 9), (0, 0, 0))}, frame=10)
        announced = dict(
            id=0, generation=0, client_cost_ns=0, max_delta_bytes=1000, max_snapshot_bytes=10000, delay_ms=0,
            carries=0, cap_kbit_s=0, world_slots=0,
            layout_hash=self.of.layout_hash(), name="", codec=codec, predictor="ballistic", groups=["position"], radii=[],
            parameters=[{"id": i, "value": v} for i, v in self.of.parameters.items()], predictor_constants=[],
            codec_tables=b"",
        )  # fmt: skip
        self.samples = []
        kind = {"radius": 1.0, "colour_rgba": 0, "shape": 0, "name": "ball", "shape_values": []}
        self.add("TandemSession", epoch=5, protocol_version=4, capacity=8, frame_rate_hz=30.0, dt_s=1 / 30,
                 lattice_unit=1.0, gravity_x=0.0, gravity_y=0.0, gravity_z=0.0, up_axis=1, lead=0, window_ceiling=24,
                 server_role=0, standby_rank=0, continues_epoch=0, continues_frame=0, session="s", scene="",
                 scene_json="", types=[kind], streams=[announced], names=[], features=[],
                 data=[], topology_hash=0, topology_bytes=0)  # fmt: skip

    def add(self, kind, /, **fields):
        self.samples.append((kind, writer.sample(kind, **fields)))

    def snapshot(self):
        data = writer.snapshot(self.line, epoch=5)
        cut = len(data) // 2
        for part, some in enumerate((data[:cut], data[cut:])):
            self.add("TandemSnapshot", epoch=5, stream=0, generation=0, frame=self.line.frame, part=part, parts=2,
                     total_bytes=len(data), bytes=some)  # fmt: skip

    def input(self, number, frame, gravity):
        self.line.add_input(number, frame, Drive(tuple(gravity), 0))
        self.add("TandemScheduledInput", epoch=5, number=number, frame=frame, source_client=0, source_number=0,
                 kind=1, values=[*gravity, 0])  # fmt: skip
        self.line.last_input = number

    def delta(self, steps=None, state_hash=None, lost=False):
        self.line.predict()
        data = writer.tracker_section(self.line.world, 100, steps) if steps else b""
        self.line.apply(data)
        if not lost:
            self.add("TandemDelta", epoch=5, stream=0, generation=0, frame=self.line.frame, part=0, parts=1, earlier=0,
                     last_input=self.line.last_input, server_time_ns=0,
                     hash=self.line.world.state.hash() if state_hash is None else state_hash, payload=data)  # fmt: skip

    def file(self, **arguments):
        return writer.mcap_file(self.samples, **arguments)


class Files(unittest.TestCase):
    def run_on(self, data):
        """Exit status, output and errors of the command on a file."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "x.mcap"
            path.write_bytes(data)
            out, errors = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
                status = command.main([str(path)])
        return status, out.getvalue(), errors.getvalue()

    def example(self):
        made = Capture()
        made.input(1, 12, (0, -50, 0))
        made.snapshot()
        for i in range(3):
            made.delta({1: [i, 1, 0]})
        made.input(2, 15, (1, 2, 3))
        made.delta()
        made.delta({2: [0, 0, -5]})
        return made

    def test_a_whole_capture_agrees(self):
        for chunked in (False, True):
            status, out, errors = self.run_on(self.example().file(chunked=chunked))
            self.assertEqual((status, errors), (0, ""))
            self.assertIn("5 frames checked", out)

    def test_the_first_frame_that_differs_is_named(self):
        made = self.example()
        made.delta({1: [1, 0, 0]}, state_hash=1)
        made.delta({1: [1, 0, 0]}, state_hash=2)
        status, _, errors = self.run_on(made.file())
        self.assertEqual(status, 1)
        self.assertIn("hash: frame 16: announced 0000000000000001", errors)

    def test_a_gap_goes_on_with_the_next_snapshot(self):
        made = self.example()
        made.delta({1: [1, 0, 0]}, lost=True)
        made.delta({1: [1, 0, 0]})
        made.snapshot()
        made.delta({1: [1, 0, 0]})
        made.snapshot()
        status, out, errors = self.run_on(made.file())
        self.assertEqual(status, 0)
        self.assertIn("6 frames checked", out)
        self.assertIn("not in the file", errors)

    def test_an_input_that_is_missing_is_named(self):
        made = self.example()
        made.samples = [one for one in made.samples if one[0] != "TandemScheduledInput"]
        status, _, errors = self.run_on(made.file())
        self.assertEqual(status, 1)
        self.assertIn("frame 14: scheduled input 2 is not in the file", errors)

    def test_a_snapshot_with_other_models_is_found(self):
        made = self.example()
        made.line.world.models.p[tracker_model_in_use(made)] += 1
        made.snapshot()
        status, _, errors = self.run_on(made.file())
        self.assertEqual(status, 1)
        self.assertIn("other models", errors)

    def test_a_file_cut_short_is_checked_as_far_as_it_goes(self):
        status, out, errors = self.run_on(self.example().file(footer=False)[:-3])
        self.assertEqual(status, 0)
        self.assertIn("4 frames checked", out)
        self.assertIn("no footer", errors)

    def test_files_that_hold_nothing_to_check(self):
        self.assertEqual(self.run_on(writer.mcap_file([]))[0], 1)
        self.assertEqual(self.run_on(b"other")[0], 2)

    def test_another_layout_hash_is_refused(self):
        made = self.example()
        data = made.file().replace(made.of.layout_hash().to_bytes(8, "little"), bytes(8))
        status, _, errors = self.run_on(data)
        self.assertEqual(status, 1)
        self.assertIn("layout hash", errors)

    def test_usage(self):
        with contextlib.redirect_stderr(io.StringIO()):
            self.assertEqual(command.main([]), 2)
            self.assertEqual(command.main(["--vectors"]), 2)
            self.assertEqual(command.main(["/does/not/exist"]), 2)

    def test_quiet_frames_are_frames_of_their_own(self):
        made = self.example()
        made.add("TandemDelta", epoch=5, stream=0, generation=0, part=0, parts=1, last_input=2, server_time_ns=0,
                 frame=19, earlier=3, hash=1, payload=b"")  # fmt: skip
        status, _, errors = self.run_on(made.file())
        self.assertEqual(status, 1)
        self.assertIn("hash: frame 16: announced 0000000000000001", errors)

    def test_frames_that_share_a_message_are_frames_of_their_own(self):
        made = self.example()
        frames = b""
        for i, steps in enumerate(({1: [1, 0, 0]}, None, {2: [0, 0, -5]})):
            made.line.predict()
            data = writer.tracker_section(made.line.world, 100, steps) if steps else b""
            made.line.apply(data)
            state_hash = made.line.world.state.hash()
            frames += bytes([2 * len(data)]) + data if data else b"\x03"
            frames += state_hash.to_bytes(8, "little") if i < 2 else b""
        made.add("TandemDelta", epoch=5, stream=0, generation=0, part=0, parts=1, last_input=2, server_time_ns=0,
                 frame=made.line.frame, earlier=2, hash=state_hash, payload=frames)  # fmt: skip
        status, out, errors = self.run_on(made.file())
        self.assertEqual((status, errors), (0, ""))
        self.assertIn("8 frames checked", out)

    def test_earlier_frames_that_a_payload_does_not_hold_are_refused(self):
        made = self.example()
        made.add("TandemDelta", epoch=5, stream=0, generation=0, part=0, parts=1, last_input=0, server_time_ns=0,
                 frame=made.line.frame + 2, earlier=1, hash=1, payload=b"x")  # fmt: skip
        status, _, errors = self.run_on(made.file())
        self.assertEqual(status, 1)
        self.assertIn("several frames", errors)

    def test_parts_that_disagree_are_refused(self):
        held = capture.Capture()
        fields = dict(epoch=1, stream=0, generation=0, frame=3, parts=2, earlier=0, last_input=0, server_time_ns=0)
        held.add("TandemDelta", writer.sample("TandemDelta", **fields, part=0, hash=1, payload=b"x"))
        with self.assertRaisesRegex(Exception, "disagree"):
            held.add("TandemDelta", writer.sample("TandemDelta", **fields, part=1, hash=2, payload=b"y"))


def tracker_model_in_use(made):
    """The first model that has learnt."""
    return int(made.line.world.models.weight.argmax())


if __name__ == "__main__":
    unittest.main()
