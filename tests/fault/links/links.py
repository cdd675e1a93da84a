#!/usr/bin/env python3
"""Sessions over thin and broken links: a network namespace of this test's own, a token bucket on its loopback.

links.py --tandemd PATH --tandem PATH [--gateway PATH --viewer PATH] [--list | --short | CASE ...]

Cases of viewers need a gateway and tests/integration/gateway's viewer, and are left out without. Without CASE all run, some ten minutes; with --short two of them, in twenty seconds. Exit 0 passed, 1 failed, 77 not run:
namespaces are not allowed here.
"""

import json
import pathlib
import re
import signal
import socket
import struct
import sys
import threading
import time
import urllib.request

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from stage import QUEUE_MS, Failed, arguments, cut_link, fast_link, link, run, shell  # noqa: E402


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
    limit = 1.5 * size / made * 8 / (kbit * 1000) + 5  # discovery, and a window that opens slowly
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


def lost(stage, seconds, limit, *more):
    """The link is gone for a while: no snapshot, and soon caught up."""
    server = stage.server(10_000, "--predictor", "field", *more)
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
    # There is a live line per second; this takes the first whose frame is about the one due.
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


def duplex_link(kbit):
    """Limit the rate each way between the server, the first DDS participant of the domain, and the second. Multicast is not limited."""
    fast = ("rate", "10gbit", "quantum", "60000")
    shell("tc", "qdisc", "del", "dev", "lo", "root")
    shell("tc", "qdisc", "add", "dev", "lo", "root", "handle", "1:", "htb", "default", "1")
    for way, ports in ((1, ()), (2, (7410, 7411)), (3, (7412, 7413))):
        shell("tc", "class", "add", "dev", "lo", "parent", "1:", "classid", f"1:{way}", "htb", *fast)
        for port in ports:
            shell("tc", "filter", "add", "dev", "lo", "parent", "1:", "protocol", "ip", "u32", "match", "ip", "dport", str(port),
                  "0xffff", "flowid", f"1:{way}")  # fmt: skip
        if ports:
            shell("tc", "qdisc", "add", "dev", "lo", "parent", f"1:{way}", "tbf", "rate", f"{kbit}kbit", "burst", "4000",
                  "latency", f"{QUEUE_MS}ms")  # fmt: skip


def choice(stage, kbit, expected, joins_at=None):
    """A fast machine behind a thin link, with no flag anywhere: it takes the stream that fits, and plays at the full rate."""
    server = stage.server(10_000)
    time.sleep(20)
    duplex_link(joins_at or kbit)
    client = stage.client()
    took = client.wait_for("playing from frame", 60) - client.started
    if joins_at:
        duplex_link(kbit)
    time.sleep(25)
    rates = [line["frames_per_s"] for _, line in client.live() if line["phase"] == "playing"][3:]
    report, served = client.stop(), server.stop()
    print(f"  {kbit} kbit/s: playing after {took:.1f} s, stream {report['stream']} ({report['stream_reason']}), "
          f"{report['mbit_per_s'] * 1048.576:.0f} kbit/s of payload, {sum(rates) / len(rates):.1f} frames/s, {report['resyncs']} rejoins, "
          f"{report['stream_changes']} changes; server: {served['stalls']} stalls")  # fmt: skip
    if report["hash_mismatches"] or report["resyncs"]:
        raise Failed(f"{report['hash_mismatches']} mismatches, {report['resyncs']} rejoins")
    if report["stream"] != expected:
        raise Failed(f"stream {report['stream']}")
    if sum(rates) / len(rates) < 29:
        raise Failed(f"{sum(rates) / len(rates):.1f} frames/s")


class Sniffer:
    """Counts the bytes on loopback, with all headers: those of datagrams with a delta, and those of all others."""

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
        """True for DATA of a user's writer without a key (entity kind 0x03): deltas, scheduled inputs, snapshots."""
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
    """Measure the traffic per client besides deltas, by the counters of loopback."""
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
    """Ten participants send 20 inputs a second in all."""
    path = pathlib.Path(stage.folder) / "script.textproto"
    with open(path, "w", encoding="ascii") as out:
        for i in range(80):
            out.write(f"inputs {{ time_s: {0.5 + i * 0.5:.2f} gravity {{ x: {i % 5} y: 0 z: -9 }} }}\n")
    traffic(stage, "participant", 10, 40, path)


def thin_viewers(kbit, port):
    """The rate of everything that a gateway sends its viewers, who stand behind one such link; the rest is fast."""
    fast = ("rate", "10gbit", "quantum", "60000")
    shell("tc", "qdisc", "replace", "dev", "lo", "root", "handle", "1:", "htb", "default", "1")
    shell("tc", "class", "add", "dev", "lo", "parent", "1:", "classid", "1:1", "htb", *fast)
    shell("tc", "class", "add", "dev", "lo", "parent", "1:", "classid", "1:2", "htb", *fast)
    shell("tc", "qdisc", "add", "dev", "lo", "parent", "1:2", "tbf", "rate", f"{kbit}kbit", "burst", "4000",
          "latency", f"{QUEUE_MS}ms")  # fmt: skip
    shell("tc", "filter", "add", "dev", "lo", "parent", "1:", "protocol", "ip", "u32", "match", "ip", "sport", str(port),
          "0xffff", "flowid", "1:2")  # fmt: skip


def viewer(stage, bodies, kbit):
    """A viewer joins a gateway over a thin link and plays: one snapshot at the link's pace, nothing left out."""
    server = stage.server(bodies)
    gateway = stage.start(stage.options.gateway, "--port", 0)
    gateway.wait_for("playing from frame", 30)
    time.sleep(15)  # bodies in order make a snapshot small
    port = next(int(found[1]) for _, line in gateway.lines if (found := re.search(r"http://127.0.0.1:(\d+)/", line)))
    thin_viewers(kbit, port)
    joined = stage.start(stage.options.viewer, "--port", port, "--seconds", 20, "--timeout", 70)
    report = joined.output(90)
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/healthz", timeout=20) as answer:
        health = json.load(answer)
    served = server.stop()
    limit = 1.5 * 20 * bodies * 8 / (kbit * 1000) + 3  # for a snapshot of 20 bytes a body
    print(f"  playing after {report['join_ms'] / 1000:.1f} s (limit {limit:.1f}); "
          f"{report['frames_applied']} frames in 20 s, {health['snapshots']} snapshots, {health['fell_behind']} skips, "
          f"{report['resyncs']} rejoins, round trip {report['round_trip_ms']:.0f} ms; server: {served['stalls']} stalls")  # fmt: skip
    if report["join_ms"] > 1000 * limit:
        raise Failed("joined too late")
    if report["hash_mismatches"] or report["resyncs"] or health["fell_behind"] or health["snapshots"] > 1:
        raise Failed(f"{report}, {health}")
    if report["frames_applied"] < 0.95 * 20 * 30:
        raise Failed(f"{report['frames_applied']} frames in 20 s")


CASES = {
    "join_10000_at_512": lambda stage: join(stage, 10_000, 512),
    "join_10000_at_256": lambda stage: join(stage, 10_000, 256, settle=20),
    "join_20000_at_1000": lambda stage: join(stage, 20_000, 1000, settle=20),
    "join_65536_at_4000": lambda stage: join(stage, 65_536, 4000, "--predictor", "field", settle=20),
    "choice_at_100": lambda stage: choice(stage, 100, "rich", joins_at=160),
    "choice_at_160": lambda stage: choice(stage, 160, "rich"),
    "choice_at_256": lambda stage: choice(stage, 256, "rich"),
    "stopped_25_s": stopped,
    "lost_0.5_s": lambda stage: lost(stage, 0.5, 1),
    "lost_5_s": lambda stage: lost(stage, 5, 2),
    "lost_20_s": lambda stage: lost(stage, 20, 4),
    # These users send far more inputs than a late joiner is handed.
    "lost_20_s_with_inputs": lambda stage: lost(stage, 20, 4, "--scripted", "--users", 256),
    "traffic_observers": lambda stage: traffic(stage, "observer", 10, 5),
    "traffic_participants": lambda stage: traffic(stage, "participant", 10, 20),
    "traffic_inputs": busy,
}
VIEWERS = {
    "viewer_10000_at_256": lambda stage: viewer(stage, 10_000, 256),
}


SHORT = ["join_10000_at_512", "lost_0.5_s"]


def main():
    parser = arguments(__doc__, "a thin and a lost link alone")
    parser.add_argument("--gateway", type=pathlib.Path)
    parser.add_argument("--viewer", type=pathlib.Path)
    options = parser.parse_args()
    return run({**CASES, **(VIEWERS if options.gateway and options.viewer else {})}, SHORT if options.short else options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
