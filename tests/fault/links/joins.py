#!/usr/bin/env python3
"""Joins over real links: delay that jitters, loss, and links that change or break while somebody joins.

joins.py --tandemd PATH --tandem PATH [--seeds N] [--first-seed N] [--list | --short | CASE ...]

Each client has a network namespace of its own, and relay.py is the link between it and the server's. A row of the table
is joined with N seeds, 20 by default; other cases take a fifth of that, the crowd a tenth. Without CASE all run, some
twenty minutes; with --short three links of the table, two seeds each, in half a minute, and limits five times as high.
Exit 0 passed, 1 failed, 77 not run: namespaces or TAP devices are not allowed here.
"""

import contextlib
import os
import pathlib
import random
import signal
import sys
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from relay import PERFECT, Network  # noqa: E402
from stage import NOT_RUN, Failed, arguments, run  # noqa: E402

BODIES = 10_000
SNAPSHOT_BYTES = 80_000  # with headers
SETTLE_S = 3.0  # on top of those of Stage.server: the first client joins 5 s into the session
AT_ONCE = 20
BLOCKED_S = 3.0  # maximum delay of others by a client that never answers


def link(delay_ms, jitter_ms=0, loss=0, **more):
    return {**PERFECT, "delay_ms": delay_ms, "jitter_ms": jitter_ms, "loss": loss, **more}


def bound_s(way):
    """Return the bound: a second, ten round trips, and three times what the snapshot takes at the link's rate."""
    sending = SNAPSHOT_BYTES * 8 / (way["rate_kbit"] * 1000) if way["rate_kbit"] else 0
    return 1 + 10 * 2 * (way["delay_ms"] + way["jitter_ms"]) / 1000 + 3 * sending


def seeds(stage, share=1):
    options = stage.options
    return range(options.first_seed, options.first_seed + max(1, options.seeds // share))


def percentile(values, share):
    """Return the percentile by nearest rank: of 20 values, the 95th is the last but one."""
    ordered = sorted(values)
    return ordered[max(0, -int(-share * len(ordered) // 1) - 1)]


def refuse_faults(who, report):
    if report.get("hash_mismatches") or report.get("resyncs"):
        raise Failed(f"{who}: {report['hash_mismatches']} mismatches, {report['resyncs']} rejoins")


def observe(stage, namespace, seconds=0.3):
    return stage.start(stage.options.tandem, "join", "--observe", "--json", "--seconds", seconds, "--timeout", 30,
                       namespace=namespace)  # fmt: skip


def relay_said(network):
    carried = network.carried()
    return f"relay: {carried['frames']} frames, late by {carried['late_ms']['p50']:.2f} ms, p99 {carried['late_ms']['p99']:.1f}"


def row(stage, way, floor_s, aim_s):
    """Clients join over this link, one after the other. Without a link they join over loopback."""
    with Network("client") if way else contextlib.nullcontext() as network:
        server = stage.server(BODIES, namespace=network and network.server)
        time.sleep(SETTLE_S)
        if network:
            network.set("client", **way)
        took, found, failed = [], [], []
        print("  s:", end="", flush=True)
        for seed in seeds(stage):
            if network:
                network.restart(seed)
            report = observe(stage, network and network.clients["client"]).output(40)
            if report.get("frames_applied") and not report["hash_mismatches"] and not report["resyncs"]:
                took.append(report["join_ms"] / 1000)
                found.append(report["discovery_ms"] / 1000)
                print(f" {took[-1]:.2f}", end="", flush=True)
            else:
                failed.append(seed)
                print(f" FAILED (seed {seed})", end="", flush=True)
            time.sleep(0.3)
        print(f"\n  {relay_said(network)}" if network else "")
        made = server.stop()
    if not took:
        raise Failed("nobody joined")
    median, late, worst = percentile(took, 0.5), percentile(took, 0.95), max(took)
    slack = 5 if stage.options.short else 1
    print(f"  median {median:.2f} s, p95 {late:.2f}, worst {worst:.2f}, {len(failed)} of {len(took) + len(failed)} failed "
          f"(floor {floor_s}, aim {aim_s}{': reached' if median <= aim_s else ''}); session found after {percentile(found, 0.5):.2f}; "
          f"{made['snapshots']} snapshots of {made['snapshot_bytes'] // max(1, made['snapshots'])} bytes")  # fmt: skip
    if failed:
        raise Failed(f"seeds {failed} failed")
    if median > slack * floor_s or late > slack * 2 * floor_s:
        raise Failed(f"median {median:.2f} s, p95 {late:.2f} s")


def crowd(stage, way, floor_s, aim_s):
    """Observers on links of their own, all at once."""
    names = [f"client{number}" for number in range(AT_ONCE)]
    with Network(*names) as network:
        stage.server(BODIES, namespace=network.server)
        time.sleep(SETTLE_S)
        network.set_all(**way)
        worst = 0.0
        for seed in seeds(stage, 10):
            network.restart(seed)
            clients = [observe(stage, network.clients[name], seconds=1) for name in names]
            reports = [client.output(60) for client in clients]
            took = [report["join_ms"] / 1000 for report in reports if report.get("frames_applied")]
            print(f"  seed {seed}: {len(took)} of {AT_ONCE} joined, median {percentile(took or [0], 0.5):.2f} s, "
                  f"worst {max(took, default=0):.2f} (floor {floor_s}, aim {aim_s}); {relay_said(network)}", flush=True)  # fmt: skip
            for report in reports:
                refuse_faults("an observer", report)
            if len(took) < AT_ONCE:
                raise Failed(f"seed {seed}: {AT_ONCE - len(took)} did not join")
            worst = max(worst, *took)
            time.sleep(1)
        if worst > floor_s:
            raise Failed(f"the last joined after {worst:.2f} s")


def playing(stage, way, floor_ms, aim_ms):
    """Measure how late frames are for a client that plays. It joins over a good link, because frames that came while it joined
    would count as late. Server and client read the same clock."""
    with Network("client") as network:
        stage.server(BODIES, "--predictor", "ballistic", namespace=network.server)
        time.sleep(SETTLE_S)
        worst = [0.0, 0.0]
        for seed in seeds(stage, 5):
            network.restart(seed)
            network.set("client", **PERFECT)
            client = observe(stage, network.clients["client"], seconds=40)
            client.wait_for("playing from frame", 30)
            network.set("client", **way)
            report = client.output(60)
            if not report.get("frames_applied"):
                raise Failed(f"seed {seed}: it did not play")
            latency = report["latency_ms"]["p50"], report["latency_ms"]["p99"]
            print(f"  seed {seed}: latency {latency[0]:.0f} ms, p99 {latency[1]:.0f} (floor {floor_ms}, aim {aim_ms}); "
                  f"{report['frames_applied']} frames, {relay_said(network)}", flush=True)  # fmt: skip
            refuse_faults(f"seed {seed}", report)
            worst = [max(pair) for pair in zip(worst, latency)]
        if worst[0] > floor_ms[0] or worst[1] > floor_ms[1]:
            raise Failed(f"latency {worst[0]:.0f} ms, p99 {worst[1]:.0f}")


class Witness:
    """A participant on a good link, which must not notice the problems of others."""

    FRAMES_PER_S = 27  # of 30 in any second, as a machine may be busy
    CALM_S = 4.0

    def __init__(self, stage, namespace):
        self.client = stage.client(namespace=namespace)
        begin = self.client.wait_for("playing from frame", 30) + 1  # the first second is not a whole one
        time.sleep(self.CALM_S)
        self.slowest = 30.0
        print(f"  somebody else plays, {self.frames_per_s(begin, time.monotonic()):.1f} frames in the slowest second", flush=True)

    def frames_per_s(self, begin, end):
        """Return the frames of the slowest second that overlaps these times."""
        return min((line["frames_per_s"] for at, line in self.client.live() if begin < at < end + 1), default=30.0)

    def watch(self, begin):
        """Count the frames from `begin` until now."""
        end = time.monotonic()
        time.sleep(1.1)
        self.slowest = min(self.slowest, self.frames_per_s(begin, end))

    def end(self):
        print(f"  somebody else had {self.slowest:.1f} frames in the slowest second")
        refuse_faults("somebody else", self.client.stop())
        if self.slowest < self.FRAMES_PER_S:
            raise Failed(f"somebody else was slowed to {self.slowest:.1f} frames/s")


def until_carried(network, name, count):
    """Wait until so many more bytes have been sent to a client."""
    def carried():
        return network.carried()["links"][name]["down"]["octets"]

    most, deadline = carried() + count, time.monotonic() + 30
    while carried() < most:
        if time.monotonic() > deadline:
            raise Failed("no snapshot came")
        time.sleep(0.005)


def begin_join(stage, network, name, seed):
    """Start a participant. It has a part of the snapshot when this returns; the seed decides which part."""
    client = stage.client("--timeout", 90, namespace=network.clients[name])
    client.wait_for("found session", 20)
    until_carried(network, name, random.Random(seed).uniform(0.1, 0.6) * SNAPSHOT_BYTES)
    if client.first("playing from frame"):
        raise Failed("it joined before it was disturbed")
    return client


def plays_within(client, who, begin, limit_s):
    try:
        took = client.wait_for("playing from frame", max(20, 2 * limit_s)) - begin
    except Failed:
        print(f"  {who} has not played after {time.monotonic() - begin:.0f} s (limit {limit_s:.1f})", flush=True)
        return False
    print(f"  {who} played after {took:.2f} s (limit {limit_s:.1f})", flush=True)
    return took <= limit_s


def finish(late, witness):
    try:
        witness.end()
    finally:
        if late:
            raise Failed(f"too late with seeds {sorted(set(late))}")


def struck(stage, before, blow, after=None, steady=True):
    """In mid-snapshot something happens to a joiner. It plays within the bound once that is over; a witness sees nothing."""
    late = []
    with Network("joiner", "witness") as network:
        server = stage.server(BODIES, namespace=network.server)
        witness = Witness(stage, network.clients["witness"])
        for seed in seeds(stage, 5):
            network.restart(seed)
            network.set("joiner", **before)
            begin = time.monotonic()
            joiner = begin_join(stage, network, "joiner", seed)
            blow(network, server)
            over = time.monotonic()
            if not plays_within(joiner, f"seed {seed}:", over, bound_s(after or before)):
                late.append(seed)
            if steady:
                witness.watch(begin)
            refuse_faults(f"seed {seed}", joiner.stop())
        finish(late, witness)


def changed(before, **changes):
    return lambda stage: struck(stage, before, lambda network, _: network.set("joiner", **changes), {**before, **changes})


def dead(network, _):
    network.set("joiner", dead=True)
    time.sleep(5)
    network.set("joiner", dead=False)


def stopped_server(_, server):
    server.process.send_signal(signal.SIGSTOP)
    time.sleep(5)
    server.process.send_signal(signal.SIGCONT)


def stopped_joiner(stage, way):
    """One is stopped in mid-snapshot; another one joins nevertheless."""
    late = []
    with Network("stopped", "other", "witness") as network:
        stage.server(BODIES, namespace=network.server)
        witness = Witness(stage, network.clients["witness"])
        for seed in seeds(stage, 5):
            network.restart(seed)
            network.set("stopped", **way)
            network.set("other", **way)
            begin = time.monotonic()
            stopped = begin_join(stage, network, "stopped", seed)
            stopped.process.send_signal(signal.SIGSTOP)
            other = stage.client("--timeout", 90, namespace=network.clients["other"])
            if not plays_within(other, f"seed {seed}: the other", time.monotonic(), bound_s(way) + BLOCKED_S):
                late.append(seed)
            stopped.process.send_signal(signal.SIGCONT)
            if not plays_within(stopped, f"seed {seed}: the stopped", time.monotonic(), bound_s(way) + BLOCKED_S):
                late.append(seed)
            witness.watch(begin)
            refuse_faults("the other", other.stop())
            stopped.stop()
        finish(late, witness)


def fast_and_slow(stage, fast, slow):
    """Two join, at once or one in the other's snapshot; neither is slower than alone would be allowed."""
    late = []
    with Network("fast", "slow", "witness") as network:
        stage.server(BODIES, namespace=network.server)
        witness = Witness(stage, network.clients["witness"])
        network.set("fast", **fast)
        network.set("slow", **slow)
        for seed in seeds(stage, 5):
            network.restart(seed)
            begin = time.monotonic()
            at_once = seed % 2 == 0
            second = stage.client(namespace=network.clients["slow"]) if at_once else begin_join(stage, network, "slow", seed)
            joined = time.monotonic()
            first = stage.client(namespace=network.clients["fast"])
            how = "at once" if at_once else "in mid-snapshot"
            if not plays_within(first, f"seed {seed}, {how}: the fast", joined, bound_s(fast)):
                late.append(seed)
            if not plays_within(second, f"seed {seed}, {how}: the slow", begin, bound_s(slow)):
                late.append(seed)
            witness.watch(begin)
            refuse_faults("the fast", first.stop())
            refuse_faults("the slow", second.stop())
        finish(late, witness)


def shared(stage, way):
    """Somebody joins behind the thin link over which another one plays."""
    late = []
    with Network("home") as network:
        stage.server(BODIES, namespace=network.server)
        time.sleep(SETTLE_S)
        network.set("home", **way)
        witness = Witness(stage, network.clients["home"])
        for seed in seeds(stage, 5):
            network.restart(seed)
            begin = time.monotonic()
            joiner = stage.client("--timeout", 90, namespace=network.clients["home"])
            if not plays_within(joiner, f"seed {seed}:", begin, bound_s(way)):
                late.append(seed)
            witness.watch(begin)
            refuse_faults("the joiner", joiner.stop())
        finish(late, witness)


def thin(kbit):
    return link(20, 5, rate_kbit=kbit)


CASES = {
    "loopback": lambda stage: row(stage, None, 0.2, 0.1),
    "10_ms_jitter_2": lambda stage: row(stage, link(10, 2), 0.3, 0.15),
    "35_ms_jitter_15_loss_2": lambda stage: row(stage, link(35, 15, 0.02), 0.6, 0.3),
    "100_ms_jitter_10": lambda stage: row(stage, link(100, 10), 1.0, 0.55),
    "100_ms_jitter_10_loss_5": lambda stage: row(stage, link(100, 10, 0.05), 1.6, 0.8),
    "100_ms_jitter_10_loss_10": lambda stage: row(stage, link(100, 10, 0.1), 2.5, 1.2),
    "100_ms_jitter_10_bursts_10": lambda stage: row(stage, link(100, 10, burst_loss=0.1, burst_packets=10), 2.5, 1.2),
    "crowd_35_ms_jitter_15_loss_2": lambda stage: crowd(stage, link(35, 15, 0.02), 3.0, 1.5),
    "playing_100_ms_loss_5": lambda stage: playing(stage, link(100, 0, 0.05), (200, 600), (150, 400)),
    "rate_falls_to_a_tenth": changed(thin(2000), rate_kbit=200),
    "rate_rises_tenfold": changed(thin(256), rate_kbit=2560),
    "link_dies_for_5_s": lambda stage: struck(stage, thin(1000), dead),
    "server_stopped_for_5_s": lambda stage: struck(stage, thin(1000), stopped_server, steady=False),
    "joiner_stopped_at_4000": lambda stage: stopped_joiner(stage, thin(4000)),
    "joiner_stopped_at_700": lambda stage: stopped_joiner(stage, thin(700)),
    "fast_beside_slow": lambda stage: fast_and_slow(stage, link(20, 5, rate_kbit=10_000), link(20, 5, rate_kbit=256)),
    "shared_at_512": lambda stage: shared(stage, thin(512)),
}
SHORT = ["10_ms_jitter_2", "35_ms_jitter_15_loss_2", "100_ms_jitter_10_loss_5"]


def main():
    parser = arguments(__doc__, "three links, two seeds each, limits five times as high")
    parser.add_argument("--seeds", type=int, default=20, help="joins of each row of the table")
    parser.add_argument("--first-seed", type=int, default=1)
    options = parser.parse_args()
    if options.short:
        options.seeds = 2
    if not options.list:
        if not os.access("/dev/net/tun", os.R_OK | os.W_OK):
            print("not run: TAP devices are not allowed here")
            return NOT_RUN
        print(f"seeds from {options.first_seed}")
    return run(CASES, SHORT if options.short else options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
