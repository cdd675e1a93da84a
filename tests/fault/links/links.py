#!/usr/bin/env python3
"""Sessions over thin and broken links: a network namespace of this test's own, a token bucket on its loopback.

links.py --tandemd PATH --tandem PATH [--list | --short | CASE ...]

Without CASE all run, some five minutes; with --short two of them, in twenty seconds. Exit 0 passed, 1 failed, 77 not run: namespaces are not allowed here.
"""

import argparse
import ctypes
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

NOT_RUN = 77
HERE = pathlib.Path(__file__).resolve()
QUEUE_MS = 400  # what a router keeps before it drops
SEED = 1
URI = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    "</General></Domain></CycloneDDS>"
)
CLONE_NEWNET = 0x40000000


class Failed(Exception):
    """What was measured is not what it must be."""


def shell(*words):
    subprocess.run(words, check=True, capture_output=True, text=True)


def enter_namespace():
    """A network of our own, gone with this process. As root directly, otherwise through a user namespace."""
    if ctypes.CDLL(None, use_errno=True).unshare(CLONE_NEWNET) != 0:
        if os.environ.get("TANDEM_LINKS_INNER"):
            return False
        os.environ["TANDEM_LINKS_INNER"] = "1"
        try:
            os.execvp("unshare", ["unshare", "--user", "--map-root-user", sys.executable, "-B", *sys.argv])
        except OSError:
            return False
    try:
        shell("ip", "link", "set", "lo", "mtu", "1500", "up")
        shell("ip", "link", "set", "lo", "multicast", "on")
        shell("ip", "route", "add", "224.0.0.0/4", "dev", "lo")
        shell("tc", "qdisc", "add", "dev", "lo", "root", "tbf", "rate", "1gbit", "burst", "1mb", "latency", "400ms")
    except (OSError, subprocess.CalledProcessError):
        return False
    return True


def link(kbit):
    """The rate of everything that goes through loopback from now on."""
    burst = max(4000, kbit * 1000 // 8 // 100)
    shell("tc", "qdisc", "replace", "dev", "lo", "root", "tbf", "rate", f"{kbit}kbit", "burst", str(burst),
          "latency", f"{QUEUE_MS}ms")  # fmt: skip


def fast_link():
    shell("tc", "qdisc", "replace", "dev", "lo", "root", "tbf", "rate", "1gbit", "burst", "1mb", "latency", "400ms")


def cut_link():
    """Every packet is larger than the bucket, and so dropped."""
    shell("tc", "qdisc", "replace", "dev", "lo", "root", "tbf", "rate", "8kbit", "burst", "20", "limit", "20")


def loopback_bytes():
    """Received so far by loopback, which is all that was sent and not dropped, headers and all."""
    return int(re.search(r"^\s*lo:\s*(\d+)", pathlib.Path("/proc/self/net/dev").read_text(), re.M)[1])


class Process:
    """A program whose stderr is read line by line, with the time of each."""

    def __init__(self, *command):
        self.started = time.monotonic()
        self.lines = []
        self.process = subprocess.Popen(
            [str(word) for word in command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, env={**os.environ, "CYCLONEDDS_URI": URI},
        )  # fmt: skip
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stderr:
            self.lines.append((time.monotonic(), line.rstrip()))

    def first(self, text, after=0.0):
        """When a line with that text came, or None."""
        return next((at for at, line in list(self.lines) if at >= after and text in line), None)

    def wait_for(self, text, seconds, after=0.0):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if (at := self.first(text, after)) is not None:
                return at
            if self.process.poll() is not None:
                break
            time.sleep(0.01)
        tail = "\n".join(line for _, line in self.lines[-8:])
        raise Failed(f"waited {seconds:.0f} s for '{text}'; it said last:\n{tail}")

    def live(self):
        """The live lines of a client, with the time of each."""
        return [(at, json.loads(line)) for at, line in list(self.lines) if line.startswith("{")]

    def stop(self):
        self.process.send_signal(signal.SIGCONT)
        self.process.send_signal(signal.SIGINT)
        try:
            out = self.process.stdout.read()
            self.process.wait(30)
        finally:
            self.process.kill()
        return json.loads(out) if out.strip().startswith("{") else {}


class Stage:
    def __init__(self, options):
        self.options = options
        self.running = []
        self.folder = tempfile.mkdtemp()

    def start(self, *command):
        self.running.append(Process(*command))
        return self.running[-1]

    def server(self, bodies, *more, scene="half_pipe"):
        server = self.start(
            self.options.tandemd, "--scene", scene, "--bodies", bodies, "--seed", SEED, "--json", *more
        )  # fmt: skip
        server.wait_for("session 'default'", 60)
        time.sleep(2.0)  # the claim of the name, and some frames
        return server

    def client(self, *more):
        return self.start(self.options.tandem, "join", "--json", "--live", *more)

    def end(self):
        for each in self.running:
            if each.process.poll() is None:
                each.process.kill()
            each.process.wait()
        shutil.rmtree(self.folder)


def snapshots(server_report):
    return server_report["snapshots"], server_report["snapshot_bytes"]


def join(stage, bodies, kbit, *more, settle=0):
    """A participant joins over a thin link, of which the stream takes a quarter at most: one snapshot, at its rate."""
    server = stage.server(bodies, *more)
    time.sleep(settle)
    link(kbit)
    client = stage.client()
    at = client.wait_for("playing from frame", 45)
    took = at - client.started
    found = client.first("found session") - client.started
    time.sleep(3)
    report, served = client.stop(), server.stop()
    made, size = snapshots(served)
    limit = 1.5 * size / made * 8 / (kbit * 1000) + 3
    print(f"  playing after {took:.1f} s (limit {limit:.1f}); {made} snapshot of {size // made} bytes, "
          f"{size / made / bodies:.1f} a body; session found after {found:.1f} s; {report['resyncs']} rejoins")  # fmt: skip
    if took > limit:
        raise Failed(f"joined after {took:.1f} s")
    if made != 1:
        raise Failed(f"{made} snapshots were made")
    if report["hash_mismatches"] or report["resyncs"]:
        raise Failed(f"{report['hash_mismatches']} mismatches, {report['resyncs']} rejoins")


def stopped(stage):
    """One of two participants on a link of 1 Mbit/s is stopped for 25 s."""
    stage.server(20_000)
    link(1000)
    steady = stage.client()
    steady.wait_for("playing from frame", 60)
    frozen = stage.client()
    frozen.wait_for("playing from frame", 60)
    time.sleep(3)
    frozen.process.send_signal(signal.SIGSTOP)
    stopped_at = time.monotonic()
    time.sleep(25)
    frozen.process.send_signal(signal.SIGCONT)
    resumed_at = time.monotonic()
    time.sleep(14)
    frames = [(at, line) for at, line in steady.live() if at > stopped_at + 3]
    slowest = min(line["frames_per_s"] for _, line in frames)
    newest = {at: line["frame"] for at, line in steady.live()}
    back = None
    for at, line in frozen.live():
        if at <= resumed_at + 0.2 or line["phase"] != "playing":
            continue
        nearest = min(newest, key=lambda t: abs(t - at))
        if line["frame"] + 45 >= newest[nearest] + 30 * (at - nearest):
            back = at - resumed_at
            break
    print(f"  the other never below {slowest:.1f} frames/s after the first 3 s; "
          f"back after {back and round(back, 1)} s; rejoins {frozen.live()[-1][1]['resyncs']}")  # fmt: skip
    if back is None or back > 10:
        raise Failed("the stopped participant did not come back within 10 s")
    if slowest < 29:
        raise Failed(f"the other was dragged down to {slowest:.1f} frames/s")
    if frozen.stop()["hash_mismatches"] or steady.stop()["hash_mismatches"]:
        raise Failed("hash mismatch")


def lost(stage, seconds, limit):
    """The link is gone for a while: no snapshot, and soon caught up."""
    server = stage.server(10_000, "--predictor", "field")
    client = stage.client()
    client.wait_for("playing from frame", 60)
    time.sleep(4)
    before = client.live()[-1][1]["frame"], time.monotonic()
    cut_link()
    time.sleep(seconds)
    fast_link()
    returned = time.monotonic()
    time.sleep(limit + 3)
    rate = client.live()[-1][1]
    caught = None
    # A live line a second: the first whose frame is about the one due.
    for at, line in client.live():
        due = before[0] + 30 * (at - before[1])
        if at > returned and line["frame"] > due - 40 - 3 and line["phase"] == "playing":
            caught = at - returned
            break
    report = client.stop()
    made, _ = snapshots(server.stop())
    print(f"  lost for {seconds} s: caught up {caught and round(caught, 1)} s after its return (limit {limit}), "
          f"{made} snapshots, {report['resyncs']} rejoins, at {rate['frames_per_s']:.0f} frames/s")  # fmt: skip
    if made != 1 or report["resyncs"]:
        raise Failed("a short loss took a snapshot")
    if report["hash_mismatches"]:
        raise Failed("hash mismatch")
    if caught is None or caught > limit + 1:  # lines come once a second
        raise Failed("not caught up in time")


class Sniffer:
    """Bytes on loopback since it was made, headers and all: of datagrams with a delta, and of all others."""

    ETHERTYPE_ALL, OUTGOING, ETHERNET_BYTES, IP_BYTES, UDP_BYTES = 3, 4, 14, 20, 8

    def __init__(self):
        self.deltas = self.others = 0
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(self.ETHERTYPE_ALL))
        self.socket.bind(("lo", 0))
        self.socket.settimeout(0.2)
        self.ended = False
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        while not self.ended:
            try:
                frame, address = self.socket.recvfrom(65536)
            except TimeoutError:
                continue
            if address[2] != self.OUTGOING:
                continue
            if self.is_delta(frame):
                self.deltas += len(frame) - self.ETHERNET_BYTES
            else:
                self.others += len(frame) - self.ETHERNET_BYTES

    def is_delta(self, frame):
        """A user's writer without a key (entity kind 0x03) sends DATA: deltas, scheduled inputs, snapshots."""
        rtps = frame[self.ETHERNET_BYTES + self.IP_BYTES + self.UDP_BYTES :]
        if rtps[:4] != b"RTPS":
            return False
        at = 20
        while at + 16 <= len(rtps):
            kind, size = rtps[at], struct.unpack_from("<H", rtps, at + 2)[0]
            if kind in (0x15, 0x16) and rtps[at + 15] == 0x03:
                return True
            if size == 0:
                break
            at += 4 + size
        return False

    def stop(self):
        self.ended = True
        self.thread.join()
        return self.deltas, self.others


def traffic(stage, role, count, limit, script=None):
    """What clients cost besides deltas, on loopback counters, per client."""
    stage.server(1_000)
    more = ["--observe"] if role == "observer" else []
    if script:
        more += ["--input-script", script]
    clients = stage.client("--count", count, *more)
    clients.wait_for("playing from frame", 60)
    time.sleep(8)
    sniffer, begun = Sniffer(), time.monotonic()
    time.sleep(10)
    seconds = time.monotonic() - begun
    deltas, others = (total * 8 / 1000 / seconds for total in sniffer.stop())
    print(f"  {count} {role}s: deltas {deltas:.1f} kbit/s, everything else {others / count:.1f} kbit/s each (aim {limit})")
    if clients.stop()["clients"][0]["hash_mismatches"]:
        raise Failed("hash mismatch")


def busy(stage):
    """20 inputs a second in all, by ten participants."""
    path = pathlib.Path(stage.folder) / "script.textproto"
    with open(path, "w", encoding="ascii") as out:
        for i in range(80):
            out.write(f"inputs {{ time_s: {0.5 + i * 0.5:.2f} gravity {{ x: {i % 5} y: 0 z: -9 }} }}\n")
    traffic(stage, "participant", 10, 40, path)


CASES = {
    "join_10000_at_512": lambda stage: join(stage, 10_000, 512),
    "join_10000_at_256": lambda stage: join(stage, 10_000, 256, settle=20),
    "join_20000_at_1000": lambda stage: join(stage, 20_000, 1000, settle=20),
    "join_65536_at_4000": lambda stage: join(stage, 65_536, 4000, "--predictor", "field", settle=20),
    "stopped_25_s": stopped,
    "lost_0.5_s": lambda stage: lost(stage, 0.5, 1),
    "lost_5_s": lambda stage: lost(stage, 5, 2),
    "lost_20_s": lambda stage: lost(stage, 20, 4),
    "traffic_observers": lambda stage: traffic(stage, "observer", 10, 5),
    "traffic_participants": lambda stage: traffic(stage, "participant", 10, 20),
    "traffic_inputs": busy,
}


SHORT = ["join_10000_at_512", "lost_0.5_s"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tandemd", type=pathlib.Path, required=True)
    parser.add_argument("--tandem", type=pathlib.Path, required=True)
    parser.add_argument("--list", action="store_true", help="the names of all cases")
    parser.add_argument("--short", action="store_true", help="a thin and a lost link alone")
    parser.add_argument("cases", nargs="*", metavar="CASE")
    options = parser.parse_args()
    if options.list:
        print("\n".join(CASES))
        return 0
    if options.short:
        options.cases = SHORT
    unknown = [case for case in options.cases if case not in CASES]
    if unknown:
        parser.error(f"no case {unknown[0]}; --list says which there are")
    if not enter_namespace():
        print("not run: network namespaces or tc are not allowed here")
        return NOT_RUN
    failures = 0
    for name in options.cases or CASES:
        print(f"{name}:", flush=True)
        fast_link()
        stage = Stage(options)
        try:
            CASES[name](stage)
        except Failed as failure:
            failures += 1
            print(f"  FAILED: {failure}", flush=True)
        finally:
            fast_link()
            stage.end()
    print(f"{failures} failed" if failures else "passed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
