#!/usr/bin/env python3
"""`tandem top` on terminals of several sizes, with a session on loopback.

screen_test.py TANDEMD TANDEM
"""

import os
import pathlib
import signal
import subprocess
import sys
import time
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parent))
from terminal import Terminal  # noqa: E402

TANDEMD, TANDEM = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
DOMAIN = "131"
URI = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    "</General></Domain></CycloneDDS>"
)


class Screens(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        os.environ["CYCLONEDDS_URI"] = URI
        cls.running = []
        cls.server = cls.start(TANDEMD, "--scene", "half_pipe", "--bodies", "500", "--session", "arena", "--scripted")
        cls.start(TANDEM, "join", "--session", "arena", "--seconds", "300")
        cls.start(TANDEM, "join", "--session", "arena", "--observe", "--seconds", "300")

    @classmethod
    def start(cls, program, *words):
        cls.running.append(subprocess.Popen([program, *words, "--domain", DOMAIN], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        return cls.running[-1]

    @classmethod
    def tearDownClass(cls):
        for each in cls.running:
            each.kill()
            each.wait()

    def top(self, *words, **how):
        return Terminal([TANDEM, "top", "--domain", DOMAIN, *words], **how)

    def test_every_key_does_what_the_help_says(self):
        with self.top() as terminal:
            terminal.wait_for(r"^ arena")
            terminal.wait_for(r"observes")
            first = terminal.wait_for(r"^>[0-9a-f]{8} ")
            terminal.press("down")
            terminal.run(1)
            self.assertNotEqual([line[:9] for line in first if line.startswith(">")],
                                [line[:9] for line in terminal.screen.text() if line.startswith(">")])  # fmt: skip
            terminal.press("enter")
            terminal.wait_for("THE LAST MINUTE")
            terminal.press("escape")
            terminal.wait_for("^ CLIENT ")
            terminal.press("tab")
            terminal.wait_for("^>arena")
            terminal.press("enter")
            terminal.wait_for(r"session arena, stream \d")
            terminal.press("l")
            terminal.wait_for("WHAT HAPPENED")
            terminal.press("?")
            terminal.wait_for("the other table")
            for key in ("escape", "right", "left", "s", "S", "r", "f", "f", "page up", "page down", "home", "end", "x", "\x01"):
                terminal.press(key)
            terminal.run(1)
            code, errors = terminal.end("q")
            self.assertEqual((code, errors), (0, ""))
            self.assertTrue(terminal.restored())

    def test_fits_every_size_also_when_it_changes(self):
        with self.top() as terminal:
            terminal.wait_for(r"^ arena")
            for columns, lines in ((80, 24), (200, 60), (20, 5), (1, 1), (100, 30)):
                terminal.resize(columns, lines)
                for key in ("enter", "l", "?", "escape"):
                    terminal.press(key)
                    terminal.run(0.4)
                if columns >= 80:
                    terminal.wait_for(r"^ tandem top  domain")
                    terminal.wait_for("^ CLIENT .* WHY")
            self.assertEqual(terminal.end("q")[0], 0)

    def test_starts_on_a_tiny_terminal_and_without_unicode(self):
        for columns, lines, locale in ((20, 5, "C.UTF-8"), (100, 30, "C")):
            with self.top(columns=columns, lines=lines, locale=locale) as terminal:
                terminal.wait_for("arena")
                if locale == "C":
                    self.assertTrue("".join(terminal.screen.text()).isascii())
                self.assertEqual(terminal.end("q")[0], 0)

    def test_a_signal_gives_the_terminal_back(self):
        for how in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            with self.top() as terminal:
                terminal.wait_for("tandem top")
                self.assertEqual(terminal.end(how)[0], 0, how)
                self.assertTrue(terminal.restored(), how)

    def test_prints_tables_where_it_cannot_draw(self):
        process = subprocess.Popen([TANDEM, "top", "--domain", DOMAIN], stdout=subprocess.PIPE, text=True)
        time.sleep(6)
        process.send_signal(signal.SIGINT)
        out = process.communicate(timeout=20)[0]
        self.assertNotIn("\x1b", out)
        self.assertLessEqual(max(map(len, out.splitlines())), 100)
        self.assertGreater(out.count("SESSION "), 1)
        with self.top(term="dumb") as terminal:
            terminal.wait_for("CLIENT .*")
            self.assertEqual(terminal.end(signal.SIGTERM)[0], 0)

    def test_z_keeps_a_killed_server_as_gone(self):
        with self.top() as terminal:
            terminal.wait_for(r"^ arena")
            terminal.wait_for(r"plays")
            self.server.kill()
            terminal.wait_for(r"arena.*gone for \d+ s", 30)
            terminal.wait_for(r"stranded.*its server is gone", 30)
            terminal.end("q")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
