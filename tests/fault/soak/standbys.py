"""Cases of a server that stands by: it takes over when the live one is killed, and when it is asked to; and what it costs."""

import itertools
import pathlib
import statistics
import time

from clients import Group, wait_until
from restarts import FRAMES_PER_S, check_after_restarts, frames_of, plays
from stage import Failed
from watching import FRAME, Durations, port_of, read_page

BODIES = 10_000
SECONDS_OF_TRAFFIC = 10
RATE_BODIES = (10_000, 30_000, 50_000)


class Relay:
    """A live server, one that stands by for it, and clients; the servers take turns."""

    def __init__(self, stage, minutes):
        self.stage = stage
        self.lives = itertools.count()
        self.live = self.serve()
        self.groups = [Group(stage, 2, "--input-script", stage.pushes(minutes * 60 + 120)), Group(stage, 3, "--observe")]
        for group in self.groups:
            group.wait(30)
        self.clients = sum(group.count for group in self.groups)
        self.without = bytes_a_second()
        self.next = self.stand_by()
        self.with_standby = bytes_a_second()

    def serve(self, *more):
        life = next(self.lives)
        server = self.stage.serve(BODIES, "--scripted", "--hash-log", self.stage.path(f"hashes{life}"), *more)
        server.life = life
        return server

    def stand_by(self):
        server = self.serve("--standby")
        wait_until(lambda: said(server, "can take over"), 60, "a server to stand by")
        wait_until(lambda: said(self.live, "stands by, from frame"), 30, "the live server to hear of it")
        return server

    def follow(self, began):
        """Wait until all play on the other server; return after how long, and the frames lost. Another one stands by then."""
        new, old = self.next, self.live
        wait_until(lambda: len(plays(new)) >= self.clients, 60, "all clients after a takeover")
        took_s = plays(new)[self.clients - 1] - began
        lost = max(frames_of(self.stage, old.life)) - min(frames_of(self.stage, new.life))
        self.live = new
        self.next = self.stand_by()
        return took_s, lost

    def end(self, epochs):
        wrong = check_after_restarts(self.groups, epochs)
        self.next.stop()
        self.live.stop()
        return wrong


def said(server, what):
    return [at for at, line in list(server.lines) if what in line]


def bytes_a_second():
    """Return what the loopback interface of this namespace carries."""

    def carried():
        lines = pathlib.Path("/proc/self/net/dev").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.strip().startswith("lo:"))

    before, began = carried(), time.monotonic()
    time.sleep(SECONDS_OF_TRAFFIC)
    return (carried() - before) / (time.monotonic() - began)


def takeover(stage, minutes, rng):
    """The live server is killed again and again, and the one that stands by takes over."""
    until = time.monotonic() + minutes * 60
    relay = Relay(stage, minutes)
    mbit = (relay.with_standby - relay.without) * 8 / 2**20
    took_s, lost = [], []
    while not took_s or time.monotonic() < until:
        time.sleep(rng.uniform(2, 5))
        relay.live.process.kill()
        relay.live.process.wait()
        one_took_s, one_lost = relay.follow(time.monotonic())
        took_s.append(one_took_s)
        lost.append(one_lost)
    wrong = relay.end(len(took_s) + 1)
    return [
        (
            f"server killed (-9), a standby takes over, {BODIES:,} particles, {relay.clients} clients",
            "playing within 3 s; nothing of the world lost; each client complete",
            f"{len(took_s)} times: playing after {statistics.median(took_s):.2f} s, {max(took_s):.2f} s at most; "
            f"{max(lost)} frames lost at most; {wrong} clients incomplete",
            max(took_s) <= 3 and max(lost) <= 0 and not wrong,
        ),
        (
            f"Mbit/s to a standby, {BODIES:,} particles",
            "stated",
            f"{mbit:.2f} (all that loopback carries with it, less without; {relay.without * 8 / 2**20:.2f} without)",
            True,
        ),
    ]


def handover(stage, minutes, rng):
    """An operator has the session handed over again and again."""
    until = time.monotonic() + minutes * 60
    relay = Relay(stage, minutes)
    pauses_s, prepared_s, lost = [], [], []
    while not pauses_s or time.monotonic() < until:
        time.sleep(rng.uniform(2, 5))
        old = relay.live
        asked = stage.start(stage.options.tandem, "handover", "--json")
        if not asked.output(40).get("continues_frame"):
            raise Failed(f"no handover: {asked.lines[-2:]}")
        old.process.wait(10)
        stopped = said(old, "made the last frame before the handover")[-1]
        prepared_s.append(stopped - said(old, "hands over to server")[-1])
        pause_s, one_lost = relay.follow(stopped)
        pauses_s.append(pause_s)
        lost.append(one_lost)
    wrong = relay.end(len(pauses_s) + 1)
    return [(
        f"planned handover, {BODIES:,} particles, {relay.clients} clients",
        "no frame lost; a pause below 0.5 s, the join included",
        f"{len(pauses_s)} times: {max(lost)} frames lost at most ({max(lost) / FRAMES_PER_S:.2f} s); from the last frame until all play "
        f"{statistics.median(pauses_s):.2f} s, {max(pauses_s):.2f} s at most, after {max(prepared_s):.2f} s of preparation "
        f"at most, in which frames go on; {wrong} clients incomplete",
        max(lost) <= 0 and max(pauses_s) <= 0.5 and not wrong,
    )]  # fmt: skip


class Pace:
    """How fast a server makes frames for some seconds."""

    def __init__(self, server, seconds):
        port = port_of(server, "metrics at")
        before, began = read_page(port), time.monotonic()
        time.sleep(seconds)
        frames = Durations(before, read_page(port), FRAME)
        self.hz = frames.count / (time.monotonic() - began)
        self.text = f"{self.hz:.2f} frames/s of {frames.quantile_ms(0.5):.1f} ms (p99 {frames.quantile_ms(0.99):.1f})"


def makes_frames(server):
    """The claim of the name is over."""
    port = port_of(server, "metrics at")
    return port is not None and read_page(port).get(f"{FRAME}_count", 0) > FRAMES_PER_S


def rate(stage, minutes, _):
    """A session keeps its 30 frames a second while a server stands by on the same machine."""
    seconds = minutes * 60 / len(RATE_BODIES) / 3
    rows = []
    for bodies in RATE_BODIES:
        live = stage.serve(bodies, "--scripted", "--metrics", 0)
        wait_until(lambda: makes_frames(live), 60, "frames")  # noqa: B023
        before = Pace(live, seconds)
        standby = stage.serve(bodies, "--scripted", "--standby")
        wait_until(lambda: said(live, "stands by, from frame"), 60, "a server to stand by")  # noqa: B023
        attached = Pace(live, seconds)
        standby.stop()
        after = Pace(live, seconds)
        live.stop()
        held = 0.98 * FRAMES_PER_S  # a page may be a quarter of a second old
        rows.append((
            f"30 Hz with a standby on the same machine, {bodies:,} particles",
            "30 frames/s, where the machine makes them without one",
            f"{attached.text}; before it came {before.text}; after it left {after.text}",
            attached.hz >= held or min(before.hz, after.hz) < held,
        ))  # fmt: skip
    return rows
