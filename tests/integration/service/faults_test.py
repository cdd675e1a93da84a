#!/usr/bin/env python3
"""What keeps a daemon from starting or writing: one line that says what, and the documented exit code.

faults_test.py --tandemd PATH [--gateway PATH]        Standard library only. What needs root is skipped without it.
"""

import argparse
import os
import pathlib
import random
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="{interface}" multicast="true"/>'
    "</Interfaces></General><Discovery><Tag>faults-test-{tag}</Tag></Discovery></Domain></CycloneDDS>"
)
LIMIT_S = 60
FAILED, WRONG_USAGE = 1, 2
NOBODY = 65534
OPTIONS = argparse.Namespace()


class Faults(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.folder.chmod(0o755)

    def run_program(self, program, *arguments, interface="lo", **more):
        environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK.format(interface=interface, tag=os.getpid())}
        domain = str(random.Random(os.getpid()).randrange(20, 90))
        return subprocess.run(
            [program, *map(str, arguments), "--domain", domain], stdin=subprocess.DEVNULL, capture_output=True, text=True,
            timeout=LIMIT_S, check=False, env=environment, **more,
        )  # fmt: skip

    def server(self, *arguments, **more):
        return self.run_program(OPTIONS.tandemd, "--scene", "cube", "--bodies", 5, "--duration", 1, *arguments, **more)

    def gateway(self, *arguments, **more):
        if not OPTIONS.gateway:
            self.skipTest("tandem-gateway is not built here")
        return self.run_program(OPTIONS.gateway, *arguments, **more)

    def says(self, done, code, *words):
        """One line that is an error, with these words; and no other line than information."""
        errors = [line for line in done.stderr.splitlines() if re.search(r"\[error\]|^tandem[a-z-]*: ", line)]
        self.assertEqual((done.returncode, len(errors)), (code, 1), done.stderr)
        for word in words:
            self.assertIn(str(word), errors[0])

    def taken_port(self):
        taken = socket.socket()
        self.addCleanup(taken.close)
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        return taken.getsockname()[1]

    def test_a_port_in_use(self):
        port = self.taken_port()
        self.says(self.server("--metrics", port), FAILED, f"127.0.0.1:{port}", "Address already in use")
        self.says(self.gateway("--port", port), FAILED, f"127.0.0.1 port {port}", "Address already in use")
        self.says(self.gateway("--port", 0, "--metrics", port), FAILED, f"127.0.0.1:{port}", "Address already in use")

    def test_a_missing_interface(self):
        for done in (self.server(interface="nosuch0"), self.gateway("--port", 0, interface="nosuch0")):
            self.says(done, FAILED, "cannot be opened", "the interfaces it names")
            self.assertIn("nosuch0: does not match an available interface", done.stderr)

    def test_a_full_disk(self):
        # One stream has one file; others would stand beside /dev/full.
        self.says(self.server("--predictor", "ballistic", "--hash-log", "/dev/full"), FAILED, "/dev/full: not all hashes could be written")
        with open("/dev/full", "wb") as full:
            environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK.format(interface="lo", tag=os.getpid())}
            done = subprocess.run([OPTIONS.tandemd, "--print-config"], stdout=full, env=environment, timeout=LIMIT_S, check=False)
        self.assertEqual(done.returncode, FAILED)

    def test_a_disk_without_room_for_checkpoints_does_not_end_the_world(self):
        if os.geteuid() != 0 or not shutil.which("unshare"):
            self.skipTest("needs root, to mount a small disk")
        # In a mount namespace of its own, so that nothing is left mounted.
        small = self.folder / "small"
        small.mkdir()
        script = f'mount -t tmpfs -o size=16k none "{small}" && exec "$@" --checkpoint-dir "{small}/world"'
        done = self.run_program(
            "unshare", "--mount", "sh", "-c", script, "sh", OPTIONS.tandemd, "--scene", "half_pipe", "--bodies", 5000,
            "--duration", 2, "--checkpoint-interval", "0.2",
        )  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"\[warning\] checkpoint: .*No space left on device")

    def test_no_permission(self):
        if os.geteuid() != 0:
            self.skipTest("needs root, to be somebody else")
        closed = self.folder / "closed"
        closed.mkdir(mode=0o700)
        (closed / "file").write_text("scene: 'cube' bodies: 5", encoding="ascii")
        # A build folder may be closed to others.
        server = shutil.copy(OPTIONS.tandemd, self.folder)
        scene = pathlib.Path(__file__).resolve().parents[3] / "services" / "engines" / "scenes" / "cube.textproto"
        scene = shutil.copy(scene, self.folder)

        def nobody(program, *arguments):
            return self.run_program(program, *arguments, user=NOBODY, group=NOBODY, extra_groups=[])

        usual = ("--scene", scene, "--bodies", 5, "--duration", 1)
        self.says(nobody(server, "--config", closed / "file"), WRONG_USAGE, closed / "file", "Permission denied")
        self.says(nobody(server, *usual, "--hash-log", closed / "log"), FAILED, closed / "log", "Permission denied")
        self.says(nobody(server, *usual, "--checkpoint-dir", closed / "w"), FAILED, closed / "w", "Permission denied")
        if OPTIONS.gateway:
            gateway = shutil.copy(OPTIONS.gateway, self.folder)
            done = nobody(gateway, "--port", 0, "--token-file", closed / "file")
            self.says(done, WRONG_USAGE, closed / "file", "Permission denied")

    def test_a_wrong_configuration(self):
        file = self.folder / "arena.textproto"
        for text, *words in [
            ('scene: "cube"\nbodies: 5\nclient_limit: 70000\n', f"{file}:3: ", '"client_limit"', "1 to 65536"),
            ('scene: "cube"\nbodies: 5\nclient_limt: 7\n', f"{file}:3: ", '"client_limt"', "unknown"),
            ('scene: "cub"\nbodies: 5\n', f"{file}:1: ", '"scene"', "known: asteroids, cube"),
            ('scene: "cube"\nwait_for: 500\nbodies: 5\n', f"{file}:2: ", '"wait_for"', "0 to 256"),
            ('scene: "cube"\nbodies: 5\nsecure: "/nowhere"\n', f"{file}:3: ", '"secure"', "tandem pki issue"),
            ('scene: "half_pipe"\nbodies: 1000000\n', f"{file}:2: ", '"bodies"', "outside the bounds"),
        ]:
            with self.subTest(text):
                file.write_text(text, encoding="ascii")
                for more in ((), ("--check-config",)):
                    self.says(self.run_program(OPTIONS.tandemd, "--config", file, *more), WRONG_USAGE, *words)
        file.write_text('scene: "cube"\nbodies: 5\n', encoding="ascii")
        done = self.run_program(OPTIONS.tandemd, "--config", file, "--check-config")
        self.assertEqual((done.returncode, done.stdout), (0, "the configuration is good\n"), done.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--tandemd", required=True)
    parser.add_argument("--gateway")
    OPTIONS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])
