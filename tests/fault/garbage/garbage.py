#!/usr/bin/env python3
"""10,000 datagrams a second of garbage at the DDS ports of a session: random bytes, and packets of the session itself with
a few bytes changed, cut, doubled or grown.

garbage.py --tandemd PATH --tandem PATH [--short | --seconds N] [--seed N] [--secure | --forge] [--list]

Without DDS Security the packets are in the name of a program that is not there; with --secure or --forge also in those of server
and clients. With --forge alone this fails, because then everybody can speak for a program: SECURITY.md says what happens.
Without options it lasts five minutes, with --short five seconds. Checks that 30 Hz are kept within one frame in a hundred, no
log exceeds 1 MB, and no program ends. Prints the seed; a datagram is known by seed and number. If a program falls, the
datagrams that were sent last are kept in a file that is named. To send takes a tenth of a core (cannon.py). Exit 0 passed, 1
failed, 77 not run: namespaces or raw sockets are not allowed here.
"""

import collections
import os
import pathlib
import random
import shutil
import socket
import subprocess
import sys
import threading
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
import cannon  # noqa: E402
from stage import NOT_RUN, Failed, arguments, run  # noqa: E402

RATE = 10_000  # datagrams a second
FRAMES_PER_S = 30
LOG_BYTES = 1 << 20
PORTS = [7400, 7401, *range(7410, 7422)]  # discovery and data by multicast, and by unicast of six participants of domain 0
GROUP = "239.255.0.1"
UDP, ALL_PACKETS = 17, 0x0003
MOST_HEARD = 4000
KEPT = 20_000  # datagrams that are kept for a reproduction


class Ears(threading.Thread):
    """Keeps RTPS packets of the session, as they are on the wire."""

    def __init__(self):
        super().__init__(daemon=True)
        self.packets = []
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(ALL_PACKETS))
        self.socket.bind(("lo", 0))

    def run(self):
        while len(self.packets) < MOST_HEARD:
            packet = self.socket.recv(65536)
            header = 4 * (packet[0] & 15)
            if packet[9] == UDP and packet[header + 8 : header + 12] == b"RTPS":
                self.packets.append(packet[header + 8 :])


def mutated(rng, packet):
    """The packet with a few bytes changed, cut, doubled or grown. The RTPS header stays in most."""
    out = bytearray(packet)
    begin = 20 if rng.random() < 0.9 and len(out) > 24 else 0
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        kind = rng.randrange(5)
        at = rng.randrange(begin, len(out)) if len(out) > begin else 0
        if kind <= 1 and out:
            out[at] = rng.choice((0, 1, 127, 128, 255, rng.randrange(256)))
        elif kind == 2 and at + 4 <= len(out):  # a length, a count or a number
            out[at : at + 4] = rng.choice((b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0\0\0\0"))
        elif kind == 3:
            del out[at + rng.randrange(1, 64) :]
        else:
            out[at:at] = out[begin : begin + rng.randrange(64)]
    return bytes(out[:65000])


def in_another_name(rng, packet):
    """The packet with another GUID prefix, in the header and where the packet says it again."""
    return packet.replace(packet[8:20], rng.randbytes(12))


def datagram(rng, packets, forge):
    if rng.random() < 0.2 or not packets:
        head = rng.choice((b"", b"RTPS", b"RTPS\x02\x01\x01\x10" + bytes(12)))
        return head + rng.randbytes(rng.choice((0, 1, 16, 64, 300, 1400)))
    packet = rng.choice(packets)
    return mutated(rng, packet if forge else in_another_name(rng, packet))


def send(packets, seed, seconds, forge):
    """Sends until the time is over; returns the number, how many were not taken, the last ones and the seconds."""
    rng = random.Random(seed)
    last = collections.deque(maxlen=KEPT)

    def aimed():
        port = rng.choice(PORTS)
        return GROUP if port < 7402 else "127.0.0.1", port, datagram(rng, packets, forge)

    def renew(cannon):
        # Few, because making one costs more than sending it, and would take the core from the programs that are watched.
        for _ in range(KEPT // 20):
            cannon.load(rng.randrange(KEPT), aimed())

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        sent, lost, took = cannon.burn(cannon.Cannon(out, (aimed() for _ in range(KEPT))), RATE, seconds, renew, last.extend)
    return sent, lost, last, took


def course(lines):
    """Frames a second in each ten seconds, by which one sees whether it was slow or stood still, and since when."""
    parts = []
    for first, last in zip(lines[::10], [*lines[10::10], lines[-1]]):
        if last["seconds"] > first["seconds"]:
            parts.append(f"{(last['frame'] - first['frame']) / (last['seconds'] - first['seconds']):.0f}")
    return " ".join(parts)


def busiest_thread(pid):
    """Name and processor time in s of a program's busiest thread since the start. `fsm`: the handshakes of Cyclone DDS spin."""
    threads = []
    for stat in pathlib.Path(f"/proc/{pid}/task").glob("*/stat"):
        name, fields = stat.read_text().split("(", 1)[1].rsplit(")", 1)
        threads.append(((int(fields.split()[11]) + int(fields.split()[12])) / os.sysconf("SC_CLK_TCK"), name))
    return max(threads)[::-1]


def keep(last, seed):
    path = pathlib.Path(f"garbage-{seed}.txt").resolve()
    path.write_text("".join(f"{port} {what.hex()}\n" for _, port, what in last))
    return path


def identities(stage):
    folder = pathlib.Path(stage.folder) / "pki"
    for words in (["init"], ["issue", "server", "server"], ["issue", "participant", "client"]):
        subprocess.run([stage.options.tandem, "pki", *words, "--dir", folder], check=True, capture_output=True)
    return ["--secure", folder / "server"], ["--secure", folder / "client"]


def garbage(stage):
    options = stage.options
    of_server, of_client = identities(stage) if options.secure else ([], [])
    checkpoints = pathlib.Path(stage.folder) / "checkpoints"
    server = stage.server(1000, "--scripted", "--checkpoint-dir", checkpoints, *of_server)
    try:
        ears = Ears()
    except PermissionError:
        print("not run: raw sockets are not allowed here")
        raise SystemExit(NOT_RUN) from None
    ears.start()
    clients = [stage.client(*of_client), stage.client("--observe", *of_client)]
    for client in clients:
        client.wait_for("playing from frame", 30)
    time.sleep(2)
    packets = list(ears.packets)
    began = time.monotonic()
    sent, lost, last, took = send(packets, options.seed, options.seconds, options.secure or options.forge)
    ended = time.monotonic()
    time.sleep(5)  # whoever was held up goes on
    everybody = [server, *clients]
    fallen = [each for each in everybody if each.process.poll() is not None]
    if fallen:
        kept = keep(last, options.seed)
        tail = "\n".join(line for _, line in fallen[0].lines[-5:])
        newest = sorted(checkpoints.glob("*")) if checkpoints.exists() else []
        raise Failed(f"{len(fallen)} of {len(everybody)} programs ended, the first with {fallen[0].process.returncode}; the "
                     f"last datagrams are in {kept}; {len(newest)} checkpoints; it said last:\n{tail}")  # fmt: skip
    rates, courses = [], []
    for client in clients:
        lines = [line for at, line in client.live() if began <= at <= ended]
        courses.append(course(lines))
        if len(lines) < 3:
            raise Failed("a client fell silent")
        rates.append((lines[-1]["frame"] - lines[0]["frame"]) / (lines[-1]["seconds"] - lines[0]["seconds"]))
    logs = [each.log_bytes() for each in everybody]
    print(f"  seed {options.seed}, {len(packets)} genuine packets, {sent} datagrams in {took:.0f} s ({sent / took:.0f}/s, "
          f"{lost} not taken): {min(rates):.2f} frames/s, logs of {max(logs)} bytes at most", flush=True)  # fmt: skip
    if min(rates) < FRAMES_PER_S * 0.99:
        slow = clients[rates.index(min(rates))]
        after = [line for at, line in slow.live() if at > ended]
        said = "\n".join(line for _, line in slow.lines if not line.startswith("{"))
        raise Failed(f"{min(rates):.2f} frames/s; in each ten seconds {' and '.join(courses)}; afterwards {course(after) or 'nothing'}, "
                     f"phase {after[-1]['phase'] if after else '?'}, busiest thread {busiest_thread(slow.process.pid)}; the last datagrams are in {keep(last, options.seed)}; "
                     f"it said last:\n{said[-1000:]}")  # fmt: skip
    reports = [client.stop() for client in clients]
    print(f"  {sum(report['resyncs'] for report in reports)} rejoins, "
          f"{sum(report['hash_mismatches'] for report in reports)} mismatches")  # fmt: skip
    if max(logs) > LOG_BYTES:
        raise Failed("log flood")
    if any(report["epochs"] != 1 or (options.secure and report["hash_mismatches"]) for report in reports):
        raise Failed("another server was followed, or a state was wrong")


def main():
    parser = arguments(__doc__, "five seconds")
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--secure", action="store_true", help="with DDS Security")
    parser.add_argument("--forge", action="store_true", help="without it, but in the name of server and clients")
    options = parser.parse_args()
    if options.short:
        options.seconds = 5
    if shutil.which("ip") is None:
        print("not run: there is no ip")
        return NOT_RUN
    return run({"garbage": garbage}, options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
