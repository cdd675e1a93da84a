#!/usr/bin/env python3
"""The daemons as services: what they tell systemd, by the protocol of sd_notify(3), from start to end.

service_test.py --tandemd PATH [--gateway PATH]        Standard library only.
"""

import argparse
import os
import pathlib
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/>'
    "</Interfaces></General><Discovery><Tag>service-test-{tag}</Tag></Discovery></Domain></CycloneDDS>"
)
LIMIT_S = 60  # of any one wait; a busy machine is slow
OPTIONS = argparse.Namespace()


class Service:
    """A daemon with a watchdog of 1 s, and what it has said."""

    def __init__(self, folder, *command, environment=None):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(folder / "notify"))
        self.socket.settimeout(0.1)
        self.said = []
        self.log = folder / "log"
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                env={**os.environ, "CYCLONEDDS_URI": LOOPBACK.format(tag=os.getpid()), "NOTIFY_SOCKET": str(folder / "notify"),
                     "WATCHDOG_USEC": "1000000", **(environment or {})},
            )  # fmt: skip

    def hear(self, wanted, count=1):
        """Waits until it has said `wanted`, or something that begins so, `count` times in all."""
        deadline = time.monotonic() + LIMIT_S
        while sum(message.startswith(wanted) for message in self.said) < count:
            if time.monotonic() > deadline:
                raise AssertionError(f"no '{wanted}' in {self.said}; the log: {self.log.read_text()}")
            try:
                self.said.append(self.socket.recv(4096).decode())
            except TimeoutError:
                if self.process.poll() is not None:
                    raise AssertionError(f"ended without '{wanted}'; said {self.said}; the log: {self.log.read_text()}") from None
        return [message for message in self.said if message.startswith(wanted)][-1]

    def end(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.socket.close()


class Daemons(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.domain = str(random.Random(os.getpid()).randrange(20, 90))

    def start(self, *command, **more):
        service = Service(self.folder, *map(str, command), "--domain", self.domain, **more)
        self.addCleanup(service.end)
        return service

    def check_life(self, service):
        service.hear("READY=1")
        self.assertEqual(service.said[0], "READY=1")
        service.hear("WATCHDOG=1", 5)
        self.assertEqual(service.said.count("READY=1"), 1)
        status = service.hear("STATUS=")
        service.process.send_signal(signal.SIGTERM)
        service.hear("STOPPING=1")
        self.assertEqual(service.process.wait(LIMIT_S), 0)
        return status

    def server(self, *arguments, **more):
        return self.start(OPTIONS.tandemd, "--scene", "cube", "--bodies", 50, "--session", "arena", *arguments, **more)

    def test_a_server_is_ready_when_it_has_announced_its_session_and_says_that_it_lives(self):
        self.assertIn("session 'arena', frame ", self.check_life(self.server()))

    def test_a_server_that_waits_for_participants_is_ready(self):
        self.assertIn("waits for participants", self.check_life(self.server("--wait-for", 3)))

    def test_a_server_that_waits_for_its_engine_asks_for_more_time(self):
        service = self.start(OPTIONS.tandemd, "--engine-socket", self.folder / "door", "--session", "arena")
        self.assertIn("waits for its engine", service.hear("EXTEND_TIMEOUT_USEC=", 2))
        self.assertNotIn("READY=1", service.said)
        service.process.send_signal(signal.SIGTERM)
        self.assertEqual(service.process.wait(LIMIT_S), 0)

    def test_a_server_that_hangs_is_silent(self):
        service = self.server()
        service.hear("WATCHDOG=1", 2)
        service.process.send_signal(signal.SIGSTOP)
        time.sleep(0.2)
        service.socket.setblocking(False)
        try:
            while True:
                service.socket.recv(4096)
        except BlockingIOError:
            pass
        service.socket.settimeout(2)  # twice the watchdog's time
        with self.assertRaises(TimeoutError):
            service.socket.recv(4096)

    def test_a_server_that_cannot_start_is_never_ready(self):
        taken = socket.socket()
        self.addCleanup(taken.close)
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        service = self.server("--metrics", taken.getsockname()[1])
        self.assertEqual(service.process.wait(LIMIT_S), 1)
        service.socket.setblocking(False)
        with self.assertRaises(BlockingIOError):
            while True:
                self.assertNotIn("READY", service.socket.recv(4096).decode())

    def logged(self, service, text):
        deadline = time.monotonic() + LIMIT_S
        while text not in service.log.read_text():
            self.assertLess(time.monotonic(), deadline, service.log.read_text())
            time.sleep(0.02)

    def test_a_server_reads_its_configuration_again_at_sighup(self):
        file = self.folder / "arena.textproto"
        common = 'scene: "cube"\nsession: "arena"\n'
        file.write_text(common + "bodies: 50\n", encoding="ascii")
        service = self.start(OPTIONS.tandemd, "--config", file)
        service.hear("READY=1")
        for text, *told in [
            ("bodies: 50\nclient_limit: 9\n", "[info] configuration: changed client_limit"),
            ("bodies: 60\nclient_limit: 9\n", "[warning] configuration: not changed, as this needs a restart: bodies"),
            ("bodies: 50\nclient_limit: 0\n", f'[error] the configuration stays as it was: {file}:4: field "client_limit"'),
        ]:
            file.write_text(common + text, encoding="ascii")
            reloads = sum(message.startswith("RELOADING=1\nMONOTONIC_USEC=") for message in service.said)
            service.process.send_signal(signal.SIGHUP)
            service.hear("RELOADING=1\nMONOTONIC_USEC=", reloads + 1)
            service.hear("READY=1", reloads + 2)
            for line in told:
                self.logged(service, line)
        service.process.send_signal(signal.SIGTERM)
        self.assertEqual(service.process.wait(LIMIT_S), 0)

    def test_without_a_configuration_file_sighup_ends_a_server(self):
        service = self.server()
        service.hear("READY=1")
        service.process.send_signal(signal.SIGHUP)
        service.hear("STOPPING=1")
        self.assertEqual(service.process.wait(LIMIT_S), 0)

    def test_a_gateway_is_ready_when_it_listens_and_says_that_it_lives(self):
        if not OPTIONS.gateway:
            self.skipTest("tandem-gateway is not built here")
        status = self.check_life(self.start(OPTIONS.gateway, "--port", 0, "--session", "arena"))
        self.assertIn("searching", status)

    def test_a_gateway_uses_what_systemd_hands_over(self):
        if not OPTIONS.gateway:
            self.skipTest("tandem-gateway is not built here")
        (self.folder / "token").write_text("open-sesame-0123456789\n")
        (self.folder / "tls-key").write_text("no certificate beside it")
        hands_over = {"CREDENTIALS_DIRECTORY": str(self.folder)}
        service = self.start(OPTIONS.gateway, "--port", 0, environment=hands_over)
        self.assertEqual(service.process.wait(LIMIT_S), 2)
        self.assertIn("tls-key has no certificate: --tls-cert, or the systemd credential tls-cert", service.log.read_text())
        service.end()
        (self.folder / "tls-key").unlink()
        (self.folder / "notify").unlink()
        service = self.start(OPTIONS.gateway, "--port", 0, "--listen", "0.0.0.0", environment=hands_over)
        service.hear("READY=1")
        self.assertIn("can read the token on its way", service.log.read_text())


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--tandemd", required=True)
    parser.add_argument("--gateway")
    OPTIONS, rest = parser.parse_known_args()
    unittest.main(argv=[sys.argv[0], *rest])
