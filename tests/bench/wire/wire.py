#!/usr/bin/env python3
"""What one observer costs on the wire: a server and a client, each in a network of its own, with a cable between them.

    wire.py --tandemd PATH --tandem PATH [--seconds N] [--settle N] [--delay SECONDS[,SECONDS]] [--cap KBIT] [--check PART]
            [ROW...]

Counts what passes the observer's interface, both directions together, for --seconds after the join and --settle: IP packets
with all headers, that is the interface's bytes without the 14 of Ethernet a packet. 1 kbit is 1,000 bit. Each row takes
about --settle + --seconds + 5 s, two minutes at most. With --cap it also prints the two seconds that took most, and the threshold
in force at the end, with that of the scene. Where the server did not keep its rate the row says so: measure again.
Asserts nothing without --check. Needs the right to make network namespaces.
"""

import dataclasses
import json
import pathlib
import subprocess
import sys
import time

sys.path += [str(pathlib.Path(__file__).resolve().parents[2] / "fault" / folder) for folder in ("", "networks")]
import stage  # noqa: E402
from routed import attach, cable  # noqa: E402

ETHERNET_BYTES = 14
JOIN_S = 60  # longer than any join takes
WINDOW_S, LOOK_S = 2, 0.1  # of a cap, and between two looks at the counters
INTERFACE = "eth0"


@dataclasses.dataclass
class Row:
    scene: str
    bodies: int
    rate_hz: int
    more: tuple = ()


ROWS = {
    "asteroids": Row("asteroids", 250, 30),
    "dominoes": Row("dominoes", 250, 60),
    "towers": Row("towers", 500, 60, ("--scripted",)),
    "cube": Row("cube", 1_000, 30, ("--scripted",)),
    "half_pipe": Row("half_pipe", 10_000, 30, ("--scripted",)),
}


class Machine(stage.Namespace):
    """A network whose programs use its one interface. Nothing but IPv4 is spoken on it."""

    def __init__(self):
        super().__init__(INTERFACE)

    def run(self, *words):
        with self.entered():
            stage.shell(*words)

    def plug(self, address):
        with self.entered():
            pathlib.Path(f"/proc/sys/net/ipv6/conf/{INTERFACE}/disable_ipv6").write_text("1")
        attach(self, INTERFACE, address)

    def counted(self):
        """Return bytes and packets that its interface received and sent so far."""
        with self.entered():
            lines = pathlib.Path("/proc/thread-self/net/dev").read_text().splitlines()
        numbers = [int(word) for word in next(line for line in lines if f"{INTERFACE}:" in line).split(":")[1].split()]
        return numbers[0] + numbers[8], numbers[1] + numbers[9]


def watch(machine, seconds):
    """Return the time, the bytes without Ethernet's and the packets that the machine counted, at each look."""
    looks, end = [], time.monotonic() + seconds
    while not looks or looks[-1][0] < end:
        total_bytes, packets = machine.counted()
        looks.append((time.monotonic(), total_bytes - packets * ETHERNET_BYTES, packets))
        time.sleep(LOOK_S)
    return looks


def worst_kbit_s(looks):
    """Return the rate of the two seconds that took most."""
    rates, first = [0.0], 0
    for at, total_bytes, _ in looks:
        while at - looks[first + 1][0] >= WINDOW_S:
            first += 1
        if at - looks[first][0] >= WINDOW_S:
            rates.append((total_bytes - looks[first][1]) * 8 / (at - looks[first][0]) / 1000)
    return max(rates)


def threshold_m(options, machine):
    """Return the threshold that is in force, as the server tells monitors."""
    with machine.entered():
        told = subprocess.run([options.tandem, "top", "--once", "--json"], capture_output=True, text=True, timeout=20, check=True)
    streams = (stream for session in json.loads(told.stdout)["sessions"] for stream in session["streams"])
    return next(stream["threshold"] for stream in streams if stream["observers"])


def measured(on, row, options):
    """Print what one observer of a row got."""
    one, other = Machine(), Machine()
    try:
        cable(one, INTERFACE, other, INTERFACE)
        one.plug("10.9.0.1/24")
        other.plug("10.9.0.2/24")
        delay = ("--delivery-delay", options.delay) if options.delay else ()
        more = ("--cap", options.cap, *row.more) if options.cap else row.more
        on.server(row.bodies, "--rate", row.rate_hz, *delay, *more, scene=row.scene, namespace=one)
        client = on.client("--observe", *(("--max-kbit-s", options.cap) if options.cap else ()), namespace=other)
        client.wait_for('"phase":"playing"', JOIN_S)
        time.sleep(options.settle)
        looks = watch(other, options.seconds)
        (began, *before), (ended, *after) = looks[0], looks[-1]
        lines = [line for at, line in client.live() if at >= began]
        threshold = threshold_m(options, one) if options.cap else None
        on.end_all()
    finally:
        one.end()
        other.end()
    if len(lines) < 2:
        raise stage.Failed("the client said nothing for two seconds")
    total_bytes, packets = (now - then for now, then in zip(after, before))
    payload, computed = (sum(line[name] for line in lines) / len(lines) * 2**20 / 1000 for name in ("mbit_per_s", "wire_mbit_per_s"))
    wire = total_bytes * 8 / (ended - began) / 1000
    frames = (lines[-1]["frame"] - lines[0]["frame"]) / (lines[-1]["seconds"] - lines[0]["seconds"])
    seconds = ended - began
    slow = "" if frames > 0.98 * row.rate_hz else f" INSTEAD OF {row.rate_hz}"
    print(f"  payload {payload:.1f} kbit/s, wire {wire:.1f} kbit/s, computed {computed:.1f}; {packets / seconds:.1f} packets/s "
          f"of {total_bytes / packets:.0f} bytes; {frames:.1f}{slow} frames/s; stream {lines[-1]['stream']}, "
          f"joined again {lines[-1]['resyncs'] - lines[0]['resyncs']} times")  # fmt: skip
    if options.cap:
        print(f"  cap {options.cap} kbit/s: the two seconds that took most {worst_kbit_s(looks):.1f} kbit/s; threshold {threshold:.4g} m")
    if options.check is not None and abs(computed - wire) > options.check * wire:
        raise stage.Failed(f"the client computed {computed:.1f} kbit/s, and its interface counted {wire:.1f}")


def main():
    parser = stage.arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=20, help="how long is counted, 20 s by default")
    parser.add_argument("--settle", type=float, default=10, help="how long after the join that begins, 10 s by default")
    parser.add_argument("--delay", help="delivery delays of the server; by default its own")
    parser.add_argument("--cap", type=int, help="cap of the server's streams, kbit/s")
    parser.add_argument("--check", type=float, help="fail where the client's own figure is off by more than this part")
    options = parser.parse_args()
    rows = {name: lambda on, row=row: measured(on, row, options) for name, row in ROWS.items()}
    return stage.run(rows, options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
