#!/usr/bin/env python3
"""Runs every command of deploy/monitor/README.md, as it stands there, on a live session, and compares what they show with the page;
and the command with ddsperf of deploy/dds/README.md, with addresses of this machine.

commands_test.py --tandemd PATH --tandem PATH

The network is one of its own, so that captures hold this session alone. Exit 77 (not run) where that is not allowed, or ddsperf or
tshark is missing. 0 passed, 1 failed.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests" / "fault"))
from stage import NOT_RUN, URI, enter_namespace  # noqa: E402

PAGE = ROOT / "deploy" / "monitor" / "README.md"
PROFILES = ROOT / "deploy" / "dds"
LIMIT_S = 60  # of any one wait; a busy machine is slow


def shown(text):
    """The commands of the page, each with the output that the page shows for it."""
    found = {}
    for block in re.findall(r"(?ms)^```\n(.*?)^```$", text):
        for part in re.split(r"(?m)^\$ ", block)[1:]:
            lines = part.splitlines()
            command = [lines.pop(0)]
            while re.search(r"[|\\]$", command[-1]) and lines:
                command.append(lines.pop(0))
            found["\n".join(command).split("#")[0].rstrip()] = [line for line in lines if line.strip()]
    return found


class Session:
    """The programs of a session, which end with it."""

    def __init__(self, options, folder):
        self.folder, self.running = pathlib.Path(folder), []
        for program in (options.tandemd, options.tandem):
            (self.folder / program.name).symlink_to(program)
        self.environment = {**os.environ, "CYCLONEDDS_URI": URI.format("lo"), "PATH": f"{folder}:{os.environ['PATH']}"}

    def start(self, command):
        log = open(self.folder / f"log{len(self.running)}", "w+b")
        # A group of its own, because a shell passes no signal on.
        self.running.append(subprocess.Popen(
            ["sh", "-c", command], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
        ))  # fmt: skip
        log.close()
        return self.running[-1]

    def run(self, command, quiet=False):
        done = subprocess.run(
            ["sh", "-c", command], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
            timeout=LIMIT_S, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}: exit {done.returncode}: {done.stdout}{done.stderr}"
        print(f"$ {command}\n{'' if quiet else done.stdout}", flush=True)
        return done.stdout.splitlines()

    def end(self):
        for process in self.running:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        self.running.clear()


def background(command):
    """The command without its `&`: the session keeps it."""
    assert command.endswith("&"), command
    return command.rstrip("& ")


def wait_for(condition, what):
    deadline = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < deadline, f"{what}: not within {LIMIT_S} s"
        time.sleep(0.1)


def the(commands, start):
    """The page's only command that begins so; it is taken out."""
    found = [command for command in commands if command.startswith(start)]
    assert len(found) == 1, f"'{start}': {found}"
    return found[0], commands.pop(found[0])


def check_capture(session, commands):
    """The topics that the page shows are those that the capture has, and samples are shown."""
    capture, _ = the(commands, "tshark -i")
    read, expected = the(commands, "tshark -r")
    process = session.start(background(capture))
    pcap = session.folder / re.search(r"-w (\S+)", capture)[1]
    wait_for(lambda: pcap.exists() or process.poll() is not None, "the capture")
    for start in ("tandemd", "tandem join --domain", "tandem join --observe"):
        session.start(background(the(commands, start)[0]))
    assert process.wait(LIMIT_S) == 0
    counts = dict(line.split() for line in session.run(read))
    missing = {line.split()[0] for line in expected} - set(counts)
    assert not missing, f"the page shows {missing}, the capture has {counts}"
    assert max(counts, key=lambda topic: int(counts[topic])) == "TandemDelta", counts
    # Without awk: the bytes of each sample.
    assert any(re.search("serializedData: [0-9a-f]{16}", line) for line in session.run(read.split(" |")[0], quiet=True))


def check_top(session, commands):
    """Its tables and its object come, and have the clients."""
    json_of = "tandem top --domain 80 --once --json"

    def playing():
        seen = json.loads("\n".join(session.run(json_of, quiet=True)))
        return [client["phase"] for client in seen["clients"]] == ["playing"] * 2

    wait_for(playing, "clients that play")
    for command in [command for command in commands if command.startswith("tandem top")]:
        commands.pop(command)
        assert any("arena" in line for line in session.run(command))


def check_ddsperf(session, commands):
    """Round trips: the page's line with other numbers."""
    pong, _ = the(commands, "ddsperf -i 85 pong")
    ping, expected = the(commands, "ddsperf -i 85 -D")
    session.start(background(pong))
    got = session.run(ping)

    def shape(line):
        return re.sub(r"[0-9][0-9.]*", "0", re.sub(r"\S+:[0-9]+ size", "HOST size", line))

    # How many threads had processor time, and how much, differs.
    trips = {shape(line) for line in got if "50%" in line}
    wanted = {shape(line) for line in expected if "50%" in line}
    assert wanted and wanted <= trips, f"{wanted} is not in {got}"


def check_ddsperf_with_a_profile(session):
    """One program of the profile `wan` finds another at the server's port, and only there."""
    page = re.search(r"(?m)^TANDEM_INTERFACE=.* ddsperf sanity$", (PROFILES / "README.md").read_text(encoding="utf-8"))
    assert page, "deploy/dds/README.md shows no command with ddsperf"
    command = page[0]
    places = (("=eth0", "=lo"), ("=203.0.113.5:", "=127.0.0.1:"), ("/usr/share/tandem/dds/", f"{PROFILES}/"), ("ddsperf", "ddsperf -D 5"))
    for shown_there, here in places:
        assert shown_there in command, command
        command = command.replace(shown_there, here)
    session.start("TANDEM_INDEX=0 " + command.replace("-D 5 sanity", "pong"))
    assert any("size 12 mean" in line for line in session.run(command)), "no round trip"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--tandemd", "--tandem"):
        parser.add_argument(option, type=pathlib.Path, required=True)
    options = parser.parse_args()
    for program, package in (("ddsperf", "cyclonedds-tools"), ("tshark", "tshark")):
        if not shutil.which(program):
            print(f"not run: {program} is missing ({package}: deploy/install-packages build tests)")
            return NOT_RUN
    if os.geteuid() != 0:
        print("not run: a capture needs root")
        return NOT_RUN
    if not enter_namespace():
        print("not run: network namespaces or tc are not allowed here")
        return NOT_RUN
    commands = shown(PAGE.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        session = Session(options, folder)
        try:
            check_capture(session, commands)
            check_top(session, commands)
            session.end()
            check_ddsperf(session, commands)
            session.end()
            check_ddsperf_with_a_profile(session)
            assert not commands, f"commands of the page that no test runs: {list(commands)}"
        except (AssertionError, subprocess.SubprocessError) as failure:
            print(f"FAILED: {failure}", file=sys.stderr)
            for log in sorted(session.folder.glob("log*")):
                print(f"--- {log.name}\n{log.read_text(errors='replace')[-1500:]}", file=sys.stderr)
            return 1
        finally:
            session.end()
    return 0


if __name__ == "__main__":
    sys.exit(main())
