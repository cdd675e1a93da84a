"""The systemd units: systemd understands all of them, and they are closed enough. Exit 77 (not run) without systemd-analyze."""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

UNITS = sorted((pathlib.Path(__file__).resolve().parents[3] / "deploy" / "systemd").glob("*@.service"))
MOST_EXPOSED = 1.6


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


class Units(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def instance(self, unit):
        """The unit of a session, with a program that exists here."""
        path = self.folder / unit.name.replace("@", "@arena")
        path.write_text(re.sub(r"(?m)^ExecStart=\S+", "ExecStart=/bin/true", unit.read_text(encoding="utf-8")), encoding="utf-8")
        return path

    def test_there_is_one_for_each_daemon(self):
        self.assertEqual([unit.name for unit in UNITS], ["tandem-gateway@.service", "tandem-relay@.service", "tandemd@.service"])

    def test_systemd_finds_nothing_to_say(self):
        for unit in UNITS:
            with self.subTest(unit.name):
                done = run("systemd-analyze", "--man=no", "verify", self.instance(unit))
                # It exits with 0 whatever it does not understand.
                self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))

    def test_they_are_closed(self):
        for unit in UNITS:
            with self.subTest(unit.name):
                done = run("systemd-analyze", "security", "--offline=true", "--no-pager", self.instance(unit))
                level = re.search(r"Overall exposure level for \S+: ([0-9.]+)", done.stdout)
                self.assertIsNotNone(level, done.stdout + done.stderr)
                self.assertLessEqual(float(level[1]), MOST_EXPOSED)

    def test_each_limit_has_its_reason(self):
        manual = (UNITS[0].parents[1] / "OPERATING.md").read_text(encoding="utf-8")
        for unit in UNITS:
            text = unit.read_text(encoding="utf-8")
            for limit in ("LimitNOFILE", "MemoryMax", "TasksMax"):
                with self.subTest(f"{unit.name} {limit}"):
                    value = re.search(rf"(?m)^{limit}=(\S+)$", text)
                    self.assertIsNotNone(value)
                    self.assertIn(f"`{limit}={value[1]}`", manual)


if __name__ == "__main__":
    if not shutil.which("systemd-analyze"):
        print("not run: systemd-analyze is not installed")
        sys.exit(77)
    unittest.main()
