#!/usr/bin/env python3
"""Faults that recordings meet with in operation: two writers, signals, a full disk, files that shrink or are not regular; the log.

faults_test.py --tandemd PATH --tandem PATH

Exit 0 passed, 1 failed.
"""

import argparse
import json
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time

LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    f"</General><Discovery><Tag>faults-test-{os.getpid()}</Tag></Discovery></Domain></CycloneDDS>"
)
ENVIRONMENT = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
MAGIC = b"\x89MCAP0\r\n"
LIMIT_S = 60  # of any one wait; a busy machine is slow


class Programs:
    """The programs under test, in a folder for their files."""

    def __init__(self, options, folder):
        self.tandemd, self.tandem, self.folder = options.tandemd, options.tandem, pathlib.Path(folder)

    def start(self, *arguments, **more):
        return subprocess.Popen(
            list(map(str, arguments)), env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more
        )

    def tool(self, *arguments, **more):
        return self.start(self.tandem, *arguments, **more)

    def rows(self, recording):
        """The states that an export finds."""
        npy = self.folder / "rows.npy"
        finish(self.tool("export", "--from", recording, "--out", npy, "--overwrite"), "export")
        return int(re.search(rb"\((\d+), ", npy.read_bytes()[:128]).group(1))


def finish(process, what, code=0):
    out, errors = process.communicate(timeout=LIMIT_S)
    assert process.returncode == code, f"{what}: exit {process.returncode}, not {code}: {errors[-800:]}"
    return out, errors


def wait_for(condition, what):
    deadline = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < deadline, f"{what}: not within {LIMIT_S} s"
        time.sleep(0.02)


def refusal(process, what):
    """The one line in which a program says why it ends; lines about the way into a session do not count."""
    _, errors = finish(process, what, 1)
    lines = [line for line in errors.splitlines() if not re.search(r"waiting |found session|stream \w+ \(|playing from", line)]
    assert len(lines) == 1, f"{what}: {errors}"
    return lines[0]


def check_two_writers(programs):
    """Both spellings of a path and both commands: the second is told who writes, and the first has all its frames."""
    file = programs.folder / "one.mcap"
    (programs.folder / "way").symlink_to(".")
    spellings = (programs.folder / "way" / "one.mcap", f"{file.parent}/./one.mcap")

    def expect_refusals(writer):
        for command in (("record", spellings[0]), ("join", "--observe", "--capture", spellings[1])):
            said = refusal(programs.tool(*command, "--timeout", 5, "--hash-log", programs.folder / "kept.csv"), "the second")
            assert f"process {writer.pid} is writing it" in said, said
        print(f"two writers: {said}", flush=True)

    waiting = programs.tool("record", file, "--session", "nowhere")
    wait_for(pathlib.Path(f"{file}.part").exists, "the .part")
    expect_refusals(waiting)
    waiting.send_signal(signal.SIGINT)
    finish(waiting, "the one that waits", 1)
    first = programs.tool("record", file, "--timeout", LIMIT_S, "--json")
    wait_for(file.exists, "the recording")
    expect_refusals(first)
    assert not (programs.folder / "kept.csv").exists(), "a recorder that was refused writes no log"
    assert not (programs.folder / "one.mcap.part").exists()
    first.send_signal(signal.SIGINT)
    report = json.loads(finish(first, "the first")[0])
    assert report["frames_recorded"] > 0 and file.read_bytes().endswith(MAGIC)
    assert programs.rows(file) == report["frames_recorded"] + 1, report
    return file


def check_starting_writers(programs):
    """Several at once: one records, and nothing of it is lost."""
    file = programs.folder / "race.mcap"
    racers = [programs.tool("record", file, "--timeout", LIMIT_S, "--seconds", 2, "--json") for _ in range(4)]
    ends = [(racer.communicate(timeout=LIMIT_S), racer.returncode) for racer in racers]
    won = [json.loads(out) for (out, _), code in ends if code == 0]
    assert len(won) == 1 and sorted(code for _, code in ends) == [0, 1, 1, 1], ends
    assert programs.rows(file) == won[0]["frames_recorded"] + 1, won
    print(f"four writers at once: one recorded {won[0]['frames_recorded']} frames", flush=True)


def check_started_again(programs):
    """A recorder that its supervisor starts again leaves what is there, and says so; --overwrite replaces it. Its log goes on."""
    file, log = programs.folder / "world.mcap", programs.folder / "world.csv"
    command = ("record", file, "--timeout", LIMIT_S, "--seconds", 0.3, "--json", "--hash-log", log)
    killed = programs.tool("record", file, "--timeout", LIMIT_S)
    wait_for(file.exists, "the recording")
    killed.kill()
    killed.communicate()
    first = file.read_bytes()
    log.write_text("of an earlier run\n")
    out, errors = finish(programs.tool(*command), "started again")
    report = json.loads(out)
    assert report["file"] == str(programs.folder / "world-2.mcap"), report["file"]
    said = [line for line in errors.splitlines() if "exists and stays" in line]
    assert len(said) == 1 and said[0].endswith(f"world.mcap exists and stays; this recording becomes {report['file']}"), errors
    assert programs.rows(report["file"]) == report["frames_recorded"] + 1, report
    lines = log.read_text().splitlines()
    assert lines[0] == "of an earlier run" and len(lines) == 1 + report["frames_recorded"], len(lines)
    assert file.read_bytes() == first, "the earlier recording is another one"
    said = refusal(programs.tool("export", "--from", file, "--points", programs.folder / "world-2.mcap"), "an export onto a file")
    assert said.endswith("world-2.mcap: exists; --overwrite replaces it"), said
    out, errors = finish(programs.tool(*command, "--overwrite"), "--overwrite")
    assert json.loads(out)["file"] == str(file) and "stays" not in errors, errors
    assert file.read_bytes() != first
    print(f"started again: {said}", flush=True)


def check_signals(programs):
    """A recorder ends its file properly, or leaves none."""
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        empty = programs.folder / "empty.mcap"
        waiting = programs.tool("record", empty, "--session", "nowhere")
        wait_for(pathlib.Path(f"{empty}.part").exists, "the .part")
        waiting.send_signal(number)
        finish(waiting, f"{number.name} while waiting", 1)
        assert not list(programs.folder.glob("empty.mcap*")), f"{number.name} left a file"
        file = programs.folder / f"{number.name}.mcap"
        recorder = programs.tool("record", file, "--timeout", LIMIT_S, "--json")
        wait_for(file.exists, "the recording")
        time.sleep(0.5)
        recorder.send_signal(number)
        report = json.loads(finish(recorder, number.name)[0])
        assert file.read_bytes().endswith(MAGIC), f"{number.name}: the file has no end"
        assert programs.rows(file) == report["frames_recorded"] + 1, report
        assert not list(programs.folder.glob("*.part"))
    exported = programs.folder / "long.npy"
    export = programs.tool("export", "--scene", "half_pipe", "--bodies", 2000, "--frames", 100000, "--out", exported)
    wait_for(pathlib.Path(f"{exported}.part").exists, "the .part of the export")
    export.send_signal(signal.SIGTERM)
    finish(export, "a stopped export", 1)
    assert not list(programs.folder.glob("long*")), "a stopped export left a file"
    print("signals: files are complete, or there is none", flush=True)


def check_full_disk(programs):
    """A file that may not grow further: one line, and what was written is readable."""
    file = programs.folder / "full.mcap"

    def limited(size_bytes):
        return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, size_bytes))

    said = refusal(programs.tool("record", file, "--timeout", LIMIT_S, preexec_fn=limited(150_000)), "a full disk")
    assert said.endswith("full.mcap: cannot write: File too large"), said
    assert file.stat().st_size <= 150_000
    rows = programs.rows(file)
    assert rows > 1, rows
    print(f"full disk: {said}; {rows} states are readable", flush=True)
    said = refusal(programs.tool("record", programs.folder / "none.mcap", "--timeout", LIMIT_S, preexec_fn=limited(1000)), "no disk")
    assert said.endswith("none.mcap: cannot write: File too large"), said
    assert not list(programs.folder.glob("none.mcap*"))
    said = refusal(programs.tool("record", "/dev/full", "--timeout", LIMIT_S), "a device")
    assert "no regular file" in said, said


def check_logs(programs):
    """Recorder and replay log as the daemons do: one object a line, with the session and the epoch that they learn."""
    keys = {"time", "level", "program", "session", "epoch", "message"}

    def lines(process, what, code=0):
        return [json.loads(line) for line in finish(process, what, code)[1].splitlines()]

    file, json_log = programs.folder / "logged.mcap", ("--log-format", "json")
    recorded = lines(programs.tool("record", file, "--timeout", LIMIT_S, "--seconds", 1, *json_log), "a recorder")
    assert recorded and all(set(line) == keys for line in recorded), recorded
    assert {(line["program"], line["session"], line["level"]) for line in recorded} == {("tandem record", "default", "info")}, recorded
    assert recorded[-1]["epoch"] > 0, recorded
    quiet = programs.tool("record", programs.folder / "quiet.mcap", "--timeout", LIMIT_S, "--seconds", 0.1, "--log-level", "warning")
    assert finish(quiet, "a quiet recorder")[1] == ""
    refused = lines(programs.tool("record", programs.folder, *json_log), "a recorder of a folder", 1)
    assert [line["level"] for line in refused] == ["error"], refused
    torn = programs.folder / "torn.mcap"
    torn.write_bytes(file.read_bytes()[:-200])
    replayed = lines(programs.tool("replay", torn, "--session", "again", "--rate", 10, *json_log), "a replay")
    assert all(set(line) == keys and line["program"] == "tandem replay" and line["session"] == "again" for line in replayed), replayed
    assert replayed[0]["level"] == "warning" and "cut short" in replayed[0]["message"], replayed
    assert any(line["epoch"] > 0 for line in replayed), replayed
    print(f"logs: {len(recorded)} lines of a recorder, {len(replayed)} of a replay", flush=True)


def check_no_files(programs):
    """A file that is not a regular one is refused at once, and not waited for."""
    fifo, bound = programs.folder / "fifo", programs.folder / "socket"
    os.mkfifo(fifo)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(bound))
    for path, kind in ((fifo, "a FIFO"), (bound, "a socket"), (programs.folder, "a directory"), ("/dev/zero", "a device")):
        for command in (("replay", path), ("export", "--from", path, "--out", programs.folder / "x.npy")):
            said = refusal(programs.tool(*command), f"{command[0]} of {kind}")
            assert said.endswith(f"{path}: cannot read: it is {kind}, and no regular file"), said
    listener.close()
    print("what is no regular file is refused", flush=True)


def check_shrinking(programs, file):
    """A replay of a file that another program cuts shorter ends with an error, not by SIGBUS."""
    shrinking = programs.folder / "shrinking.mcap"
    whole = file.read_bytes()
    shrinking.write_bytes(whole)
    replay = programs.tool("replay", shrinking, "--rate", 0.5)
    wait_for(lambda: "from frame" in replay.stderr.readline(), "the replay")
    os.truncate(shrinking, 1000)
    _, errors = finish(replay, "a replay of a file that shrinks", 1)
    assert "shrinking.mcap: it became shorter while it was read" in errors, errors
    print(f"shrinking: {errors.strip()}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--tandemd", "--tandem"):
        parser.add_argument(option, type=pathlib.Path, required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(options, folder)
        server = programs.start(options.tandemd, "--scene", "half_pipe", "--bodies", 500, "--scripted", "--rate", 60)
        try:
            file = check_two_writers(programs)
            check_starting_writers(programs)
            check_started_again(programs)
            check_signals(programs)
            check_full_disk(programs)
            check_logs(programs)
            check_no_files(programs)
        except (AssertionError, subprocess.SubprocessError) as failure:
            print(f"FAILED: {failure}", file=sys.stderr)
            return 1
        finally:
            server.send_signal(signal.SIGINT)
            server.communicate(timeout=LIMIT_S)
        try:
            check_shrinking(programs, file)
        except (AssertionError, subprocess.SubprocessError) as failure:
            print(f"FAILED: {failure}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
