"""Tests the parts of the soak that decide: percentiles, blame for late frames, growth, completeness, resuming, exit codes."""

import contextlib
import importlib.util
import io
import json
import pathlib
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
import clients  # noqa: E402
import watching  # noqa: E402

SPEC = importlib.util.spec_from_file_location("soak", HERE / "__main__.py")
soak = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(soak)

NAME = watching.FRAME
EMPTY = {f"{NAME}_count": 0.0, f"{NAME}_sum": 0.0}


def page(sum_s, **below):
    """Return a page with the number of frames below each bound: b10=5 are five below 10 ms."""
    lines = [f'{NAME}_bucket{{le="{int(bound[1:]) / 1000:g}"}} {count}' for bound, count in below.items()]
    count = max(below.values())
    lines += [f'{NAME}_bucket{{le="+Inf"}} {count}', f"{NAME}_count {count}", f"{NAME}_sum {sum_s}"]
    return watching.parse_page("# HELP of something\n" + "\n".join(lines) + "\n")


class Watching(unittest.TestCase):
    def test_a_percentile_is_interpolated_within_its_bucket(self):
        frames = watching.Durations(EMPTY, page(1, b10=50, b20=100, b50=100), NAME)
        self.assertAlmostEqual(frames.quantile_ms(0.5), 10)
        self.assertAlmostEqual(frames.quantile_ms(0.75), 15)
        self.assertAlmostEqual(frames.quantile_ms(1), 20)

    def test_only_what_came_between_two_pages_counts(self):
        before, after = page(1, b10=50, b20=50, b50=50), page(2, b10=50, b20=60, b50=60)
        self.assertEqual(watching.Durations(before, after, NAME).count, 10)
        self.assertAlmostEqual(watching.Durations(before, after, NAME).quantile_ms(0.5), 15)

    def test_the_percentile_of_a_sum_is_bounded_by_the_best_split(self):
        other = {series.replace(NAME, watching.PUBLISH): value for series, value in page(1, b10=995, b20=1000).items()}
        both = {**page(1, b10=999, b50=1000), **other}
        before = {series: 0.0 for series in both}
        least, most = watching.frame_and_publish_ms(before, both)
        self.assertAlmostEqual(least, 10 * 990 / 995)
        self.assertAlmostEqual(most, 10 + 10 * 991 / 995)  # 0.1 % of the frames, 0.9 % of the writes

    def test_a_late_frame_is_the_servers_own_unless_it_waited_for_a_processor(self):
        frames = watching.Durations(EMPTY, page(0.17, b10=10, b50=10, b100=11), NAME)  # ten of 10 ms, one of 70 ms
        self.assertEqual(frames.above(0.05), 1)
        self.assertEqual(watching.blame(frames, 0.01, waited_s=0.0), 1)
        self.assertEqual(watching.blame(frames, 0.01, waited_s=0.019), 1)
        self.assertEqual(watching.blame(frames, 0.01, waited_s=0.021), 0)

    def test_growth_compares_medians_after_the_warm_up(self):
        samples = [(at, 500) for at in range(0, 600, 5)] + [(at, 1000 + at) for at in range(600, 3601, 5)]
        samples[-3] = (samples[-3][0], 10**6)
        self.assertAlmostEqual(watching.growth_percent(samples, 600), 100 * 2940 / 1630, places=0)
        self.assertAlmostEqual(watching.growth_percent([(0, 7), (5, 7)], 0), 0)

    def test_series_are_added_by_label(self):
        values = watching.parse_page('clients{role="observer",stream="a"} 3\nclients{role="observer",stream="b"} 4\n')
        self.assertEqual(watching.total(values, "clients", 'role="observer"'), 7)


class Clients(unittest.TestCase):
    def test_a_client_is_complete_if_it_has_every_frame(self):
        good = {"frames_applied": 100, "hash_mismatches": 0, "resyncs": 0, "epochs": 1, "last_frame": 149}
        self.assertEqual(clients.fault_of(good, 49), "")
        self.assertIn("99 of 100", clients.fault_of({**good, "frames_applied": 99}, 49))
        self.assertIn("1 rejoins", clients.fault_of({**good, "resyncs": 1}, 49))
        self.assertIn("never", clients.fault_of({**good, "frames_applied": 0}, 49))


class Program(unittest.TestCase):
    def setUp(self):
        self.ran = []
        self.folder = tempfile.TemporaryDirectory()
        self.file = pathlib.Path(self.folder.name) / "results.json"
        self.rows = {"checkpoint": ("a", "b", "c", True), "killed": ("a", "b", "c", False)}
        self.old = soak.run_case
        soak.run_case = self.run_case

    def tearDown(self):
        soak.run_case = self.old
        self.folder.cleanup()

    def run_case(self, name, options):
        self.ran.append(name)
        return {"rows": [self.rows[name]], "failed": False, "minutes": 1, "seed": options.seed, "others_percent": 0, "cores": 2}

    def soak(self, *words):
        """Return the exit code and what was printed."""
        made = soak.parser()
        options = made.parse_args(words)
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            code = soak.run(soak.chosen_cases(options, made), options, made)
        return code, said.getvalue()

    def refused(self, *words):
        with self.assertRaises(SystemExit) as ended, contextlib.redirect_stderr(io.StringIO()):
            self.soak(*words)
        return ended.exception.code

    def test_exit_codes(self):
        self.assertEqual(self.soak("--case", "checkpoint")[0], 0)
        self.assertEqual(self.soak("--case", "checkpoint,killed")[0], 1)
        self.assertEqual(self.soak("--case", "killed", "--only-measure")[0], 0)
        for wrong in ((), ("--case", "nonsense"), ("--case", "power", "--minutes", "0"), ("--seed", "x")):
            self.assertEqual(self.refused(*wrong), 2)

    def test_a_case_that_ended_is_not_run_again(self):
        first = self.soak("--case", "checkpoint", "--resume", str(self.file))
        second = self.soak("--case", "checkpoint", "--case", "killed", "--resume", str(self.file))
        self.assertEqual(self.ran, ["checkpoint", "killed"])
        self.assertEqual((first[0], second[0]), (0, 1))
        self.assertEqual(set(json.loads(self.file.read_text())), {"checkpoint", "killed"})
        for line in ("| a | b | c | yes |", "| a | b | c | NO |"):
            self.assertIn(line, second[1])

    def test_a_case_that_failed_is_run_again(self):
        self.soak("--case", "checkpoint", "--resume", str(self.file))
        results = json.loads(self.file.read_text())
        results["checkpoint"]["failed"] = True
        self.file.write_text(json.dumps(results))
        self.soak("--case", "checkpoint", "--resume", str(self.file))
        self.assertEqual(self.ran, ["checkpoint"] * 2)

    def test_a_file_that_holds_no_results_is_wrong_usage(self):
        self.file.write_text("[1, 2")
        self.assertEqual(self.refused("--case", "checkpoint", "--resume", str(self.file)), 2)
        self.file.write_text('{"checkpoint": 1}')
        self.assertEqual(self.refused("--case", "checkpoint", "--resume", str(self.file)), 2)


if __name__ == "__main__":
    unittest.main()
