#!/usr/bin/env python3
"""User-space Ethernet links between a server's network namespace and those of its clients.

Each client has a link of its own to the server, of two directions, and each direction any of (see Direction):
  delay_ms, jitter_ms         a packet is late by the delay plus 0 to the jitter, so packets overtake each other
  loss                        share of packets that are lost, each by itself
  burst_loss, burst_packets   share of packets that are lost in a row, and how many such a row has on average
  duplicates                  share of packets that come twice
  rate_kbit, queue_ms         a bottleneck, and how long a packet waits for it at most; what would wait longer is lost
  dead                        nothing passes
Multicast reaches all; what one client sends another passes both their links. `Network` is for tests: it makes the
namespaces, starts this file as the process that carries the frames, and changes links at run time.

relay.py --measure    how late the relay itself is, and how many packets a second it carries
"""

import errno
import fcntl
import gc
import heapq
import json
import os
import pathlib
import random
import select
import socket
import struct
import subprocess
import sys
import threading
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from stage import Failed, Namespace, enter_namespace, shell  # noqa: E402

INTERFACE = "lan"
TUNSETIFF, IFF_TAP_NO_PI = 0x400454CA, 0x1002
ARP = b"\x08\x06"
PERFECT = {
    "delay_ms": 0, "jitter_ms": 0, "loss": 0, "burst_loss": 0, "burst_packets": 1, "duplicates": 0,
    "rate_kbit": None, "queue_ms": 400, "dead": False,
}  # fmt: skip


class Direction:
    """One direction of a link, as arithmetic on times and sizes."""

    def __init__(self):
        self.free_at = 0.0  # when the bottleneck has sent what waits for it; what waits keeps its time if the rate changes
        self.packets = self.octets = self.lost = self.dropped = 0
        self.restart("")
        self.set(PERFECT)

    def restart(self, seed):
        self.draw = random.Random(seed).random
        self.in_burst = False

    def set(self, link):
        self.delay, self.jitter = link["delay_ms"] / 1000, link["jitter_ms"] / 1000
        self.loss, self.duplicates = link["loss"], link["duplicates"]
        # Gilbert and Elliott: all is lost in one state, nothing in the other.
        self.leave = 1 / link["burst_packets"]
        self.enter = self.leave * link["burst_loss"] / (1 - link["burst_loss"])
        self.rate, self.queue = link["rate_kbit"] and link["rate_kbit"] * 125, link["queue_ms"] / 1000
        self.dead = link["dead"]

    def offer(self, now, size):
        """Return the times at which a packet arrives at the other end: none, one, or two."""
        draw = self.draw
        self.packets += 1
        leaves = now
        if self.rate:
            starts = max(now, self.free_at)
            if starts - now > self.queue:
                self.dropped += 1
                return ()
            leaves = self.free_at = starts + size / self.rate
        if self.enter:
            self.in_burst = draw() >= self.leave if self.in_burst else draw() < self.enter
        if self.dead or self.in_burst or (self.loss and draw() < self.loss):
            self.lost += 1
            return ()
        self.octets += size
        arrives = leaves + self.delay
        if not self.jitter:
            return (arrives, arrives) if self.duplicates and draw() < self.duplicates else (arrives,)
        if self.duplicates and draw() < self.duplicates:
            return arrives + draw() * self.jitter, arrives + draw() * self.jitter
        return (arrives + draw() * self.jitter,)


class Relay:
    """Carries frames between TAP devices. The first is the server's; the last octet of an address is the device's number."""

    HUB = -1
    BATCH = 64  # frames of one device before the next one's turn

    def __init__(self, taps):
        self.taps = taps
        self.number_of = {tap: number for number, tap in enumerate(taps)}
        self.up = [Direction() for _ in taps]
        self.down = [Direction() for _ in taps]
        self.travelling = []
        self.pushed = 0
        self.lateness = []

    def push(self, due, to, source, frame):
        self.pushed += 1
        heapq.heappush(self.travelling, (due, self.pushed, to, source, frame))

    def enter(self, now, source, frame):
        """Take a frame that leaves a namespace."""
        if frame[12:14] == ARP:  # is repeated once a second only, and the links meant here have none
            for number in range(len(self.taps)):
                if number != source:
                    self.push(now, number, source, frame)
        elif source == 0:
            self.spread(now, source, frame)
        else:
            for due in self.up[source].offer(now, len(frame)):
                self.push(due, self.HUB, source, frame)

    def spread(self, now, source, frame):
        """Pass on a frame that is where the links meet, at the server."""
        if not frame[0] & 1:
            to = frame[5]
            if to == 0:
                self.push(now, 0, source, frame)
            elif to < len(self.taps) and to != source:
                for due in self.down[to].offer(now, len(frame)):
                    self.push(due, to, source, frame)
            return
        if source != 0:
            self.push(now, 0, source, frame)
        for to in range(1, len(self.taps)):
            if to != source:
                for due in self.down[to].offer(now, len(frame)):
                    self.push(due, to, source, frame)

    def deliver(self, now):
        travelling, taps = self.travelling, self.taps
        while travelling and travelling[0][0] <= now:
            due, _, to, source, frame = heapq.heappop(travelling)
            if to == self.HUB:
                self.spread(due, source, frame)
                continue
            self.lateness.append(now - due)
            try:
                os.write(taps[to], frame)
            except OSError as refused:  # a full device drops; one whose namespace is gone carries nothing
                if refused.errno not in (errno.EAGAIN, errno.ENOBUFS, errno.EIO, errno.EBADFD):
                    raise

    def obey(self, command):
        """Obey a command, which is a line of JSON: seed and links by number, or a question for the counts."""
        if "seed" in command:
            for number in range(len(self.taps)):
                self.up[number].restart(f"{command['seed']} up {number}")
                self.down[number].restart(f"{command['seed']} down {number}")
        for number, ways in command.get("links", {}).items():
            self.up[int(number)].set(ways["up"])
            self.down[int(number)].set(ways["down"])
        if "question" in command:
            late = sorted(self.lateness) or [0]
            print(json.dumps({
                "frames": len(self.lateness), "late_ms": {
                    name: 1000 * late[int(share * (len(late) - 1))] for name, share in (("p50", 0.5), ("p99", 0.99), ("max", 1))
                },
                "links": [
                    {way: {name: getattr(direction, name) for name in ("packets", "octets", "lost", "dropped")}
                     for way, direction in (("up", up), ("down", down))} for up, down in zip(self.up, self.down)
                ],
            }), flush=True)  # fmt: skip
            self.lateness.clear()

    def run(self):
        """Carry frames until standard input ends."""
        watched, told = [0, *self.taps], b""
        while True:
            wait = max(0.0, self.travelling[0][0] - time.monotonic()) if self.travelling else 1.0
            ready, _, _ = select.select(watched, [], [], wait)
            for tap in ready:
                if tap == 0:
                    if not (more := os.read(0, 1 << 16)):
                        return
                    *lines, told = (told + more).split(b"\n")
                    for line in lines:
                        self.obey(json.loads(line))
                    continue
                number = self.number_of[tap]
                for _ in range(self.BATCH):
                    try:
                        frame = os.read(tap, 2048)
                    except OSError:
                        break
                    self.enter(time.monotonic(), number, frame)
            self.deliver(time.monotonic())


def open_tap(namespace, number):
    """A TAP device with the interface of the namespace; its descriptor works outside too."""
    with namespace.entered():
        tap = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(tap, TUNSETIFF, struct.pack("16sH", namespace.interface.encode(), IFF_TAP_NO_PI))
        device = ("dev", namespace.interface)
        shell("ip", "link", "set", *device, "address", f"02:00:00:00:00:{number:02x}", "mtu", "1500", "txqueuelen", "4000")
        shell("ip", "link", "set", *device, "addrgenmode", "none", "up")
        shell("ip", "address", "add", f"10.78.0.{number + 1}/24", *device)
        shell("ip", "route", "add", "224.0.0.0/4", *device)
    return tap


class Network:
    """A server's namespace, those of clients by name, and the relay, for a `with`."""

    def __init__(self, *names, seed=1):
        self.numbers = {name: number for number, name in enumerate(names, 1)}
        self.server = Namespace(INTERFACE)
        self.clients = {name: Namespace(INTERFACE) for name in names}
        self.links = {name: {"up": dict(PERFECT), "down": dict(PERFECT)} for name in names}
        taps = [open_tap(namespace, number) for number, namespace in enumerate([self.server, *self.clients.values()])]
        self.process = subprocess.Popen(
            [sys.executable, "-B", __file__, "--relay", *map(str, taps)], pass_fds=taps, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        for tap in taps:
            os.close(tap)
        self.restart(seed)

    def tell(self, **command):
        self.process.stdin.write(json.dumps(command) + "\n")
        self.process.stdin.flush()

    def restart(self, seed):
        """Start all random numbers anew from this seed."""
        self.tell(seed=seed)

    def set(self, name, *ways, **changes):
        """Changes a client's link in the direction "up" or "down", or in both if none is given; all else stays the same."""
        for way in ways or ("up", "down"):
            unknown = changes.keys() - PERFECT.keys()
            if unknown:
                raise ValueError(f"a link has no {unknown.pop()}")
            self.links[name][way].update(changes)
        self.tell(links={self.numbers[name]: self.links[name]})

    def set_all(self, **changes):
        for name in self.numbers:
            self.set(name, **changes)

    def carried(self):
        """Return the frames, and how late the relay itself was, since the last call; and the packets of all links since the start."""
        self.tell(question=True)
        answer = json.loads(self.process.stdout.readline())
        answer["links"] = dict(zip(["server", *self.numbers], answer["links"]))
        return answer

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.wait(10)
        self.process.stdout.close()
        for namespace in [self.server, *self.clients.values()]:
            namespace.end()


def echo(namespace):
    """Answers every datagram."""
    with namespace.entered():
        at = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        at.bind(("", 5000))

    def answer():
        while (message := at.recvfrom(2048))[0]:
            at.sendto(*message)

    threading.Thread(target=answer, daemon=True).start()


FLOOD = """
import socket, sys, time
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 0)
begin, sent, rate = time.monotonic(), 0, float(sys.argv[1])
while (now := time.monotonic() - begin) < 3:
    while sent < now * rate:
        out.sendto(bytes(700), ("239.255.0.9", 5001))
        sent += 1
    time.sleep(0.001)
print(sent)
"""


def measure():
    """Round trips over a link without delay, then multicast to 20 clients, faster and faster."""
    if not enter_namespace():
        raise Failed("network namespaces are not allowed here")
    with Network(*(f"c{number}" for number in range(20))) as network:
        measure_on(network)


def measure_on(network):
    echo(network.clients["c0"])
    with network.server.entered():
        pinger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        pinger.settimeout(5)
    trips = []
    for _ in range(1000):
        begin = time.monotonic()
        pinger.sendto(b"0" * 200, ("10.78.0.2", 5000))
        pinger.recv(2048)
        trips.append(time.monotonic() - begin)
        time.sleep(0.001)
    trips.sort()
    print(f"one way, with what the test's own process takes: {500 * trips[500]:.3f} ms, p99 {500 * trips[990]:.3f}")
    network.set_all(delay_ms=35, jitter_ms=15, loss=0.02)
    for rate in (100, 300, 600, 1000, 1500, 2000, 3000):
        network.carried()
        with network.server.entered():
            sent = int(subprocess.run([sys.executable, "-c", FLOOD, str(rate)], capture_output=True, check=True).stdout)
        time.sleep(0.5)
        carried = network.carried()
        late = ", ".join(f"{name} {ms:.2f}" for name, ms in carried["late_ms"].items())
        print(f"{sent / 3:.0f} packets/s to 20 clients each: {carried['frames'] / 3:.0f} carried/s "
              f"({carried['frames'] / (20 * sent):.1%}; 98 % are due), late by {late} ms")  # fmt: skip


def main():
    if sys.argv[1:2] == ["--relay"]:
        gc.disable()  # nothing here makes cycles
        try:
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
        except OSError:
            pass  # without privileges it competes with those it carries for
        Relay([int(tap) for tap in sys.argv[2:]]).run()
    elif sys.argv[1:] == ["--measure"]:
        measure()
    else:
        print(__doc__)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
