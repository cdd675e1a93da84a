#!/usr/bin/env python3
"""Clients of different make in one session: each sends inputs, and all hold the same states.

clients_test.py --tandemd PATH [--frames N] [--inputs N] NAME=COMMAND...

A client is called with SESSION DOMAIN FRAMES INPUTS: it plays until it has applied so many frames and so many inputs of
its own acted, prints EPOCH,FRAME,HASH for frames that it holds, and exits with 0 where no hash differed from the
server's. Standard library only. Exit 0 passed, 1 failed.
"""

import argparse
import os
import pathlib
import random
import shlex
import subprocess
import sys
import tempfile

# Without multicast: qemu cannot set it up.
LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><AllowMulticast>false</AllowMulticast><Interfaces>'
    '<NetworkInterface name="lo" multicast="false"/></Interfaces></General><Discovery>'
    '<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>'
    f"<Tag>clients-test-{os.getpid()}</Tag></Discovery></Domain></CycloneDDS>"
)
LIMIT_S = 240
SESSION = "clients"


def hashes(text):
    """{(epoch, frame): hash}."""
    lines = (line.split(",") for line in text.split("\n")[:-1])
    return {(int(epoch), int(frame)): value for epoch, frame, value in lines}


def play(options, folder):
    """The server's hashes, and each client's."""
    environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
    domain = str(random.Random(os.getpid()).randrange(20, 90))
    log = folder / "server.hashes"
    names = [client.partition("=")[0] for client in options.clients]
    server = subprocess.Popen(
        [options.tandemd, "--scene", "half_pipe", "--bodies", "400", "--session", SESSION, "--domain", domain,
         "--predictor", "field", "--wait-for", str(len(names)), "--stall-timeout", "off", "--hash-log", log],  # no client is too slow
        env=environment, stdout=subprocess.DEVNULL, stderr=(folder / "server.err").open("wb"),
    )  # fmt: skip
    clients = {}
    try:
        for name, _, command in (client.partition("=") for client in options.clients):
            arguments = [*shlex.split(command), SESSION, domain, str(options.frames), str(options.inputs)]
            clients[name] = subprocess.Popen(
                arguments, env=environment, stdout=(folder / f"{name}.out").open("wb"), stderr=(folder / f"{name}.err").open("wb")
            )
        for name, process in clients.items():
            code = process.wait(LIMIT_S)
            said = (folder / f"{name}.err").read_text(errors="replace")
            print(f"{name}: {said.strip()}", flush=True)
            assert code == 0, f"{name} ended with {code}"
    finally:
        for process in clients.values():
            process.kill()
            process.wait()
        server.terminate()
        server.wait(LIMIT_S)
    return hashes(log.read_text(encoding="ascii")), {
        name: hashes((folder / f"{name}.out").read_text(encoding="ascii")) for name in names
    }


def check(options, truth, held):
    for name, states in held.items():
        assert len(states) >= options.frames * 2 // 3, f"{name} told of {len(states)} frames only"
        wrong = [frame for frame, value in states.items() if truth.get(frame) != value]
        assert not wrong, f"{name} holds other states than the server, first {min(wrong)}"
    everywhere = set.intersection(*(set(states) for states in held.values()))
    print(f"{len(everywhere)} frames were looked at by all of {', '.join(held)} and agree with the server's")
    assert len(everywhere) >= options.frames // 4, "hardly a frame was looked at by all"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tandemd", type=pathlib.Path, required=True)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--inputs", type=int, default=10)
    parser.add_argument("clients", nargs="+", metavar="NAME=COMMAND")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        try:
            check(options, *play(options, pathlib.Path(folder)))
        except (AssertionError, subprocess.TimeoutExpired) as failure:
            print(f"FAILED: {failure}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
