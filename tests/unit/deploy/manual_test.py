"""The manual pages and completions have every option of the programs, and man, bash and zsh accept them.

manual_test.py PROGRAM...        Without man, bash or zsh, what needs it is skipped.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

GENERATE = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "manual" / "generate"
PROGRAMS = [pathlib.Path(argument) for argument in sys.argv[1:]]


def run(*command, **more):
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, timeout=60, **more)


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
        cls.share = pathlib.Path(scratch.name) / "share"
        descriptions = []
        for program in PROGRAMS:
            description = pathlib.Path(scratch.name) / program.name
            done = run(program, "--describe-options")
            assert done.returncode == 0, done.stderr
            description.write_text(done.stdout, encoding="utf-8")
            descriptions.append(description)
        done = run(sys.executable, "-B", GENERATE, *descriptions, "--out", cls.share)
        assert done.returncode == 0, done.stderr
        cls.flags = {program.name: flags_of(program) for program in PROGRAMS}

    def complete(self, program, *words):
        """What bash offers after these words, of which the last may be the beginning of one."""
        script = (
            'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
            f"_{program.replace('-', '_')}; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        )
        file = self.share / "bash-completion" / "completions" / program
        done = run("bash", "-c", script, "bash", file, program, *words, cwd=self.share)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return set(done.stdout.split())

    def test_every_option_is_in_the_manual(self):
        for program, commands in self.flags.items():
            self.assertGreater(len(commands[()]), 1)
            for path, flags in commands.items():
                page = self.share / "man" / "man1" / ("-".join([program, *path[:1]]) + ".1")
                text = page.read_text(encoding="utf-8").replace("\\-", "-")
                for flag in flags:
                    self.assertIn(f"\\fB{flag}\\fR", text, page.name)

    def test_man_has_nothing_to_say(self):
        if not shutil.which("man") or not shutil.which("groff"):
            self.skipTest("man or groff is not installed")
        for page in (self.share / "man" / "man1").iterdir():
            done = run("man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", page, env={**os.environ, "MANWIDTH": "80"})
            self.assertEqual((done.returncode, done.stderr), (0, ""), page.name)

    def test_bash_offers_every_option_and_command(self):
        for program, commands in self.flags.items():
            for path, flags in commands.items():
                self.assertEqual(self.complete(program, *path, "-"), flags, (program, path))
                below = {other[-1] for other in commands if other[:-1] == path and other}
                if below:
                    self.assertEqual(self.complete(program, *path, ""), below)

    def test_bash_offers_the_words_that_a_server_takes(self):
        self.assertEqual(self.complete("tandemd", "--log-format", ""), {"text", "json"})
        self.assertEqual(self.complete("tandemd", "--checkpoint", ""), {"auto", "require", "off"})
        self.assertIn("auto", self.complete("tandemd", "--predictor", ""))
        self.assertEqual(self.complete("tandemd", "--codec", "e"), {"entropy"})
        self.assertEqual(self.complete("tandemd", "--config", "m"), {"man"})

    def test_bash_offers_values_and_files(self):
        if "tandem" not in self.flags or ("bench", "memory") not in self.flags["tandem"]:
            self.skipTest("tandem is built without bench")
        self.assertEqual(self.complete("tandem", "bench", "memory", "--codec", "e"), {"entropy"})
        self.assertEqual(self.complete("tandem", "bench", "memory", "--codec", "entropy", "--fr"), {"--frames"})
        self.assertEqual(self.complete("tandem", "record", "m"), {"man"})

    def test_zsh_understands_its_completion(self):
        if not shutil.which("zsh"):
            self.skipTest("zsh is not installed")
        for program, commands in self.flags.items():
            file = self.share / "zsh" / "site-functions" / f"_{program}"
            text = file.read_text(encoding="utf-8")
            for flags in commands.values():
                for flag in flags:
                    self.assertIn(f"{flag}[", text)
            # The specifications are what _arguments gets; a wrong one is an error of comparguments.
            script = (
                "autoload -Uz compinit && compinit -u -D; "
                "_arguments() { local spec; for spec in \"${@:#-C}\"; do [[ $spec == (\\*|)(-*\\[*\\](:*:*|)|:*:*) || $spec == '1:'* ]] "
                '|| { print -r -- "$spec"; exit 1 }; done }; source "$1"'
            )
            # compinit may write into the home directory.
            done = run("zsh", "-f", "-c", script, "zsh", file, env={**os.environ, "HOME": self.share, "ZDOTDIR": self.share})
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""), program)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
