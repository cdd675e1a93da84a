#!/usr/bin/env python3
"""A subscriber on Fast DDS sees a session of tandemd: live status, and every delta, as many bytes as the server says.

fastdds_test.py --tandemd PATH --tandem PATH [--subscriber PATH]        Exit 77 (not run) without a subscriber.
"""

import argparse
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

LOOPBACK = '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General></Domain></CycloneDDS>'
ENVIRONMENT = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
LIMIT_S = 30  # of any one wait; a busy machine is slow
BODIES, SECONDS = 2000, 4
OPTIONS = argparse.Namespace()


class Subscriber(unittest.TestCase):
    def start(self, *command, **more):
        process = subprocess.Popen(list(map(str, command)), env=ENVIRONMENT, stdout=subprocess.PIPE, text=True, **more)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def test_it_sees_status_and_counts_every_delta(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        # A tag would part the vendors, so a domain of its own keeps other sessions away.
        domain, session = random.Random(os.getpid()).randrange(100, 160), f"interop-{os.getpid()}"
        print(f"domain {domain}", flush=True)
        here = ("--domain", domain, "--session", session)
        log = open(pathlib.Path(scratch.name) / "log", "w", encoding="utf-8")
        self.addCleanup(log.close)

        lines, matched, statuses = [], threading.Event(), []
        subscriber = self.start(OPTIONS.subscriber, domain, session, stdin=subprocess.PIPE)

        def hear():
            for text in subscriber.stdout:
                line = json.loads(text)
                lines.append(line)
                print(text, end="", flush=True)
                if "matched" in line:
                    matched.set()
                elif "status" in line:
                    statuses.append(line)

        hearing = threading.Thread(target=hear)
        hearing.start()
        # The server makes its first frame when a participant is there, which comes when the subscriber has found the deltas.
        server = self.start(
            OPTIONS.tandemd, "--scene", "half_pipe", "--bodies", BODIES, "--predictor", "ballistic", "--wait-for", 1, "--scripted", "--json", *here,
            stderr=log,
        )  # fmt: skip
        self.assertTrue(matched.wait(LIMIT_S), "the subscriber found no deltas")
        client = self.start(OPTIONS.tandem, "join", "--seconds", SECONDS, "--timeout", LIMIT_S, "--json", *here, stderr=log)
        played = json.loads(client.communicate(timeout=LIMIT_S + SECONDS)[0])
        server.send_signal(signal.SIGINT)
        said = json.loads(server.communicate(timeout=LIMIT_S)[0])
        subscriber.stdin.close()
        hearing.join(LIMIT_S)
        self.assertEqual(subscriber.wait(LIMIT_S), 0)
        subscriber.stdout.close()
        counted = lines[-1]

        self.assertEqual(played["hash_mismatches"], 0)
        self.assertGreater(counted["frames"], 30)
        self.assertEqual(counted["first_frame"], 1)
        self.assertEqual(counted["frames"], counted["last_frame"], "frames are missing")
        self.assertEqual(counted["frames"], said["frames"])
        rate_hz = 30  # the scene's; the server reports its bytes as a rate at that
        said_bytes = said["mbit_per_s"] * 2**20 / 8 * said["frames"] / rate_hz
        self.assertEqual(counted["delta_bytes"], round(said_bytes), said)
        self.assertGreater(len(statuses), 1)
        for status in statuses:
            self.assertEqual((status["status"], status["bodies"], status["predictor"]), (session, BODIES, "ballistic"))
            self.assertLessEqual(status["frame"], counted["last_frame"])
        self.assertLess(statuses[0]["frame"], statuses[-1]["frame"])
        self.assertEqual(len({status["epoch"] for status in statuses}), 1)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("--tandemd", "--tandem"):
        parser.add_argument(name, required=True)
    parser.add_argument("--subscriber")
    OPTIONS, rest = parser.parse_known_args()
    if not OPTIONS.subscriber:
        print("not run: the build lacks libfastrtps-dev or fastddsgen (deploy/install-packages interop)")
        sys.exit(77)
    unittest.main(argv=[sys.argv[0], *rest])
