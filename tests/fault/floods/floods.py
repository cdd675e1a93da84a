#!/usr/bin/env python3
"""Sessions among strangers, crowds and for months: real programs in a network namespace of this test's own.

floods.py --tandemd PATH --tandem PATH --flood PATH [--list | --short | CASE ...]

Without CASE all run, in full length: some twenty minutes. With --short floods last 10 s, crowds and months are a hundredth:
some three minutes. Exit 0 passed, 1 failed, 77 not run: namespaces are not allowed here.
"""

import os
import pathlib
import signal
import sys
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from stage import Failed, arguments, run  # noqa: E402

BODIES = 1000
FRAMES_PER_S = 30
MEMORY_KB = 3 * 1024
LOG_BYTES = 1 << 20
GROUP = 25  # observers in one process
RATE = 20_000  # samples a second
SETTLE_S = 60
PUSH = "inputs {{ time_s: {:.2f} push {{ centre {{ y: 5 }} radius_m: 3 velocity_change {{ y: 1 }} }} }}\n"
GRAVITY = "inputs {{ time_s: {:.2f} gravity {{ x: {:.2f} y: -3 }} }}\n"


def flood(stage, kind, seconds):
    """Runs a flood to its end and returns its JSON object. Runs it with `nice`, because strangers have their own machines."""
    flooder = stage.start("nice", "-n", "10", stage.options.flood, kind, "default", RATE, seconds)
    said = flooder.output(60)
    if not said.get("sent"):
        raise Failed(f"no flood: {flooder.lines}")
    return said


def honest(stage, seconds):
    """A participant that pushes and tilts five times a second for so long."""
    script = pathlib.Path(stage.folder) / "inputs.textproto"
    script.write_text("".join(
        PUSH.format(i / 5) if i % 2 else GRAVITY.format(i / 5, i % 7 / 10) for i in range(5, int(5 * seconds))
    ))  # fmt: skip
    client = stage.client("--input-script", script)
    client.wait_for("playing from frame", 30)
    return client


def frames_between(client, begin, end):
    """Return the frames a second by the live lines of that time."""
    lines = [line for at, line in client.live() if begin <= at <= end]
    if len(lines) < 3:
        raise Failed("a client fell silent")
    return (lines[-1]["frame"] - lines[0]["frame"]) / (lines[-1]["seconds"] - lines[0]["seconds"])


def flooded(stage, kind):
    """30 Hz within one frame in a hundred, no honest input lost, little log."""
    options = stage.options
    server = stage.server(BODIES)
    clients = [honest(stage, options.seconds + 4) for _ in range(2)]
    time.sleep(2)
    begin = time.monotonic()
    sent = flood(stage, kind, options.seconds)
    end = time.monotonic()
    time.sleep(6)
    frames = min(frames_between(client, begin, end) for client in clients)
    logs = [each.log_bytes() for each in [server, *clients]]
    reports = [client.stop() for client in clients]
    lost = sum(report["inputs_sent"] - report["inputs_acted"] for report in reports)
    resyncs = sum(report["resyncs"] for report in reports)
    print(f"  {sent['sent'] / sent['seconds']:.0f}/s for {sent['seconds']:.0f} s: {frames:.2f} frames/s, "
          f"{sum(report['inputs_sent'] for report in reports)} inputs, {lost} lost, {resyncs} rejoins, "
          f"logs of {max(logs)} bytes at most")  # fmt: skip
    if frames < FRAMES_PER_S * 0.99:
        raise Failed(f"{frames:.2f} frames/s")
    if lost:
        raise Failed(f"{lost} honest inputs lost")
    if max(logs) > LOG_BYTES:
        raise Failed("log flood")
    if any(report["hash_mismatches"] or report["epochs"] != 1 for report in reports):
        raise Failed("hash mismatch, or another server followed")


def random_inputs(stage, count):
    return flood(stage, "random_inputs", count / RATE)["sent"]


def short_observers(stage, count):
    """Clients come, watch a moment and go; one group in four is killed instead."""
    for group in range(count // GROUP):
        observers = stage.start(
            stage.options.tandem, "join", "--observe", "--count", GROUP, "--seconds", 0.5, "--timeout", 30, "--json"
        )
        if group % 4 == 3:
            observers.wait_for("playing from frame", 30)
            observers.process.kill()
        for report in observers.output(60).get("clients", []):
            if report["hash_mismatches"] or not report["frames_applied"]:
                raise Failed("an observer did not play, or had a mismatch")
    return count // GROUP * GROUP


def forgotten(stage, crowd, count):
    """The server, and clients that stay, give back the memory that a crowd cost."""
    server = stage.server(BODIES)
    clients = [stage.client(), stage.client("--observe")]
    for client in clients:
        client.wait_for("playing from frame", 30)
    standing = [server, *clients]
    time.sleep(10)
    before = [each.resident_kb() for each in standing]
    began = time.monotonic()
    count = crowd(stage, count)
    took = time.monotonic() - began
    highest = [each.resident_kb() for each in standing]
    time.sleep(SETTLE_S)
    after = [each.resident_kb() for each in standing]
    print(f"  {count} in {took:.0f} s; kB before, at once after and {SETTLE_S} s later:", end="")
    for name, *sizes in zip(["server", "participant", "observer"], before, highest, after):
        print(f" {name} {sizes[0]}, {sizes[1]}, {sizes[2]};", end="")
    reports = [client.stop() for client in clients]
    print(f" {sum(report['resyncs'] for report in reports)} rejoins")
    if any(report["hash_mismatches"] for report in reports):
        raise Failed("hash mismatch")
    if max(now - then for now, then in zip(after, before)) > MEMORY_KB:
        raise Failed("memory is not given back")


def months(stage, frames):
    """Scripted users for so many frames as fast as they go: flat memory and rate. A hash a frame tells how far it is."""
    hashes = pathlib.Path(stage.folder) / "hashes"
    os.mkfifo(hashes)
    server = stage.start(
        stage.options.tandemd, "--scene", "half_pipe", "--bodies", 64, "--scripted", "--rate", "max",
        "--hash-log", hashes,
    )  # fmt: skip
    marks = []  # frames, seconds of processor time, kB at each tenth
    done, began = 0, time.monotonic()
    with open(hashes, "rb", buffering=0) as lines:
        while done < frames:
            chunk = lines.read(1 << 16)
            if not chunk:
                raise Failed(f"it ended: {server.lines[-4:]}")
            done += chunk.count(b"\n")
            if done >= frames * (len(marks) + 1) / 10:
                marks.append((done, server.cpu_seconds(), server.resident_kb()))
        server.process.kill()
    took = time.monotonic() - began
    spans = [(b[0] - a[0]) / max(b[1] - a[1], 0.01) for a, b in zip(marks, marks[1:])]
    sizes = [size for _, _, size in marks]
    print(f"  {done} frames ({done / FRAMES_PER_S / 3600:.1f} h at 30 Hz) in {took:.0f} s; by tenths "
          f"{', '.join(f'{rate:.0f}' for rate in spans)} frames per s of processor time, {', '.join(str(size) for size in sizes)} kB")  # fmt: skip
    if sizes[-1] - sizes[0] > 512:
        raise Failed("memory grows")
    # Others slow a processor down by less than this; work that grows with the frames done is ten times slower at the end.
    if sum(spans[-3:]) < 0.3 * sum(spans[:3]):
        raise Failed("it gets slower")


KINDS = ["victim_inputs", "victim_acks", "server_statuses", "random_inputs", "sessions"]


def main():
    parser = arguments(__doc__, "a few minutes' worth")
    parser.add_argument("--flood", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", type=float, default=60, help="of each flood")
    options = parser.parse_args()
    share = 100 if options.short else 1
    options.seconds = 10 if options.short else options.seconds
    cases = {f"flood_{kind}": lambda stage, kind=kind: flooded(stage, kind) for kind in KINDS}
    cases["forgotten_inputs"] = lambda stage: forgotten(stage, random_inputs, 100_000 // share)
    cases["forgotten_observers"] = lambda stage: forgotten(stage, short_observers, 2_000 // share)
    cases["scripted_for_24_h"] = lambda stage: months(stage, 24 * 3600 * FRAMES_PER_S // share)
    return run(cases, options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
