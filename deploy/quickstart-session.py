"""Runs one server and three clients over loopback DDS, shows them live and compares their hash logs frame by frame.

Started by deploy/quickstart, which builds the programs first. Standard library only.
"""

import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

OBSERVER_DELAY_S = 5
START_LIMIT_S = 30  # for discovery and joining, for a slow machine's frames and, at the end, for leaving
FRAME_RATE_HZ = 30
LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/>'
    "</Interfaces></General></Domain></CycloneDDS>"
)
CLIENTS = [  # name, starts after seconds, more flags of `tandem join`
    ("participant 1", 0, ["--input-script", "participant-1.textproto"]),
    ("participant 2", 0, ["--input-script", "participant-2.textproto"]),
    ("observer", OBSERVER_DELAY_S, ["--observe"]),
]


class Failure(Exception):
    """Something the user should read; the run has failed."""


def free_domain():
    """A DDS domain none of whose UDP ports are in use on this machine."""
    with open("/proc/net/udp", encoding="ascii") as table:
        used = {int(line.split()[1].split(":")[1], 16) for line in table.readlines()[1:]}
    for domain in range(20, 100):  # the ports of higher domains overlap those that the system hands out
        first = 7400 + 250 * domain
        if not used.intersection(range(first, first + 250)):
            return domain
    raise Failure("no free DDS domain between 20 and 99: is the machine full of DDS programs?")


class Session:
    """The processes of one run. `with` ends them all, whatever happens."""

    def __init__(self, options, folder):
        self.options = options
        self.folder = pathlib.Path(folder)
        self.build = pathlib.Path(options.build)
        self.inputs = pathlib.Path(__file__).resolve().parent / "quickstart-inputs"
        self.common = ["--domain", str(free_domain()), "--session", "quickstart"]
        self.environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
        self.running = {}
        self.latest = {}  # the newest line of `tandem top`

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in self.running.values():
            if process.poll() is None:
                process.terminate()
        deadline = time.monotonic() + 3
        for process in self.running.values():
            try:
                process.wait(max(0.1, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def file(self, name, suffix):
        return self.folder / f"{name.replace(' ', '-')}.{suffix}"

    def start(self, name, program, *arguments, pipe=False):
        command = [str(self.build / program), *arguments, *self.common]
        with open(self.file(name, "json"), "wb") as out, open(self.file(name, "err"), "wb") as err:
            self.running[name] = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE if pipe else out,
                stderr=err,
                env=self.environment,
            )

    def longest(self):
        """Seconds after which server and clients end by themselves, should nobody be left to end them."""
        return self.options.seconds + 3 * START_LIMIT_S

    def start_server(self):
        self.start(
            "server", "services/tandemd/tandemd",
            "--scene", self.options.scene, "--bodies", str(self.options.bodies),
            "--wait-for", "2", "--duration", str(self.longest()), "--json",
            "--hash-log", str(self.file("server", "hashes")),
        )  # fmt: skip

    def start_client(self, name, flags):
        flags = [str(self.inputs / flag) if flag.endswith(".textproto") else flag for flag in flags]
        self.start(
            name, "services/tool/tandem", "join", *flags,
            "--seconds", str(self.longest()), "--timeout", str(START_LIMIT_S), "--json",
            "--hash-log", str(self.file(name, "hashes")),
        )  # fmt: skip

    def start_top(self):
        self.start("top", "services/tool/tandem", "top", "--stream", pipe=True)

        def follow(lines):
            for line in lines:
                self.latest = json.loads(line)

        threading.Thread(target=follow, args=(self.running["top"].stdout,), daemon=True).start()

    def errors_of(self, name):
        return self.file(name, "err").read_text(encoding="utf-8", errors="replace").strip()

    def check_running(self):
        """Nobody ends before it is told to."""
        for name, process in self.running.items():
            code = process.poll()
            if code is not None:
                raise Failure(f"{name} ended with exit code {code}:\n{self.errors_of(name)}")

    def frame(self):
        """The server's newest frame that `tandem top` told of; 0 before the first."""
        server = server_of(self.latest)
        return server["frame"] if server else 0

    def stop(self, names, limit_s):
        """Tells these to end, all at the same moment, and waits until they have."""
        for name in names:
            self.running[name].send_signal(signal.SIGINT)
        deadline = time.monotonic() + limit_s
        for name in names:
            try:
                code = self.running[name].wait(max(0.1, deadline - time.monotonic()))
            except subprocess.TimeoutExpired as error:
                raise Failure(f"{name} did not end within {limit_s} s of SIGINT") from error
            if code != 0:
                raise Failure(f"{name} ended with exit code {code}:\n{self.errors_of(name)}")

    def result(self, name):
        text = self.file(name, "json").read_text(encoding="utf-8")
        try:
            return json.loads(text)
        except json.JSONDecodeError as error:
            raise Failure(f"{name} printed no JSON object:\n{self.errors_of(name)}") from error

    def hashes(self, name):
        """{(epoch, frame): hash} of a hash log, in its order."""
        log = {}
        with open(self.file(name, "hashes"), encoding="ascii") as lines:
            for line in lines:
                epoch, frame, value = line.strip().split(",")
                log[int(epoch), int(frame)] = value
        return log


def server_of(top):
    """The session's part of a line of `tandem top --stream`, or None."""
    return next((s for s in top.get("sessions", []) if s["session"] == "quickstart"), None)


def live_line(second, top):
    """One line from a line of `tandem top --stream`."""
    server = server_of(top)
    if server is None:
        return f"{second:4d} s  waiting for the session"
    if server["frame"] == 0:
        return f"{second:4d} s  the server waits for both participants"
    share = 100 * server["mbit_per_s"] / server["raw_mbit_per_s"] if server["raw_mbit_per_s"] else 0
    lags = [
        f"{'observer' if client['role'] == 'observer' else 'participant'} {client['lag_ms']:.0f} ms"
        for client in sorted(top.get("clients", []), key=lambda c: (c["role"] != "participant", c["client"]))
    ]
    return (
        f"{second:4d} s  frame {server['frame']:5d}  {server['mbit_per_s']:5.2f} of {server['raw_mbit_per_s']:.2f} Mbit/s "
        f"({share:.2f} %)  corrected {server['corrected_per_frame']:5.0f}  lag: {', '.join(lags) or 'no client yet'}"
    )


def run(session, seconds):
    """Plays as many frames as fit into `seconds` at full speed, printing a line a second. Returns the frame that the
    server had reached when all clients were told to end.

    Frames are counted, not each client's seconds: on a busy machine clients start at different times, and slow frames
    are no failure. It gives up waiting for them after START_LIMIT_S more."""
    session.start_server()
    session.start_top()
    waiting = list(CLIENTS)
    started = time.monotonic()
    shown, last = 0, None
    while True:
        elapsed = time.monotonic() - started
        while waiting and elapsed >= waiting[0][1]:
            name, _, flags = waiting.pop(0)
            session.start_client(name, flags)
        session.check_running()
        if not waiting and (session.frame() >= seconds * FRAME_RATE_HZ or elapsed > seconds + START_LIMIT_S):
            break
        # A status a second: wait for the next one rather than show the last one twice.
        if elapsed >= shown + 1 and (live_line(0, session.latest) != last or elapsed >= shown + 2):
            shown, last = int(elapsed), live_line(0, session.latest)
            print(live_line(shown, session.latest), flush=True)
        time.sleep(0.05)
    end = session.frame()
    session.stop([name for name, _, _ in CLIENTS], START_LIMIT_S)
    session.stop(["server"], 10)
    return end


# A client may be behind the server's newest frame when it is told to end; one further behind has stopped on its way.
END_SLACK_FRAMES = 150


def compare(server, client, end):
    """(frames compared, problem or None): every frame from the client's first to frame `end`, when all were told to end,
    each with the server's hash."""
    frames = sorted(client)
    if not frames:
        return 0, "applied no frame"
    epoch, first = frames[0]
    for offset, key in enumerate(frames):
        if key != (epoch, first + offset):
            return offset, f"frame {first + offset} is missing"
        if key not in server:
            return offset, f"frame {key[1]} is not in the server's log"
        if client[key] != server[key]:
            return offset, f"frame {key[1]}: hash {client[key]}, the server's is {server[key]}"
    if end - frames[-1][1] > END_SLACK_FRAMES:
        return len(frames), f"stopped at frame {frames[-1][1]}, the session went on to {end}"
    return len(frames), None


def report(session, options, end):
    """Prints the table; True when every client held the server's state on every frame."""
    server = session.result("server")
    server_hashes = session.hashes("server")
    raw = 24 * 8 * options.bodies * FRAME_RATE_HZ / 2**20
    good = True
    print(f"\n{'client':<14} {'joined at':>9} {'frames':>7} {'wrong':>6} {'rejoins':>8} {'Mbit/s':>7} {'inputs':>7}"
          f" {'latency p50':>12} {'p99':>8} {'work p50':>9}")  # fmt: skip
    problems = []
    for name, _, _ in CLIENTS:
        figures = session.result(name)
        hashes = session.hashes(name)
        compared, problem = compare(server_hashes, hashes, end)
        wrong = figures["hash_mismatches"]
        if problem or wrong:
            problems.append(f"{name}: {problem or str(wrong) + ' hash mismatches'}")
        latency, work = figures["latency_ms"], figures["client_ms"]
        first = min(frame for _, frame in hashes) if hashes else 0
        print(f"{name:<14} {first:>9} {compared:>7} {wrong:>6} {figures['resyncs']:>8} {figures['mbit_per_s']:>7.2f}"
              f" {figures['inputs_sent']:>7} {latency['p50']:>9.2f} ms {latency['p99']:>5.2f} ms {work['p50']:>6.2f} ms")  # fmt: skip
    frame_ms = server["frame_ms"]
    print(f"\nserver: {options.bodies} bodies, {server['frames']} frames, {frame_ms['p50']:.2f} ms a frame (p99 {frame_ms['p99']:.2f}),"
          f" {server['mbit_per_s']:.3f} Mbit/s, {100 * server['mbit_per_s'] / raw:.2f} % of raw")  # fmt: skip
    for problem in problems:
        print(f"FAILED  {problem}")
        good = False
    if good:
        print("every client applied every frame since it joined, each with the server's hash")
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True)
    parser.add_argument("--seconds", type=int, required=True)
    parser.add_argument("--bodies", type=int, required=True)
    parser.add_argument("--scene", required=True)
    options = parser.parse_args()

    def stop(number, _):
        raise Failure(f"stopped by {signal.Signals(number).name}")

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    try:
        with tempfile.TemporaryDirectory(prefix="tandem-quickstart-") as folder:
            with Session(options, folder) as session:
                print(f"{options.scene}, {options.bodies} bodies, {options.seconds} s: tandemd and three `tandem join` on DDS"
                      f" domain {session.common[1]}, loopback only", flush=True)  # fmt: skip
                end = run(session, options.seconds)
                return 0 if report(session, options, end) else 1
    except BrokenPipeError:  # nobody reads what we print
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Failure as failure:
        print(f"quickstart: {failure}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
