"""Real programs on networks of their own: a namespace, whose loopback can be shaped, and others beside it."""

import argparse
import contextlib
import ctypes
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

NOT_RUN = 77
QUEUE_MS = 400  # what a router keeps before it drops
SEED = 1
URI = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="{}" multicast="true"/></Interfaces>'
    "</General><Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain></CycloneDDS>"
)
CLONE_NEWNET = 0x40000000
LIBC = ctypes.CDLL(None, use_errno=True)


class Failed(Exception):
    """A measured value is out of its limits."""


def shell(*words):
    subprocess.run(words, check=True, capture_output=True, text=True)


def enter_namespace():
    """Enter a network of our own, which ends with this process: as root directly, otherwise through a user namespace."""
    if LIBC.unshare(CLONE_NEWNET) != 0:
        if os.environ.get("TANDEM_STAGE_INNER"):
            return False
        os.environ["TANDEM_STAGE_INNER"] = "1"
        try:
            os.execvp("unshare", ["unshare", "--user", "--map-root-user", sys.executable, "-B", *sys.argv])
        except OSError:
            return False
    try:
        shell("ip", "link", "set", "lo", "mtu", "1500", "up")
        shell("ip", "link", "set", "lo", "multicast", "on")
        shell("ip", "route", "add", "224.0.0.0/4", "dev", "lo")
        shell("tc", "qdisc", "add", "dev", "lo", "root", "tbf", "rate", "1gbit", "burst", "1mb", "latency", "400ms")
    except (OSError, subprocess.CalledProcessError):
        return False
    return True


class Namespace:
    """A network beside the test's own, gone with the last program in it. Its interface gets a name that programs use."""

    def __init__(self, interface):
        self.interface = interface
        self.descriptor = None
        with self.entered():
            shell("ip", "link", "set", "lo", "up")

    @contextlib.contextmanager
    def entered(self):
        """Within this context, sockets and programs of this thread are opened and started in that namespace."""
        outside = os.open("/proc/thread-self/ns/net", os.O_RDONLY)
        try:
            if self.descriptor is None:
                entered = LIBC.unshare(CLONE_NEWNET)
                self.descriptor = os.open("/proc/thread-self/ns/net", os.O_RDONLY)
            else:
                entered = LIBC.setns(self.descriptor, CLONE_NEWNET)
            if entered != 0:
                raise OSError(ctypes.get_errno(), "a network namespace was refused")
            yield
        finally:
            LIBC.setns(outside, CLONE_NEWNET)
            os.close(outside)

    def end(self):
        os.close(self.descriptor)


def link(kbit):
    """Limit the rate of everything that goes through loopback from now on."""
    burst = max(4000, kbit * 1000 // 8 // 100)
    shell("tc", "qdisc", "replace", "dev", "lo", "root", "tbf", "rate", f"{kbit}kbit", "burst", str(burst),
          "latency", f"{QUEUE_MS}ms")  # fmt: skip


def fast_link():
    shell("tc", "qdisc", "replace", "dev", "lo", "root", "tbf", "rate", "1gbit", "burst", "1mb", "latency", "400ms")


def cut_link():
    """Drop every packet, because each is larger than the bucket."""
    shell("tc", "qdisc", "replace", "dev", "lo", "root", "tbf", "rate", "8kbit", "burst", "20", "limit", "20")


def environment(interface):
    """Return what programs inherit: they use this interface; with None they have no CYCLONEDDS_URI, and decide themselves."""
    inherited = {name: value for name, value in os.environ.items() if name != "CYCLONEDDS_URI"}
    return {**inherited, "CYCLONEDDS_URI": URI.format(interface)} if interface else inherited


class Process:
    """A program whose stderr is read line by line, with the time of each."""

    def __init__(self, *command, interface="lo"):
        self.started = time.monotonic()
        self.lines = []
        self.process = subprocess.Popen(
            [str(word) for word in command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, errors="replace", env=environment(interface),
        )  # fmt: skip
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stderr:
            self.lines.append((time.monotonic(), line.rstrip()))

    def first(self, text, after=0.0):
        """Return when the first line with that text came, or None."""
        return next((at for at, line in list(self.lines) if at >= after and text in line), None)

    def wait_for(self, text, seconds, after=0.0):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if (at := self.first(text, after)) is not None:
                return at
            if self.process.poll() is not None:
                self.reader.join(1)  # its last lines may still be on their way
                if (at := self.first(text, after)) is not None:
                    return at
                break
            time.sleep(0.01)
        tail = "\n".join(line for _, line in self.lines[-8:])
        raise Failed(f"waited {seconds:.0f} s for '{text}'; it said last:\n{tail}")

    def cpu_seconds(self):
        """Return the processor time of all its threads. Other programs hardly change it."""
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def resident_kb(self):
        """Return the part of its memory that is in RAM."""
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s*(\d+)", status)[1])

    def log_bytes(self):
        """Return the size of its lines for people, without live lines."""
        return sum(len(line) + 1 for _, line in list(self.lines) if not line.startswith("{"))

    def live(self):
        """Return the live lines of a client, with the time of each."""
        return [(at, json.loads(line)) for at, line in list(self.lines) if line.startswith("{")]

    def output(self, seconds):
        """Wait until it ends by itself. Return the JSON object that it printed, or {}."""
        try:
            out = self.process.stdout.read()
            self.process.wait(seconds)
        finally:
            self.process.kill()
        return json.loads(out) if out.strip().startswith("{") else {}

    def stop(self):
        self.process.send_signal(signal.SIGCONT)
        self.process.send_signal(signal.SIGINT)
        return self.output(30)


class Stage:
    def __init__(self, options):
        self.options = options
        self.running = []
        self.folder = tempfile.mkdtemp()
        self.interface = "lo"  # of what starts from now on

    def start(self, *command, namespace=None):
        if namespace is None:
            self.running.append(Process(*command, interface=self.interface))
        else:
            with namespace.entered():
                self.running.append(Process(*command, interface=namespace.interface))
        return self.running[-1]

    def server(self, bodies, *more, scene="half_pipe", namespace=None):
        server = self.start(
            self.options.tandemd, "--scene", scene, "--bodies", bodies, "--seed", SEED, "--json", *more,
            namespace=namespace,
        )  # fmt: skip
        server.wait_for("session 'default'", 60)
        time.sleep(2.0)  # the claim of the name, and some frames
        return server

    def client(self, *more, namespace=None):
        return self.start(self.options.tandem, "join", "--json", "--live", *more, namespace=namespace)

    def end_all(self):
        """End all programs that run."""
        for each in self.running:
            if each.process.poll() is None:
                each.process.kill()
            each.process.wait()
        self.running.clear()

    def end(self):
        self.end_all()
        shutil.rmtree(self.folder)


def arguments(documentation, short_help=None):
    parser = argparse.ArgumentParser(description=documentation, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tandemd", type=pathlib.Path, required=True)
    parser.add_argument("--tandem", type=pathlib.Path, required=True)
    parser.add_argument("--list", action="store_true", help="the names of all cases")
    if short_help:
        parser.add_argument("--short", action="store_true", help=short_help)
    parser.add_argument("cases", nargs="*", metavar="CASE")
    return parser


def run(cases, chosen, parser, options):
    """Runs the chosen cases, all without any; returns the exit code."""
    if options.list:
        print("\n".join(cases))
        return 0
    unknown = [case for case in chosen if case not in cases]
    if unknown:
        parser.error(f"no case {unknown[0]}; --list says which there are")
    if not enter_namespace():
        print("not run: network namespaces or tc are not allowed here")
        return NOT_RUN
    failures = 0
    for name in chosen or cases:
        print(f"{name}:", flush=True)
        fast_link()
        stage = Stage(options)
        try:
            cases[name](stage)
        except Failed as failure:
            failures += 1
            print(f"  FAILED: {failure}", flush=True)
        finally:
            fast_link()
            stage.end()
    print(f"{failures} failed" if failures else "passed")
    return 1 if failures else 0
