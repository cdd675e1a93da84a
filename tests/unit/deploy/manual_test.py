"""The manual pages and the completion have every option of the programs, and man and bash accept them.

manual_test.py PROGRAM...        Without help2man it is skipped; without man or groff, what needs them is.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

MANUAL = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "manual"
PROGRAMS = [pathlib.Path(argument) for argument in sys.argv[1:]]


def run(*command, **more):
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, timeout=100, **more)


def flags_of(program, *commands):
    """The flags of --help, by command: an independent look at what the program takes."""
    shown = run(program, *commands, "--help").stdout
    flags = {flag for names in re.findall(r"(?m)^  (-[^ ]*)", shown) for flag in names.split(",")}
    below = re.search(r"(?s)\nSubcommands:\n(.*?)(?:\n\n|$)", shown)
    found = {commands: flags}
    for name in re.findall(r"(?m)^  ([a-z-]+) ", below[1]) if below else []:
        found.update(flags_of(program, *commands, name))
    return found


class Manual(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.pages = pathlib.Path(scratch.name)
        done = run(MANUAL / "generate", cls.pages, *PROGRAMS)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        cls.flags = {program: flags_of(program) for program in PROGRAMS}

    def complete(self, *words):
        """What bash offers after these words, of which the last may be the beginning of one."""
        script = 'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _tandem "$1" "${!#}"; printf "%s\\n" "${COMPREPLY[@]}"'
        done = run("bash", "-c", script, "bash", MANUAL / "completion", *words)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return set(done.stdout.split())

    def test_every_option_is_in_the_manual(self):
        for program, commands in self.flags.items():
            self.assertGreater(len(commands[()]), 1)
            for path, flags in commands.items():
                page = self.pages / ("-".join([program.name, *path]) + ".1")
                text = page.read_text(encoding="utf-8").replace("\\-", "-").replace("\\fB", "").replace("\\fR", "")
                for flag in flags:
                    self.assertIn(flag, text, page.name)

    def test_man_has_nothing_to_say(self):
        if not shutil.which("man") or not shutil.which("groff"):
            self.skipTest("man or groff is not installed")
        for page in self.pages.iterdir():
            done = run("man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", page, env={**os.environ, "MANWIDTH": "80"})
            self.assertEqual((done.returncode, done.stderr), (0, ""), page.name)

    def test_bash_offers_every_option_and_command(self):
        for program, commands in self.flags.items():
            for path, flags in commands.items():
                self.assertEqual(self.complete(program, *path, "-"), flags, (program, path))
                below = {other[-1] for other in commands if other[:-1] == path and other}
                if below:
                    self.assertEqual({word for word in self.complete(program, *path, "") if word[0] != "-"}, below)


if __name__ == "__main__":
    if not shutil.which("help2man"):
        print("skipped: help2man is not installed")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
