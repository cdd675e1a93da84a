#!/usr/bin/env python3
"""What one observer costs on the wire: a server and a client, each in a network of its own, with a cable between them.

    wire.py --tandemd PATH --tandem PATH [--seconds N] [--settle N] [--delay SECONDS[,SECONDS]] [--check PART] [ROW...]

Counts what passes the observer's interface, both directions together, for --seconds after the join and --settle: IP packets
with all headers, that is the interface's bytes without the 14 of Ethernet a packet. 1 kbit is 1,000 bit. Each row takes
about --settle + --seconds + 5 s, two minutes at most. Where the server did not keep its rate the row says so: measure again.
Asserts nothing without --check. Needs the right to make network namespaces.
"""

import dataclasses
import pathlib
import sys
import time

sys.path += [str(pathlib.Path(__file__).resolve().parents[2] / "fault" / folder) for folder in ("", "networks")]
import stage  # noqa: E402
from routed import attach, cable  # noqa: E402

ETHERNET_BYTES = 14
JOIN_S = 60  # longer than any join takes
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


def measured(on, row, options):
    """Print what one observer of a row got."""
    one, other = Machine(), Machine()
    try:
        cable(one, INTERFACE, other, INTERFACE)
        one.plug("10.9.0.1/24")
        other.plug("10.9.0.2/24")
        delay = ("--delivery-delay", options.delay) if options.delay else ()
        on.server(row.bodies, "--rate", row.rate_hz, *delay, *row.more, scene=row.scene, namespace=one)
        client = on.client("--observe", namespace=other)
        client.wait_for('"phase":"playing"', JOIN_S)
        time.sleep(options.settle)
        before, began = other.counted(), time.monotonic()
        time.sleep(options.seconds)
        after, ended = other.counted(), time.monotonic()
        lines = [line for at, line in client.live() if at >= began]
        on.end_all()
    finally:
        one.end()
        other.end()
    if len(lines) < 2:
        raise stage.Failed("the client said nothing for two seconds")
    total_bytes, packets = (now - then for now, then in zip(after, before))
    total_bytes -= packets * ETHERNET_BYTES
    payload, computed = (sum(line[name] for line in lines) / len(lines) * 2**20 / 1000 for name in ("mbit_per_s", "wire_mbit_per_s"))
    wire = total_bytes * 8 / (ended - began) / 1000
    frames = (lines[-1]["frame"] - lines[0]["frame"]) / (lines[-1]["seconds"] - lines[0]["seconds"])
    seconds = ended - began
    slow = "" if frames > 0.98 * row.rate_hz else f" INSTEAD OF {row.rate_hz}"
    print(f"  payload {payload:.1f} kbit/s, wire {wire:.1f} kbit/s, computed {computed:.1f}; {packets / seconds:.1f} packets/s "
          f"of {total_bytes / packets:.0f} bytes; {frames:.1f}{slow} frames/s; stream {lines[-1]['stream']}, "
          f"joined again {lines[-1]['resyncs'] - lines[0]['resyncs']} times")  # fmt: skip
    if options.check is not None and abs(computed - wire) > options.check * wire:
        raise stage.Failed(f"the client computed {computed:.1f} kbit/s, and its interface counted {wire:.1f}")


def main():
    parser = stage.arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=20, help="how long is counted, 20 s by default")
    parser.add_argument("--settle", type=float, default=10, help="how long after the join that begins, 10 s by default")
    parser.add_argument("--delay", help="delivery delays of the server; by default its own")
    parser.add_argument("--check", type=float, help="fail where the client's own figure is off by more than this part")
    options = parser.parse_args()
    rows = {name: lambda on, row=row: measured(on, row, options) for name, row in ROWS.items()}
    return stage.run(rows, options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
