#!/usr/bin/env python3
"""Hostile connections from one address keep nobody of another out of tandem-gateway, and it does not burn the processor.

crowds_test.py SCENARIO --tandemd PATH --tandem PATH --gateway PATH --viewer PATH [--count N]     Exit 0 passed, 1 failed.
"""

import argparse
import contextlib
import random
import resource
import sys
import tempfile
import time

import crowds
from gateway_test import Failed, WebStage

MOST_MORE_S = 0.5
MOST_OF_A_CORE = 0.30  # a gateway that spins takes a whole one; this bound has to hold on slow machines, too


def measure(stage, name):
    """Slowest of 14 viewers of another address, and what the gateway takes of a core meanwhile."""
    pid = stage.processes["gateway"].pid
    began, cpu = time.monotonic(), crowds.cpu_s(pid)
    taken = crowds.attempts(stage.port)
    of_a_core = (crowds.cpu_s(pid) - cpu) / (time.monotonic() - began)
    good = sorted(one for one in taken if one is not None)
    times = f"{1000 * good[len(good) // 2]:.1f} ms median, {1000 * good[-1]:.1f} ms slowest" if good else "none"
    print(f"  {name}: {len(good)} of {len(taken)} viewers, {times}, {100 * of_a_core:.1f} % of a core", flush=True)
    return len(taken) - len(good), good[-1] if good else 0, of_a_core


def one_address(stage):
    """Thousands of idle, slow, silent and talkative connections."""
    stage.server("server")
    stage.gateway("gateway")
    stage.wait(lambda: stage.health()["phase"] == "playing", "the gateway to play")
    _, alone_s, _ = measure(stage, "alone")
    wrong = []
    for kind in stage.options.kinds or crowds.CROWDS:
        with crowds.Crowd(kind, stage.port, count=stage.options.count) as crowd:
            time.sleep(4)
            failed, slowest_s, of_a_core = measure(stage, f"{crowd.held.value} {kind}")
        if failed or slowest_s > alone_s + MOST_MORE_S or of_a_core > MOST_OF_A_CORE:
            wrong.append(kind)
    if wrong:
        raise Failed(f"not held under: {', '.join(wrong)}")
    away = stage.health()["turned_away"]
    print(f"  {away}")
    if not sum(away.values()):
        raise Failed("nobody was counted")
    said = (stage.folder / "gateway.err").read_text().splitlines()
    audit = [line for line in said if "audit:" in line]  # of joins and leaves 100 at once, and 2 a second
    if len(said) - len(audit) > 20 or len(audit) > 300:
        raise Failed("the log is full of it")


def descriptors(stage):
    """Out of file descriptors: connections are closed, the log has a line, and viewers come in when there are some again."""
    stage.server("server")
    stage.gateway("gateway", "--max-viewers", 2000, "--address-connections", 2000)
    stage.wait(lambda: stage.health()["phase"] == "playing", "the gateway to play")
    pid = stage.processes["gateway"].pid
    resource.prlimit(pid, resource.RLIMIT_NOFILE, (200, 200))
    with crowds.Crowd("silent", stage.port, count=1100, per_second=500):
        time.sleep(3)
        began, cpu = time.monotonic(), crowds.cpu_s(pid)
        time.sleep(3)
        of_a_core = (crowds.cpu_s(pid) - cpu) / (time.monotonic() - began)
    print(f"  without descriptors: {100 * of_a_core:.1f} % of a core")
    if of_a_core > MOST_OF_A_CORE:
        raise Failed(f"{100 * of_a_core:.0f} % of a core")
    if (stage.folder / "gateway.err").read_text().count("out of file descriptors") != 1:
        raise Failed("not one line about descriptors")
    if measure(stage, "afterwards")[0]:
        raise Failed("no viewer comes in afterwards")


def endless(connection, flood):
    """Sends it again and again for 10 s at most. Whether the other end ends the connection."""
    connection.settimeout(0.5)
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        try:
            connection.sendall(flood)
        except TimeoutError:
            with contextlib.suppress(TimeoutError):
                connection.recv(1 << 20)
        except OSError:
            return True
    return False


def limits(stage):
    """An address behind a trusted proxy has limits of its own; who is no proxy is not believed; requests get 429."""
    stage.gateway("gateway", "--trusted-proxy", "127.0.0.5", "--address-connections", 4, "--address-joins", 6)
    held = []

    def opens(source, forwarded_for):
        connection, (kind, data) = crowds.open_viewer(stage.port, source, b"X-Forwarded-For: %s\r\n" % forwarded_for)
        held.append(connection)
        return int.from_bytes(data[:2], "big") if kind == 8 else 0

    def expect(got, wanted, what):
        if got != wanted:
            raise Failed(f"{what}: {got}, not {wanted}")
        print(f"  {what}: {got}")

    expect([opens("127.0.0.5", b"198.51.100.1") for _ in range(5)], [0, 0, 0, 0, 4010], "one client behind the proxy")
    expect(opens("127.0.0.5", b"198.51.100.1, 198.51.100.2"), 0, "another one")
    expect(opens("127.0.0.5", b"198.51.100.1, lies"), 0, "a lie of the proxy counts as its own")
    expect(opens("127.0.0.6", b"198.51.100.1"), 0, "who is no proxy")
    joins = []
    for _ in range(7):
        joins.append(opens("127.0.0.5", b"198.51.100.3"))
        held.pop().close()
        time.sleep(0.2)
    expect(joins, [0] * 6 + [4010], "seven joins, six are allowed")

    with crowds.connect(stage.port, "127.0.0.7", 3) as connection:
        answer = b""
        for _ in range(200):  # on a slow machine requests come back while they are spent
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
            answer = connection.recv(65536)
            if b"HTTP/1.1 429" in answer:
                break
        expect(b"HTTP/1.1 429" in answer, True, "the last of many requests")
    for source, flood, what in (
        ("127.0.0.9", b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n" * 1000, "who asks without end"),
        ("127.0.0.10", b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000000\r\n\r\n" + bytes(1 << 20), "who posts a gigabyte"),
    ):
        with crowds.connect(stage.port, source, 5) as connection:
            expect(endless(connection, flood), True, f"{what} is ended")
    connection, _ = crowds.open_viewer(stage.port, "127.0.0.11", b"")
    with connection:
        expect(endless(connection, bytes((0x89, 0x80, 0, 0, 0, 0)) * 10_000), True, "a viewer that sends pings without end is ended")
    began = time.monotonic()
    with crowds.connect(stage.port, "127.0.0.8", 10) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\n")
        if slow.recv(100):
            raise Failed("half a request is answered")
    expect(2.5 < time.monotonic() - began < 4, True, "a slow handshake is ended after 3 s")
    idle = [crowds.connect(stage.port, "127.0.0.4") for _ in range(2)]
    expect(idle[1].recv(12), b"HTTP/1.1 429", "a second handshake of one that may have one")
    held += idle
    health = stage.health()
    print(f"  {health['turned_away']}")
    expect(health["turned_away"]["too many bytes from an address"] >= 1, True, "floods counted")
    expect(health["refused"]["too many connections or joins from this address"], 2, "refusals counted")
    for connection in held:
        connection.close()


def bytes_of_an_address(stage):
    """Who has taken too many bytes waits for the rest of a file, and its viewers may send nothing; others notice nothing."""
    site = stage.folder / "site"
    site.mkdir()
    big = random.Random(1).randbytes(300_000)  # of two, 262,144 bytes come at once
    (site / "big.bin").write_bytes(big)
    stage.gateway("gateway", "--address-bytes", 65536)
    viewers = [crowds.open_viewer(stage.port, "127.0.0.12", b"")[0] for _ in range(8)]

    def asks(source):
        connection = crowds.connect(stage.port, source, 20)
        connection.sendall(b"GET /big.bin HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
        return connection

    def is_refused(viewer):
        viewer.sendall(b"\x82\x81" + bytes(5))
        kind, data = crowds.read_frame(viewer.makefile("rb"))
        if kind != 8:
            raise Failed(f"a message of an address that took too much: {kind}, {data}")
        print(f"  {data[2:].decode()}")
        return int.from_bytes(data[:2], "big") == 4011

    with contextlib.ExitStack() as opened, asks("127.0.0.12") as greedy, asks("127.0.0.12") as too:
        file = greedy.makefile("rb")
        file.read(100_000)
        # Between two pieces of the files the address may have some bytes again for a moment.
        if not any(is_refused(opened.enter_context(viewer)) for viewer in viewers):
            raise Failed("viewers of an address that took too much may send")
        too.settimeout(0.2)
        got = b""
        with contextlib.suppress(TimeoutError):
            while piece := too.recv(65536):
                got += piece
        if len(got) > len(big):
            raise Failed("the file did not wait")
        too.close()
        with asks("127.0.0.13") as other:
            if len(other.makefile("rb").read(200_000)) != 200_000:
                raise Failed("another address waits")
        if not file.read().endswith(big[-1000:]):
            raise Failed("the file never came")


SCENARIOS = {scenario.__name__: scenario for scenario in (one_address, descriptors, limits, bytes_of_an_address)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", choices=SCENARIOS)
    for program in ("tandemd", "tandem", "gateway", "viewer"):
        parser.add_argument(f"--{program}", required=True)
    parser.add_argument("--count", type=int, default=5000, help="connections of a crowd")
    parser.add_argument("--kinds", nargs="*", choices=crowds.CROWDS, help="crowds; all by default")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        try:
            with WebStage(options, folder) as stage:
                SCENARIOS[options.scenario](stage)
        except Failed as error:
            print(f"{options.scenario}: {error}", file=sys.stderr)
            return 1
    print(f"{options.scenario}: passed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
