#!/usr/bin/env python3
"""Programs whose network interface is gone end in time: a network namespace with an interface that is taken away.

ends.py --tandemd PATH --tandem PATH [--gateway PATH] [--list | CASE ...]

Cyclone DDS, when it stops, waits for a packet to itself, which never comes without the interface. Every program has to end
within 5 s of a signal all the same, with its reports and files complete, and to leave nothing. Without CASE all run, in
half a minute. Exit 0 passed, 1 failed, 77 not run: namespaces or virtual interfaces are not allowed here.
"""

import json
import pathlib
import signal
import subprocess
import sys
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from stage import NOT_RUN, Failed, arguments, run, shell  # noqa: E402

INTERFACE, FAR_END = "cable", "socket"
LIMIT_S = 5
LEFT = "DDS had not ended"
MCAP_END = b"\x89MCAP0\r\n"


def plug_in(stage):
    """Let all further programs start on an interface of their own."""
    try:
        shell("ip", "link", "add", INTERFACE, "type", "veth", "peer", "name", FAR_END)
    except subprocess.CalledProcessError as error:
        print(f"not run: virtual interfaces are not allowed here: {error.stderr.strip()}")
        sys.exit(NOT_RUN)
    shell("ip", "address", "add", "10.77.0.1/24", "dev", INTERFACE)
    for name in (INTERFACE, FAR_END):
        shell("ip", "link", "set", name, "up")
    stage.interface = INTERFACE


def pull_out():
    shell("ip", "link", "delete", INTERFACE)


def start_all(stage):
    """Start every program of ours that speaks DDS. Return them by name."""
    folder, options = pathlib.Path(stage.folder), stage.options
    started = {"tandemd": stage.server(200, "--hash-log", folder / "server")}
    recorder = stage.start(options.tandem, "record", folder / "first.mcap", "--seconds", 1, "--json")
    recorder.output(30)
    started["join"] = stage.client("--hash-log", folder / "client")
    started["record"] = stage.start(options.tandem, "record", folder / "second.mcap", "--json")
    started["replay"] = stage.start(options.tandem, "replay", folder / "first.mcap", "--session", "again", "--loop")
    started["top"] = stage.start(options.tandem, "top", "--stream")
    if options.gateway:
        started["gateway"] = stage.start(options.gateway, "--port", 0)
    for name in ("join", "record", "gateway"):
        if name in started:
            started[name].wait_for("playing from frame", 30)
    started["replay"].wait_for("session 'again'", 30)
    time.sleep(2)
    return started


def send(programs, number):
    """Send a signal to all programs. Return the time."""
    sent = time.monotonic()
    for program in programs:
        program.process.send_signal(number)
    return sent


def wait_all(programs, since, limit_s):
    """Return how many seconds after `since` each of them ended. Fail if one had not ended after `limit_s`."""
    ended = {}
    while len(ended) < len(programs):
        took = time.monotonic() - since
        for name, program in programs.items():
            if name not in ended and program.process.poll() is not None:
                ended[name] = took
        if took > limit_s:
            raise Failed(f"after {limit_s} s there still run: {', '.join(sorted(programs.keys() - ended.keys()))}")
        time.sleep(0.01)
    print("  " + ", ".join(f"{name} {took:.2f} s" for name, took in ended.items()))
    return ended


def nothing_left(programs):
    """No program says that it ended without DDS."""
    for name, program in programs.items():
        program.reader.join(1)
        if line := next((line for _, line in program.lines if LEFT in line), None):
            raise Failed(f"{name} did not end orderly: {line}")


def check_results(stage, programs):
    """Exit codes, reports and files are those of an orderly end."""
    for name, program in programs.items():
        if program.process.returncode != 0:
            raise Failed(f"{name} ended with {program.process.returncode}: {program.lines[-3:]}")
    for name, key in (("tandemd", "frames"), ("join", "frames_applied"), ("record", "frames_recorded")):
        if name not in programs:
            continue
        text = programs[name].process.stdout.read()
        try:
            report = json.loads(text)
        except json.JSONDecodeError as error:
            raise Failed(f"{name} printed no whole report: '{text}'") from error
        if not report[key]:
            raise Failed(f"{name} reports nothing: {report}")
    folder = pathlib.Path(stage.folder)
    logs = {log.name: log.read_text() for log in folder.glob("server*")}  # one a stream; empty where nobody plays it
    if logs and not any(logs.values()):
        raise Failed("the server's hash logs are empty")
    for name, text in logs.items():
        if text and not text.endswith("\n"):
            raise Failed(f"{name} is cut")
    if (log := folder / "client").exists() and not log.read_text().endswith("\n"):
        raise Failed("the client's hash log is cut")
    if (file := folder / "second.mcap").exists() and not file.read_bytes().endswith(MCAP_END):
        raise Failed("the recording is cut")


def signalled(stage):
    """The interface goes, and then a signal comes."""
    plug_in(stage)
    programs = start_all(stage)
    pull_out()
    time.sleep(1)
    wait_all(programs, send(programs.values(), signal.SIGTERM), LIMIT_S)
    check_results(stage, programs)
    nothing_left(programs)


def by_itself(stage):
    """The interface goes, and no signal comes: the time of the programs is over."""
    plug_in(stage)
    programs = {"tandemd": stage.server(200, "--duration", 8), "join": stage.client("--seconds", 5)}
    programs["join"].wait_for("playing from frame", 30)
    time.sleep(1)
    pull_out()
    wait_all(programs, time.monotonic(), 8 + LIMIT_S)
    check_results(stage, programs)
    nothing_left(programs)


def in_place(stage):
    """The interface stays: nothing is left, also where the signal comes twice, as from timeout(1)."""
    plug_in(stage)
    programs = start_all(stage)
    began = send(programs.values(), signal.SIGTERM)
    send([program for program in programs.values() if program.process.poll() is None], signal.SIGTERM)
    wait_all(programs, began, LIMIT_S)
    check_results(stage, programs)
    nothing_left(programs)
    pull_out()


CASES = {"signalled": signalled, "by_itself": by_itself, "in_place": in_place}


def main():
    parser = arguments(__doc__)
    parser.add_argument("--gateway", type=pathlib.Path)
    options = parser.parse_args()
    return run(CASES, options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
