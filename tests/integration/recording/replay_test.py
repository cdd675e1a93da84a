#!/usr/bin/env python3
"""A session is recorded, and clients of its replay hold the same states.

replay_test.py --tandemd PATH --tandem PATH

Exit 0 passed, 1 failed.
"""

import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    f"</General><Discovery><Tag>replay-test-{os.getpid()}</Tag></Discovery></Domain></CycloneDDS>"
)
ENVIRONMENT = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
INPUTS = "".join(f"inputs {{ frame: {frame} gravity {{ x: 3 y: -9 z: 0 }} }}\n" for frame in (5, 10, 15))


class Programs:
    """The programs under test, in a folder for their files."""

    def __init__(self, options, folder):
        self.tandemd, self.tandem, self.folder = options.tandemd, options.tandem, pathlib.Path(folder)

    def start(self, *arguments):
        return subprocess.Popen(
            list(map(str, arguments)), env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def join(self, name, *arguments):
        log = self.folder / f"{name}.csv"
        return self.start(self.tandem, "join", "--timeout", 60, "--json", "--hash-log", log, *arguments)

    def hashes(self, name):
        """By frame."""
        lines = (self.folder / f"{name}.csv").read_text(encoding="utf-8").split()
        return {int(frame): value for _, frame, value in (line.split(",") for line in lines)}


def finish(process, what, code=0):
    out, errors = process.communicate(timeout=120)
    assert process.returncode == code, f"{what}: exit {process.returncode}: {errors[-800:]}"
    return out, errors


def record(programs):
    """Six seconds of a session with scripted gravity."""
    file = programs.folder / "session.mcap"
    server = programs.start(programs.tandemd, "--scene", "half_pipe", "--bodies", 500, "--scripted", "--rate", 60,
                            "--predictor", "field")  # fmt: skip
    try:
        recorder = programs.start(
            programs.tandem, "record", file, "--timeout", 60, "--seconds", 6, "--json",
            "--hash-log", programs.folder / "recorded.csv",
        )  # fmt: skip
        report = json.loads(finish(recorder, "record")[0])
    finally:
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=60)
    assert report["frames_recorded"] == report["frames_applied"] == len(programs.hashes("recorded")), report
    assert report["file_bytes"] == file.stat().st_size
    assert report["topics"]["TandemDelta"]["messages"] == report["frames_recorded"]
    print(f"recorded {report['frames_recorded']} frames", flush=True)
    return file


def expect_same(programs, name, truth, least):
    found = programs.hashes(name)
    assert len(found) >= least, f"{name}: only {len(found)} frames"
    assert found.items() <= truth.items(), f"{name} holds other states than were recorded"
    assert sorted(found) == list(range(min(found), max(found) + 1)), f"{name} has gaps"
    print(f"{name}: frames {min(found)} to {max(found)} agree", flush=True)
    return found


def check_whole(programs, file, truth):
    """A participant plays from the first frame on and its inputs are refused; another one comes late."""
    script = programs.folder / "inputs.textproto"
    script.write_text(INPUTS, encoding="utf-8")
    first = programs.join("first", "--input-script", script, "--seconds", 4)
    replay = programs.start(programs.tandem, "replay", file, "--wait-for", 1)
    late = programs.join("late", "--observe", "--seconds", 2)
    report = json.loads(finish(first, "the first client")[0])
    finish(late, "the late client")
    finish(replay, "replay")
    assert report["hash_mismatches"] == 0 and report["resyncs"] == 0, report
    assert report["inputs_sent"] == report["inputs_refused"] == 3 and report["inputs_acted"] == 0, report
    found = expect_same(programs, "first", truth, 100)
    assert min(found) == min(truth), "the first frame is not there"
    expect_same(programs, "late", truth, 20)


def check_jump(programs, file, truth):
    """From the middle, at half the rate."""
    client = programs.join("jumped", "--observe", "--seconds", 1)
    replay = programs.start(programs.tandem, "replay", file, "--from", 2, "--rate", 0.5)
    finish(client, "the client of a jump")
    replay.send_signal(signal.SIGINT)
    finish(replay, "replay")
    found = expect_same(programs, "jumped", truth, 5)
    assert min(found) > min(truth) + 60, f"from frame {min(found)}"


def epochs_of(programs, name):
    """By epoch, in order: its frames."""
    epochs = {}
    for line in (programs.folder / f"{name}.csv").read_text(encoding="utf-8").split():
        epoch, frame, _ = line.split(",")
        epochs.setdefault(int(epoch), []).append(int(frame))
    return [epochs[epoch] for epoch in sorted(epochs)]


def expect_epochs(programs, name, truth, count):
    """The states of each are those recorded, and no frame is missing."""
    for line in (programs.folder / f"{name}.csv").read_text(encoding="utf-8").split():
        _, frame, value = line.split(",")
        assert truth[int(frame)] == value, f"{name}: frame {frame} is another"
    epochs = epochs_of(programs, name)
    assert len(epochs) >= count, f"{name}: {len(epochs)} epochs"
    for frames in epochs:
        assert frames == list(range(frames[0], frames[-1] + 1)), f"{name} has gaps"
    print(f"{name}: epochs from frames {[frames[0] for frames in epochs]} agree", flush=True)
    return epochs


def check_seek(programs, file, truth):
    """A participant goes forward, back, and where there is nothing; an observer follows."""
    script = programs.folder / "seeks.textproto"
    script.write_text(
        "inputs { frame: 60 seek_s: 4 } inputs { frame: 130 seek_s: 1 } inputs { frame: 150 seek_s: 1e5 }", encoding="utf-8"
    )
    seeker = programs.join("seeker", "--input-script", script, "--seconds", 8)
    watcher = programs.join("watcher", "--observe", "--seconds", 8)
    replay = programs.start(programs.tandem, "replay", file, "--wait-for", 1)
    report = json.loads(finish(seeker, "the seeking client")[0])
    finish(watcher, "the watching client")
    replay.send_signal(signal.SIGINT)
    finish(replay, "replay")
    assert report["hash_mismatches"] == 0 and report["inputs_sent"] == 3 and report["inputs_refused"] == 1, report
    first, forward, back = expect_epochs(programs, "seeker", truth, 3)[:3]
    assert min(truth) == first[0] < back[0] < forward[0], (first[0], back[0], forward[0])
    expect_epochs(programs, "watcher", truth, 2)


def check_end(programs, file, truth):
    """After a seek to the end the replay stays there with its clients, and does not wait for participants again."""
    script = programs.folder / "to_end.textproto"
    script.write_text("inputs { frame: 30 seek_s: 5.7 }", encoding="utf-8")
    replay = programs.start(programs.tandem, "replay", file, "--wait-for", 2)
    watcher = programs.join("stays", "--seconds", 600)
    finish(programs.join("to_end", "--input-script", script, "--seconds", 4), "the client that seeks the end")
    assert replay.poll() is None, replay.communicate()[1]
    (session,) = json.loads(finish(programs.start(programs.tandem, "top", "--once", "--json"), "top")[0])["sessions"]
    assert session["frame"] == max(truth), session
    for process, what in ((watcher, "the client that stays"), (replay, "replay")):
        process.send_signal(signal.SIGINT)
        finish(process, what)
    _, to_end = expect_epochs(programs, "stays", truth, 2)
    assert to_end[-1] == max(truth), to_end


def check_loop(programs, file, truth):
    """Twice round, beside `tandem top`."""
    client = programs.join("rounds", "--seconds", 5)
    replay = programs.start(programs.tandem, "replay", file, "--from", 4.5, "--loop", "--wait-for", 1)
    seen = json.loads(finish(programs.start(programs.tandem, "top", "--once", "--json"), "top")[0])
    finish(client, "the client of two rounds")
    replay.send_signal(signal.SIGINT)
    finish(replay, "replay")
    rounds = expect_epochs(programs, "rounds", truth, 2)
    # The replay does not wait again: the second round goes on while the client joins.
    assert min(truth) < rounds[0][0] <= rounds[1][0] < rounds[0][-1], rounds
    assert [each["session"] for each in seen["sessions"]] == ["default"], seen


def check_torn(programs, file, truth):
    """A file cut in the middle of its deltas."""
    torn = programs.folder / "torn.mcap"
    # Behind the last chunk stands the summary, with nine copies of the types.
    torn.write_bytes(file.read_bytes()[: file.stat().st_size - 9 * 7000])
    client = programs.join("torn", "--seconds", 1)
    replay = programs.start(programs.tandem, "replay", torn, "--wait-for", 1)
    finish(client, "the client of a torn file")
    _, errors = finish(replay, "replay")
    assert "cut short at byte" in errors, errors
    expect_same(programs, "torn", truth, 10)


def check_export(programs, file, truth):
    """The states as a trajectory, which a bench takes with the recorded scene's predictor."""
    npy = programs.folder / "states.npy"
    finish(programs.start(programs.tandem, "export", "--from", file, "--out", npy), "export")
    assert f"({len(truth) + 1}, 500, 6)".encode() in npy.read_bytes()[:128], npy.read_bytes()[:128]
    bench = programs.start(
        programs.tandem, "bench", "bandwidth", "--trajectory", npy, "--frames", len(truth),
        "--codec", "tracker", "--predictor", "field", "--json",
    )  # fmt: skip
    row = json.loads(finish(bench, "bench")[0])["rows"][0]
    assert row["predictor"] == "field" and row["bodies"] == 500, row
    print(f"exported {len(truth)} frames, measured at {row['mbit_per_s']:.3f} Mbit/s", flush=True)


def check_refusals(programs, file):
    bad = programs.folder / "bad.mcap"
    whole = file.read_bytes()
    for content, said in (
        (b"", "not an MCAP file"),
        (b"no recording at all", "not an MCAP file"),
        (whole[:5] + b"1" + whole[6:], "another version"),
        (whole[:60], "no snapshot to begin from"),
    ):
        bad.write_bytes(content)
        _, errors = finish(programs.start(programs.tandem, "replay", bad), "replay", 1)
        lines = [line for line in errors.splitlines() if "cut short" not in line]
        assert len(lines) == 1 and said in lines[0], errors
    # This file is from a program that spoke version 1 of the protocol.
    old = pathlib.Path(__file__).parent / "version1.mcap"
    npy = programs.folder / "old.npy"
    for command in (("replay", old), ("export", "--from", old, "--out", npy), ("export", "--from", old, "--points", npy)):
        _, errors = finish(programs.start(programs.tandem, *command), command[0], 1)
        assert len(errors.splitlines()) == 1, errors
        for said in ("version1.mcap: ", "recorded with protocol version 1", "reads version 4"):
            assert said in errors, errors
        assert not npy.exists(), "a file of a recording that cannot be read"
    _, errors = finish(programs.start(programs.tandem, "replay", programs.folder / "none.mcap"), "replay", 1)
    assert "No such file" in errors, errors
    _, errors = finish(programs.start(programs.tandem, "replay", file, "--from", 1000), "replay", 1)
    assert "no frame at 1000.0 s or later" in errors, errors


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--tandemd", "--tandem"):
        parser.add_argument(option, type=pathlib.Path, required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(options, folder)
        try:
            file = record(programs)
            truth = programs.hashes("recorded")
            check_whole(programs, file, truth)
            check_jump(programs, file, truth)
            check_seek(programs, file, truth)
            check_end(programs, file, truth)
            check_loop(programs, file, truth)
            check_torn(programs, file, truth)
            check_export(programs, file, truth)
            check_refusals(programs, file)
        except (AssertionError, subprocess.SubprocessError) as failure:
            print(f"FAILED: {failure}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
