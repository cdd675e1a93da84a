"""Programs of the cases: a server, and groups of clients that say at their end whether they missed anything."""

import pathlib
import re
import time

from stage import Failed, Stage

PLAYING = re.compile(r"(?:\[(\d+)\] )?playing from frame (\d+)")
LOST = re.compile(r"joining again: ([^,]+)")
DIES_WITH_US = ("setpriv", "--pdeathsig", "KILL", "--")  # nothing is left running, even if this program is killed


class SoakStage(Stage):
    def start(self, *command, namespace=None):
        return super().start(*DIES_WITH_US, *command, namespace=namespace)

    def path(self, name):
        return pathlib.Path(self.folder) / name

    def serve(self, bodies, *more, scene="half_pipe"):
        server = self.start(self.options.tandemd, "--scene", scene, "--bodies", bodies, "--seed", self.options.seed,
                            "--json", *more)  # fmt: skip
        server.wait_for("session 'default'", 60)
        return server

    def pushes(self, seconds):
        """Write a script of one small push a second."""
        path = self.path("pushes.textproto")
        path.write_text("".join(
            f"inputs {{ time_s: {i + 1} push {{ centre {{ y: 5 }} radius_m: 2 velocity_change {{ y: 1 }} }} }}\n"
            for i in range(int(seconds))
        ))  # fmt: skip
        return path


class Group:
    """Clients in one process. Each has a DDS participant of its own; they share the sockets and threads of DDS."""

    def __init__(self, stage, count, *more):
        self.count = count
        # An observer has a machine of its own, so it must not take the server's and the participants' time.
        polite = ("nice", "-n", "10") if "--observe" in more else ()
        self.process = stage.start(*polite, stage.options.tandem, "join", "--count", count, "--json", "--timeout", 180, *more)

    def first_frames(self):
        """Return the first frame of each client that plays, by its index."""
        first = {}
        for _, line in list(self.process.lines):
            if found := PLAYING.search(line):
                first.setdefault(int(found[1] or 0), int(found[2]))
        return first

    def wait(self, seconds):
        deadline = time.monotonic() + seconds
        while len(self.first_frames()) < self.count:
            if time.monotonic() > deadline or self.process.process.poll() is not None:
                last = [line for _, line in self.process.lines[-3:]]
                raise Failed(f"{len(self.first_frames())} of {self.count} clients play after {seconds} s: {last}")
            time.sleep(0.05)

    def stop(self):
        """End the clients. Return what is wrong with each that is not complete."""
        first = self.first_frames()
        report = self.process.stop() if self.process.process.poll() is None else self.process.output(30)
        clients = report.get("clients", [report] if report else [])
        wrong = [fault for i, client in enumerate(clients) if (fault := fault_of(client, first.get(i)))]
        reasons = [f"they said: {'; '.join(self.reasons())}"] if wrong and self.reasons() else []
        return [", ".join([fault, *reasons]) for fault in wrong] + ["gave no report"] * (self.count - len(clients))

    def reasons(self):
        """Return why clients of this process joined again."""
        return sorted({found[1] for _, line in list(self.process.lines) if (found := LOST.search(line))})


def fault_of(client, first):
    """Say what a client's report lacks; an empty text if it had every frame since its first, each with the server's hash."""
    if not client["frames_applied"]:
        return "never played"
    if client["hash_mismatches"] or client["resyncs"] or client["epochs"] != 1:
        return f"{client['hash_mismatches']} mismatches, {client['resyncs']} rejoins, {client['epochs']} epochs"
    due = client["last_frame"] - first if first is not None else 0
    return f"{client['frames_applied']} of {due} frames" if client["frames_applied"] < due else ""


def wait_until(ready, seconds, what):
    deadline = time.monotonic() + seconds
    while not ready():
        if time.monotonic() > deadline:
            raise Failed(f"waited {seconds:.0f} s for {what}")
        time.sleep(0.05)


def top(stage):
    """Return what `tandem top --once --json` hears."""
    return stage.start(stage.options.tandem, "top", "--once", "--json").output(30)
