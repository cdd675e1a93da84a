"""The processes of a scenario and their logs, and what is compared at its end."""

import json
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import time

LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/>'
    "</Interfaces></General><Discovery><Tag>{tag}</Tag></Discovery></Domain></CycloneDDS>"
)
TESTS = pathlib.Path(__file__).resolve().parents[2]
REFERENCE = TESTS / "reference"
sys.path[:0] = [str(REFERENCE), str(TESTS / "support" / "hang")]
LIMIT_S = 90  # of any one wait; a busy machine is slow


class Failed(Exception):
    """A broken promise, in one line."""


class Stage:
    """The processes of one scenario, ended whatever happens."""

    def __init__(self, options, folder):
        self.options = options
        self.folder = pathlib.Path(folder)
        self.processes = {}
        # The tag keeps sessions of tests that run at the same time apart, whatever their domain.
        tag = f"session-test-{os.getpid()}"
        self.environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK.format(tag=tag)}
        self.common = ["--domain", str(random.Random(os.getpid()).randrange(20, 90))]

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        for process in self.processes.values():
            if process.poll() is None:
                process.kill()  # also ends what is stopped
                process.wait()
        if kind is not None:
            for log in sorted(self.folder.glob("*.err")):
                print(f"--- {log.stem}\n{log.read_text(errors='replace')[-3000:]}", file=sys.stderr)

    def start(self, name, program, *arguments):
        with open(self.folder / f"{name}.out", "wb") as out, open(self.folder / f"{name}.err", "wb") as err:
            self.processes[name] = subprocess.Popen(
                [program, *map(str, arguments), *self.common],
                stdin=subprocess.DEVNULL, stdout=out, stderr=err, env=self.environment,
            )  # fmt: skip

    def server(self, name, *arguments, scene="half_pipe", bodies=400):
        # There is one stream, so that a frame has one hash.
        predictor = () if {"--predictor", "--codec", "--stream"} & set(arguments) else ("--predictor", "field")
        self.start(
            name, self.options.tandemd, "--scene", scene, "--bodies", bodies, "--json",
            "--hash-log", self.log(name), *predictor, *arguments,
        )  # fmt: skip

    def client(self, name, *arguments):
        log = ("--hash-log", self.log(name)) if "--hash-log" not in arguments else ()
        self.start(name, self.options.tandem, "join", "--json", "--live", *log, *arguments)

    def script(self, name, seed, count, period_s):
        """An input script: gravity turns every `period_s`."""
        dice = random.Random(seed)
        path = self.folder / f"{name}.textproto"
        with open(path, "w", encoding="ascii") as out:
            for i in range(count):
                x, y = dice.uniform(-4, 4), dice.uniform(-4, 4)
                gravity = f"gravity {{ x: {x:.3f} y: {y:.3f} z: -9.0 }}"
                out.write(f"inputs {{ time_s: {(i + 1) * period_s:.2f} {gravity} }}\n")
        return path

    def log(self, name):
        return self.folder / f"{name}.hashes"

    def hashes(self, name):
        """{(epoch, frame): hash}; the last line of a killed process may be cut off."""
        found, order = {}, []
        if self.log(name).exists():
            for line in self.log(name).read_text(encoding="ascii", errors="replace").split("\n"):
                match = re.fullmatch(r"(\d+),(\d+),([0-9a-f]{16})", line)
                if match:
                    key = (int(match[1]), int(match[2]))
                    found[key] = match[3]
                    order.append(key)
        if len(found) != len(order):
            raise Failed(f"{name} logged a frame twice")
        return found

    def says(self, name, what):
        return what in (self.folder / f"{name}.err").read_text(errors="replace")

    def live(self, name):
        """Newest live line of a client, or an empty object."""
        lines = (self.folder / f"{name}.err").read_text(errors="replace").split("\n")
        live = [line for line in lines[:-1] if line.startswith("{")]
        return json.loads(live[-1]) if live else {}

    def wait_live(self, names, condition, what):
        def ready():
            for name in names:
                if self.processes[name].poll() is not None:
                    raise Failed(f"{name} ended while {what} was waited for")
            return all(condition(self.live(name)) for name in names)

        self.wait(ready, what)

    @staticmethod
    def wait(ready, what):
        deadline = time.monotonic() + LIMIT_S
        while not ready():
            if time.monotonic() > deadline:
                raise Failed(f"waited {LIMIT_S} s for {what}")
            time.sleep(0.05)

    def end(self, name, code=0):
        """Waits for a process to end by itself and returns its JSON object."""
        try:
            got = self.processes[name].wait(LIMIT_S)
        except subprocess.TimeoutExpired as error:
            raise Failed(f"{name} did not end within {LIMIT_S} s") from error
        if got != code:
            raise Failed(f"{name} ended with {got}, not {code}")
        text = (self.folder / f"{name}.out").read_text(encoding="utf-8")
        try:
            return json.loads(text)
        except json.JSONDecodeError as error:
            raise Failed(f"stdout of {name} is not one JSON object: {text!r}") from error

    def resident_kb(self, name):
        """Memory that a process has written to, in KiB; without its program and libraries."""
        status = pathlib.Path(f"/proc/{self.processes[name].pid}/status").read_text(encoding="ascii")
        return int(re.search(r"RssAnon:\s*(\d+) kB", status)[1])

    def stop(self, name, code=0):
        self.processes[name].send_signal(signal.SIGTERM)
        return self.end(name, code)

    def kill(self, name):
        self.processes[name].kill()
        self.processes[name].wait()


def compare(stage, servers, client, least, resyncs=0):
    """Every frame a client applied has a server's hash, and none is missing unless it joined again."""
    truth = {}
    for server in servers:
        truth.update(stage.hashes(server))
    got = stage.hashes(client)
    if len(got) < least:
        raise Failed(f"{client} applied {len(got)} frames, expected at least {least}")
    last_logged = {}
    for epoch, frame in truth:
        last_logged[epoch] = max(frame, last_logged.get(epoch, 0))
    compared = 0
    for (epoch, frame), value in got.items():
        if frame > last_logged.get(epoch, 0):
            continue  # a killed server does not write its last lines
        if truth.get((epoch, frame)) != value:
            raise Failed(f"{client}: frame {frame} of epoch {epoch} is {value}, the server's {truth.get((epoch, frame))}")
        compared += 1
    if compared < least // 2:
        raise Failed(f"{client}: only {compared} frames could be compared")
    holes = sum(1 for epoch, frame in got if (epoch, frame - 1) not in got) - len({epoch for epoch, _ in got})
    if holes > resyncs:
        raise Failed(f"{client}: {holes} holes in its frames, but {resyncs} resyncs")
    print(f"{client}: {compared} frames agree, {holes} holes, {resyncs} resyncs")


def check_capture(path, logged, changes=0):
    """Lets the reference decoder reproduce every state of a capture; its frames must be those of the hash log.

    At least so many of its deltas change parameters.
    """
    try:
        from tandem_reference import capture, payload
        from tandem_reference.reader import Reader
    except ImportError as error:
        print(f"  the capture is not checked: {error}")
        return
    file = capture.read(path.read_bytes())
    hashes = {(key[0], key[3]): f"{first.hash:016x}" for key, first, _ in file.deltas.whole()}
    if hashes != logged:
        raise Failed("the capture and the hash log differ")
    known = {kind: "section" for kind in payload.ORDER}
    told = [[kind for kind, _ in payload.sections(Reader(data, "payload"), known)] for _, _, data in file.deltas.whole()]
    if sum(payload.PARAMETERS in kinds for kinds in told) < changes:
        raise Failed(f"fewer than {changes} deltas change parameters")
    if not file.snapshots.held:
        raise Failed("the capture has no snapshot")
    checked = subprocess.run(
        [sys.executable, "-B", "-m", "tandem_reference", path], cwd=REFERENCE, capture_output=True, text=True, check=False
    )  # fmt: skip
    if checked.returncode != 0:
        raise Failed(f"the reference decoder says: {checked.stdout[-500:]}{checked.stderr[-500:]}")
    print(f"  reference decoder: {checked.stdout.strip().splitlines()[-1]}", flush=True)


def check_report(report, keys=()):
    for key in (
        "frames_applied resyncs hash_mismatches payload_bytes mbit_per_s latency_ms input_latency_ms client_ms join_ms "
        "inputs_sent inputs_refused last_frame state_hash"
    ).split():
        if key not in report:
            raise Failed(f"{key} is missing from the report")
    if report["hash_mismatches"] != 0:
        raise Failed(f"{report['hash_mismatches']} hash mismatches")
    for key in keys:
        if not report[key] > 0:
            raise Failed(f"{key} is {report[key]}")
