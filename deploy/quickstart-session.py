"""Runs one server and three clients over loopback DDS, shows them live and compares their hash logs frame by frame. With
--view, runs a server, two participants and a gateway for browsers until Ctrl-C, for a maximum of 12 hours.

deploy/quickstart starts this script and builds the programs first. It needs the standard library only.
"""

import argparse
import json
import os
import pathlib
import random
import re
import secrets
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

OBSERVER_DELAY_S = 5
VIEW_LIMIT_S = 12 * 3600
START_LIMIT_S = 30  # for discovery and joining, for the frames of a slow machine, and for leaving at the end
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
    """The run has failed, and the user should read why."""


def free_domain():
    """A DDS domain with no UDP port in use on this machine."""
    with open("/proc/net/udp", encoding="ascii") as table:
        used = {int(line.split()[1].split(":")[1], 16) for line in table.readlines()[1:]}
    for domain in range(20, 100):  # the ports of higher domains overlap those that the system hands out
        first = 7400 + 250 * domain
        if not used.intersection(range(first, first + 250)):
            return domain
    raise Failure("no free DDS domain between 20 and 99: is the machine full of DDS programs?")


class Stopped(Failure):
    """A signal has stopped the run."""


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
        """Seconds after which server and clients end by themselves if nobody is left to end them."""
        return self.options.seconds + 3 * START_LIMIT_S

    def logging(self, name):
        return ["--hash-log", str(self.file(name, "hashes"))]

    def start_server(self):
        self.start(
            "server", "bin/tandemd",
            "--scene", self.options.scene, "--bodies", str(self.options.bodies),
            "--wait-for", "2", "--duration", str(self.longest()), "--json", *self.logging("server"),
        )  # fmt: skip

    def start_client(self, name, flags):
        flags = [str(self.inputs / flag) if flag.endswith(".textproto") else flag for flag in flags]
        self.start(
            name, "bin/tandem", "join", *flags,
            "--seconds", str(self.longest()), "--timeout", str(START_LIMIT_S), "--json", *self.logging(name),
        )  # fmt: skip

    def start_top(self):
        self.start("top", "bin/tandem", "top", "--stream", pipe=True)

        def follow(lines):
            for line in lines:
                self.latest = json.loads(line)

        threading.Thread(target=follow, args=(self.running["top"].stdout,), daemon=True).start()

    def errors_of(self, name):
        return self.file(name, "err").read_text(encoding="utf-8", errors="replace").strip()

    def check_running(self):
        """Fails if a process has ended by itself."""
        for name, process in self.running.items():
            code = process.poll()
            if code is not None:
                raise Failure(f"{name} ended with exit code {code}:\n{self.errors_of(name)}")

    def frame(self):
        """The newest frame of the server that `tandem top` has shown; 0 before the first."""
        server = server_of(self.latest)
        return server["frame"] if server else 0

    def stop(self, names, limit_s):
        """Stops these processes at the same moment, and waits until they have ended."""
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
        return self.read_hashes(self.file(name, "hashes"))

    def hashes_of_streams(self, name):
        """{(epoch, frame): hashes} of a server's logs, one for each stream."""
        log = {}
        first = self.file(name, "hashes")
        for path in [first, *sorted(first.parent.glob(first.name + ".*"))]:
            for key, value in self.read_hashes(path).items():
                log.setdefault(key, set()).add(value)
        return log

    @staticmethod
    def read_hashes(path):
        log = {}
        with open(path, encoding="ascii") as lines:
            for line in lines:
                epoch, frame, value = line.strip().split(",")
                log[int(epoch), int(frame)] = value
        return log


class View(Session):
    """A server, two participants that tilt it, and a gateway that serves the viewer."""

    participants = ("participant 1", "participant 2")

    def __init__(self, options, folder):
        super().__init__(options, folder)
        self.token = secrets.token_urlsafe(16)

    def longest(self):
        return VIEW_LIMIT_S + 3 * START_LIMIT_S

    def logging(self, name):
        return []

    def start_all(self):
        self.start_server()
        for place, name in enumerate(self.participants):
            script = self.file(name, "textproto")
            script.write_text(tilts(place, scene_strength(self.options.scene), self.longest()), encoding="ascii")
            self.start_client(name, ["--input-script", str(script)])
        self.start("gateway", "bin/tandem-gateway", *self.gateway_flags())

    def gateway_flags(self):
        flags = ["--port", str(self.options.port), "--viewer", str(self.build / "sdk/web/viewer")]
        if self.options.lan:
            certificate, key = self.file("gateway", "crt"), self.file("gateway", "key")
            make_certificate(certificate, key, lan_address())
            token = self.file("gateway", "token")
            token.write_text(self.token + "\n", encoding="ascii")
            flags += ["--listen", "0.0.0.0", "--tls-cert", str(certificate), "--tls-key", str(key), "--token-file", str(token)]
        return flags

    def address(self):
        """The address to open in a browser."""
        if not self.options.lan:
            return f"http://localhost:{self.options.port}/"
        return f"https://{lan_address()}:{self.options.port}/#token={self.token}"

    def plays(self):
        """Whether the gateway follows the session."""
        scheme = "https" if self.options.lan else "http"
        trusting = ssl.create_default_context()
        trusting.check_hostname, trusting.verify_mode = False, ssl.CERT_NONE  # this run made the certificate
        try:
            with urllib.request.urlopen(f"{scheme}://127.0.0.1:{self.options.port}/healthz", timeout=2, context=trusting) as health:
                return json.load(health)["phase"] == "playing"
        except (OSError, ValueError, KeyError):
            return False


def scene_strength(scene):
    """Gravity of a scene of services/engines/scenes, m/s^2."""
    path = pathlib.Path(__file__).resolve().parents[1] / "services" / "engines" / "scenes" / f"{scene}.textproto"
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    found = re.search(r"^gravity \{ y: -([0-9.]+) \}", text, re.MULTILINE)
    return float(found[1]) if found else 9.81


TILT_PERIOD_S = 24


def tilts(place, strength, seconds):
    """An input script of participant `place`, from 0: gravity leans to some side, and sometimes turns over."""
    dice = random.Random(place)
    lines = []
    for i in range(int(seconds / TILT_PERIOD_S)):
        x, z = dice.uniform(-0.5, 0.5), dice.uniform(-0.5, 0.5)
        y = (1 if i % 4 == 3 else -1) * (1 - x * x - z * z) ** 0.5
        gravity = " ".join(f"{axis}: {strength * value:.3f}" for axis, value in zip("xyz", (x, y, z)))
        lines.append(f"inputs {{ time_s: {4 + TILT_PERIOD_S * (i + place / 2):.1f} gravity {{ {gravity} }} }}\n")
    return "".join(lines)


def lan_address():
    """The address by which others on the network see this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing, but selects the interface
            return probe.getsockname()[0]
        except OSError:
            return "127.0.0.1"


def make_certificate(certificate, key, address):
    """Makes a self-signed certificate for a week."""
    command = [
        "openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "7",
        "-subj", "/CN=tandem quickstart", "-addext", f"subjectAltName=IP:{address},IP:127.0.0.1,DNS:localhost",
        "-keyout", str(key), "-out", str(certificate),
    ]  # fmt: skip
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    if made.returncode != 0:
        raise Failure(f"openssl made no certificate:\n{made.stderr.strip()}")


def view(session):
    """Runs until a signal comes, or for VIEW_LIMIT_S."""
    session.start_all()
    deadline = time.monotonic() + START_LIMIT_S
    while not session.plays():
        session.check_running()
        if time.monotonic() > deadline:
            raise Failure(f"the gateway does not play after {START_LIMIT_S} s:\n{session.errors_of('gateway')}")
        time.sleep(0.1)
    address = session.address()
    if session.options.lan:
        subprocess.run(["qrencode", "-t", "ANSIUTF8", "-m", "2", address], check=False)
        print("The certificate was made for this run, so browsers will ask whether to go on.")
    print(f"open {address}\nstop with Ctrl-C; it runs for a maximum of {VIEW_LIMIT_S // 3600} hours", flush=True)
    deadline = time.monotonic() + VIEW_LIMIT_S
    while time.monotonic() < deadline:
        session.check_running()
        time.sleep(0.2)


def server_of(top):
    """The session's part of a line of `tandem top --stream`, or None."""
    return next((s for s in top.get("sessions", []) if s["session"] == "quickstart"), None)


def live_line(second, top):
    """The line to print for a line of `tandem top --stream`."""
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
    """Plays as many frames as fit into `seconds` at full speed, printing a line per second. Returns the frame that the
    server had reached when all clients were stopped.

    It counts frames, not each client's seconds, because on a busy machine clients start at different times, and slow
    frames are no failure. It stops waiting for frames after START_LIMIT_S more."""
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
        # Status comes once a second: wait for the next one rather than show the last one twice.
        if elapsed >= shown + 1 and (live_line(0, session.latest) != last or elapsed >= shown + 2):
            shown, last = int(elapsed), live_line(0, session.latest)
            print(live_line(shown, session.latest), flush=True)
        time.sleep(0.05)
    end = session.frame()
    session.stop([name for name, _, _ in CLIENTS], START_LIMIT_S)
    session.stop(["server"], 10)
    return end


# A client may be this far behind the server's newest frame when it is stopped; one further behind stopped by itself.
END_SLACK_FRAMES = 150


def compare(server, client, end):
    """Compares every frame from the client's first to frame `end`, at which all were stopped, with the server's hashes in
    all streams. Returns (frames compared, problem or None)."""
    frames = sorted(client)
    if not frames:
        return 0, "applied no frame"
    epoch, first = frames[0]
    for offset, key in enumerate(frames):
        if key != (epoch, first + offset):
            return offset, f"frame {first + offset} is missing"
        if key not in server:
            return offset, f"frame {key[1]} is not in the server's log"
        if client[key] not in server[key]:
            return offset, f"frame {key[1]}: hash {client[key]}, the server's are {sorted(server[key])}"
    if end - frames[-1][1] > END_SLACK_FRAMES:
        return len(frames), f"stopped at frame {frames[-1][1]}, the session went on to {end}"
    return len(frames), None


def report(session, options, end):
    """Prints the table. Returns True if every client held the server's state on every frame."""
    server = session.result("server")
    server_hashes = session.hashes_of_streams("server")
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
    parser.add_argument("--view", action="store_true")
    parser.add_argument("--lan", action="store_true")
    parser.add_argument("--port", type=int, default=8080)
    options = parser.parse_args()

    def stop(number, _):
        raise Stopped(f"stopped by {signal.Signals(number).name}")

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    try:
        with tempfile.TemporaryDirectory(prefix="tandem-quickstart-") as folder:
            if options.view:
                with View(options, folder) as session:
                    print(f"{options.scene}, {options.bodies} bodies, on DDS domain {session.common[1]}, loopback only", flush=True)
                    view(session)
                return 0
            with Session(options, folder) as session:
                print(f"{options.scene}, {options.bodies} bodies, {options.seconds} s: tandemd and three `tandem join` on DDS"
                      f" domain {session.common[1]}, loopback only", flush=True)  # fmt: skip
                end = run(session, options.seconds)
                return 0 if report(session, options, end) else 1
    except BrokenPipeError:  # nobody reads what we print
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Failure as failure:
        if options.view and isinstance(failure, Stopped):
            return 0
        print(f"quickstart: {failure}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
