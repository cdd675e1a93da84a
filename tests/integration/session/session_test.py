#!/usr/bin/env python3
"""One tandemd and several `tandem join` processes over loopback DDS; their hash logs are compared frame by frame.

session_test.py SCENARIO --tandemd PATH --tandem PATH        Standard library only. Exit 0 passed, 1 failed.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

from stage import LIMIT_S, Failed, Stage, check_capture, check_report, compare
from standbys import hung_server_is_replaced, standby_takes_over


def two_thousand_frames(stage):
    """1 server, 5 clients with inputs; one is killed, one is frozen, one comes late: all hold the server's state."""
    stage.server("server", "--rate", 60, "--wait-for", 3)
    for i in range(3):
        script = stage.script(f"script{i}", i, 60, 0.4 + 0.1 * i)
        stage.client(f"participant{i}", "--input-script", script)
    stage.client("observer", "--observe", "--lead", 0, "--capture", stage.folder / "capture.mcap")
    stage.wait_live(["participant0", "participant1", "participant2", "observer"],
                    lambda live: live.get("frame", 0) > 200, "frame 200")  # fmt: skip
    stage.kill("participant1")
    stage.client("late")
    stage.wait_live(["late"], lambda live: live.get("frame", 0) > 400, "the late client")
    stage.processes["participant2"].send_signal(signal.SIGSTOP)
    time.sleep(1.5)
    stage.processes["participant2"].send_signal(signal.SIGCONT)
    everybody = ["participant0", "participant2", "observer", "late"]
    stage.wait_live(everybody, lambda live: live.get("frame", 0) >= 2000, "frame 2000")
    reports = {name: stage.stop(name) for name in everybody}
    server = stage.stop("server")
    if server["frames"] < 2000:
        raise Failed(f"the server ran {server['frames']} frames")
    for name, report in reports.items():
        check_report(report, ["inputs_sent", "inputs_acted"] if name == "participant0" else [])
        compare(stage, ["server"], name, 1000, report["resyncs"])
        print(f"  joined in {report['join_ms']:.0f} ms, latency {report['latency_ms']}, client {report['client_ms']}")
    compare(stage, ["server"], "participant1", 100)
    check_capture(stage.folder / "capture.mcap", stage.hashes("observer"))
    if stage.hashes("observer").get((list(stage.hashes("server"))[0][0], 300)) is None:
        raise Failed("the observer missed frame 300")


def server_restart(stage):
    """The server is killed and started again: clients play again by themselves, with nothing of the old epoch."""
    stage.server("before")
    stage.client("alone")
    stage.client("crowd", "--count", 4, "--hash-log", stage.log("crowd"))
    stage.wait_live(["alone", "crowd"], lambda live: live.get("frame", 0) > 60, "frame 60")
    stage.kill("before")
    stage.server("after")
    stage.wait(lambda: len({epoch for epoch, _ in stage.hashes("after")}) > 0, "the new server's first frames")
    new_epoch = next(iter(stage.hashes("after")))[0]
    if any(epoch == new_epoch for epoch, _ in stage.hashes("before")):
        raise Failed("both runs have one epoch")
    time.sleep(8)
    reports = {"alone": stage.stop("alone")}
    crowd = stage.stop("crowd")["clients"]
    stage.stop("after")
    if len(crowd) != 4:
        raise Failed(f"{len(crowd)} clients reported, not 4")
    reports.update({f"crowd.{i}": report for i, report in enumerate(crowd)})
    for name, report in reports.items():
        check_report(report)
        if name != "alone":
            (stage.folder / f"crowd.hashes.{name[-1]}").rename(stage.log(name))
        compare(stage, ["before", "after"], name, 60, report["resyncs"])
        frames = sum(1 for epoch, _ in stage.hashes(name) if epoch == new_epoch)
        if frames < 30:
            raise Failed(f"{name} applied {frames} frames of the new run")


def hundred_thousand_bodies(stage):
    """100,000 bodies that meet each other, predicted on two threads: clients of one thread hold the server's state."""
    crowd = ("--predictor", "field", "--threads", 2, "--stall-timeout", "off", "--wait-for", 1)
    stage.server("server", *crowd, bodies=100_000)
    stage.client("participant", "--input-script", stage.script("script", 1, 60, 0.5))
    stage.wait_live(["participant"], lambda live: live.get("frame", 0) > 20, "frame 20")
    stage.client("observer", "--observe", "--lead", 0)
    everybody = ["participant", "observer"]
    stage.wait_live(everybody, lambda live: live.get("frame", 0) > 160, "frame 160")
    reports = {name: stage.stop(name) for name in everybody}
    stage.stop("server")
    for name, report in reports.items():
        check_report(report)
        compare(stage, ["server"], name, 100, report["resyncs"])


def killed_server_starts_again_at_once(stage):
    """The announcement of a server that was killed keeps nobody out, not even while DDS still counts its writer as alive."""
    dice = random.Random(os.getpid())
    print(f"seed {os.getpid()}", flush=True)
    stage.client("watcher", "--observe")  # knows the dead ones
    for i in range(8):
        name = f"life{i}"
        stage.server(name)
        stage.wait(lambda: stage.hashes(name) or stage.processes[name].poll() is not None, "a frame")  # noqa: B023
        if stage.processes[name].poll() is not None:
            raise Failed(f"server {i} ended with {stage.processes[name].returncode}")
        time.sleep(dice.uniform(0, 1.5))
        stage.kill(name)
        time.sleep(dice.choice((0, 0.1, 0.3, 0.6)))
    stage.server("last")
    stage.wait_live(["watcher"], lambda live: live.get("frame", 0) > 30, "frame 30")
    stage.wait(lambda: stage.hashes("last"), "a frame of the last server")
    check_report(stage.stop("watcher"))
    stage.stop("last")


def killed_server_goes_on(stage):
    """The server is killed and goes on from its checkpoint: at most 1 s of the world is lost, and all play within 3 s."""
    folder = stage.folder / "checkpoints"
    keeps = ("--checkpoint-dir", folder)
    bodies = 10000
    stage.server("first", *keeps, "--scripted", scene="half_pipe", bodies=bodies)
    stage.client("participant", "--input-script", stage.script("script", 1, 200, 0.1))
    stage.client("observer", "--observe")
    everybody = ["participant", "observer"]
    stage.wait_live(everybody, lambda live: live.get("frame", 0) > 150, "frame 150")
    lives = ["first"]
    for name in ("second", "third"):
        stage.kill(lives[-1])
        newest = sorted(folder.glob("*.checkpoint"))[-1]
        if name == "third":  # a power failure on a disk that lies
            os.truncate(newest, 1000)
        began = time.monotonic()
        stage.server(name, *keeps, "--checkpoint", "require", "--scripted", scene="half_pipe", bodies=bodies)
        stage.wait(lambda: stage.hashes(name), "the first frame of the new epoch")  # noqa: B023
        epoch, frame = next(iter(stage.hashes(name)))
        before, last = max(stage.hashes(lives[-1]))
        told = stage.folder / f"{name}.err"
        stage.wait(lambda: told.read_text().count(" plays as ") == len(everybody), "all playing")  # noqa: B023
        took_s = time.monotonic() - began
        print(f"{name}: {last - frame} frames lost, all play after {took_s:.2f} s", flush=True)
        if epoch <= before:
            raise Failed(f"epoch {epoch} is not above {before}")
        if not 0 <= last - frame <= (30 if name == "second" else 61):
            raise Failed(f"frame {last} was published, and {name} goes on from frame {frame}")
        if took_s > 3:
            raise Failed(f"all play {took_s:.1f} s after the start of {name}")
        said = told.read_text()
        if "goes on from" not in said or (name == "third") != (f"{newest}: it says that it has" in said):
            raise Failed(f"{name} does not say from which file it goes on, or which it cannot use: {said}")
        lives.append(name)
        stage.wait_live(everybody, lambda live: live.get("frame", 0) > frame + 90, "three more seconds")  # noqa: B023
    reports = {name: stage.stop(name) for name in everybody}
    report = stage.stop("third")["checkpoint"]
    for name in everybody:
        check_report(reports[name])
        compare(stage, lives, name, 200, reports[name]["resyncs"])
    if not report["written"] or report["failed"] or report["age_s"] > 1:
        raise Failed(f"the figures of the last server are wrong: {report}")
    kept = sorted(folder.iterdir())
    if len(kept) > 4:  # three, and the one that was cut short
        raise Failed(f"too many files are kept: {kept}")
    print(f"  {report['bytes'] / bodies:.1f} bytes a body, {report}", flush=True)


def checkpoint_refusals(stage):
    """Two servers of one folder, no checkpoint where one is required, a folder that vanishes; what the tool says of files."""

    def run(code, *command):
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, env=stage.environment,
                              timeout=LIMIT_S, check=False)  # fmt: skip
        if done.returncode != code:
            raise Failed(f"{command} ended with {done.returncode}, not {code}: {done.stderr}")
        return done

    def server(code, folder, *arguments, bodies=50):
        command = (stage.options.tandemd, "--scene", "half_pipe", "--bodies", bodies, "--duration", 0.5, *stage.common)
        return run(code, *command, "--checkpoint-dir", folder, *arguments).stderr

    parent = stage.folder / "parent"
    parent.mkdir()
    folder = parent / "checkpoints"
    said = server(1, folder, "--checkpoint", "require")
    if f"{folder}: no checkpoint to go on from" not in said:
        raise Failed(f"require says: {said}")
    if "starts afresh" not in server(0, folder):
        raise Failed("auto does not say that it starts afresh")
    file = sorted(folder.glob("*.checkpoint"))[-1]
    shown = json.loads(run(0, stage.options.tandem, "checkpoint", "show", file, "--json").stdout)
    if (shown["session"], shown["scene"], shown["engine"], shown["capacity"]) != ("default", "half_pipe", "particles", 50):
        raise Failed(f"show says {shown}")
    run(0, stage.options.tandem, "checkpoint", "verify", file)
    torn = parent / "torn.checkpoint"
    torn.write_bytes(file.read_bytes()[:-1])
    if "torn.checkpoint: it says that it has" not in run(1, stage.options.tandem, "checkpoint", "verify", torn).stderr:
        raise Failed("verify does not say why")
    for other, bodies, reason in (
        (("--session", "other"), 50, "it is of session 'default', not 'other'"),
        ((), 60, "it has 50 slots, not 60"),
        (("--seed", 2), 50, "the engine refuses its part"),
    ):
        said = server(1, folder, "--checkpoint", "require", *other, bodies=bodies)
        if f"{file}: {reason}" not in said:
            raise Failed(f"{other}: {said}")
    for _ in range(2):  # a mistake that is made twice must not cost the world
        server(0, folder, "--seed", 2)
    if not file.exists() or len(list(folder.glob("*.checkpoint"))) > 6:
        raise Failed(f"after two starts with another seed there are {sorted(folder.iterdir())}")
    run(2, stage.options.tandem, "checkpoint", "show")
    run(2, stage.options.tandemd, "--scene", "cube", "--bodies", 5, "--checkpoint", "require")
    run(2, stage.options.tandemd, "--scene", "cube", "--bodies", 5, "--checkpoint-dir", folder, "--checkpoint-interval", 0)
    server(1, parent / "no" / "such")

    stage.server("first", "--checkpoint-dir", folder, "--checkpoint-interval", 0.2)
    stage.wait(lambda: len(stage.hashes("first")) > 20, "20 frames")
    said = server(1, folder, "--session", "other")
    if f"{folder}: process {stage.processes['first'].pid} keeps its checkpoints there" not in said:
        raise Failed(f"the second server of a folder is told: {said}")
    parent.rename(stage.folder / "elsewhere")
    before = len(stage.hashes("first"))
    stage.wait(lambda: len(stage.hashes("first")) > before + 60, "60 frames without the folder")
    said = (stage.folder / "first.err").read_text()
    if said.count("No such file or directory; the world goes on") != 1:
        raise Failed(f"a folder that vanished is told: {said}")
    if stage.stop("first")["checkpoint"]["failed"] == 0:
        raise Failed("no checkpoint failed")


def rigid(stage):
    """Bodies of Bullet that turn, poked and tilted: a late joiner, a server that is killed; the reference decoder follows."""
    script = stage.folder / "tilts.textproto"
    dice = random.Random(7)
    with open(script, "w", encoding="ascii") as out:
        for i in range(80):
            x, z = dice.uniform(-2, 2), dice.uniform(-2, 2)
            out.write(f"inputs {{ time_s: {0.5 * (i + 1):.2f} gravity {{ x: {x:.3f} y: -9.5 z: {z:.3f} }} }}\n")
    stage.server("before", "--scripted", "--predictor", "ballistic", scene="dominoes", bodies=300)
    stage.client("participant", "--input-script", script, "--capture", stage.folder / "participant.mcap")
    stage.wait_live(["participant"], lambda live: live.get("frame", 0) > 200, "frame 200")
    stage.client("late", "--observe", "--capture", stage.folder / "late.mcap")
    stage.wait_live(["participant", "late"], lambda live: live.get("frame", 0) > 450, "frame 450")
    stage.kill("before")
    stage.server("after", "--predictor", "ballistic", scene="dominoes", bodies=300)
    stage.wait(lambda: stage.hashes("after"), "the new server's first frames")
    new_epoch = next(iter(stage.hashes("after")))[0]
    stage.wait(lambda: len([epoch for epoch, _ in stage.hashes("late") if epoch == new_epoch]) > 200, "200 new frames")
    for name, least in (("participant", 400), ("late", 200)):
        report = stage.stop(name)
        check_report(report, ["inputs_sent", "inputs_acted"] if name == "participant" else [])
        compare(stage, ["before", "after"], name, least, report["resyncs"])
        check_capture(stage.folder / f"{name}.mcap", stage.hashes(name))
    stage.stop("after")


def rigid_codecs(stage):
    """The reference decoder reproduces bodies of Bullet that turn, by the thesis's codecs and with automatic quality."""
    auto = ("--threshold", "auto", "--target-bandwidth", 0.1)
    rows = [("dominoes", codec, ()) for codec in ("entropy", "limited")]
    rows += [("rubble", codec, auto) for codec in ("tracker", "quantized")]
    for i, (scene, codec, options) in enumerate(rows):
        print(" ".join(map(str, (scene, codec, *options))), flush=True)
        file = stage.folder / f"{i}.mcap"
        stage.server(f"server{i}", "--codec", codec, *options, "--scripted", scene=scene, bodies=200)
        stage.client(f"client{i}", "--observe", "--capture", file)
        stage.wait_live([f"client{i}"], lambda live: live.get("frame", 0) > 240, "frame 240")
        check_report(stage.stop(f"client{i}"))
        stage.stop(f"server{i}")
        compare(stage, [f"server{i}"], f"client{i}", 100)
        check_capture(file, stage.hashes(f"client{i}"), changes=3 if options else 0)


def two_delays(stage):
    """A stream in two delays: who acts plays without one, who watches plays the other, on the same agreed frames."""
    stage.server("server", "--scripted", "--stream", "world:field")
    stage.client("participant", "--input-script", stage.script("tilts", 3, 40, 0.3), "--capture", stage.folder / "participant.mcap")
    stage.client("observer", "--observe", "--capture", stage.folder / "observer.mcap")
    stage.wait_live(["participant", "observer"], lambda live: live.get("frame", 0) > 300, "frame 300")
    for name in ("participant", "observer"):
        if stage.live(name)["stream"] != "world":
            raise Failed(f"{name} plays {stage.live(name)['stream']}")
        report = stage.stop(name)
        check_report(report, ["inputs_sent", "inputs_acted"] if name == "participant" else [])
        if report["resyncs"]:
            raise Failed(f"{name} joined again")
        compare(stage, ["server"], name, 200, 0)
        check_capture(stage.folder / f"{name}.mcap", stage.hashes(name))
    each, several = sorted(stage.stop("server")["streams"], key=lambda offer: offer["delay"])
    if each["messages"] < 0.9 * each["frames"] or several["messages"] > 0.6 * several["frames"]:
        raise Failed(f"the offers were told in {each} and {several}")


def no_server(stage):
    """A client without a server reports it and gives up after --timeout; a server that starts late is found."""
    stage.client("alone", "--timeout", 3, "--seconds", 1)
    stage.client("patient", "--seconds", 2)
    report = stage.end("alone", 1)
    if report["frames_applied"] != 0:
        raise Failed("frames without a server")
    for name in ("alone", "patient"):
        if "waiting for a server of session 'default'" not in (stage.folder / f"{name}.err").read_text():
            raise Failed(f"{name} does not say what it waits for")
    stage.server("server")
    check_report(stage.end("patient", 0), ["frames_applied", "join_ms"])
    for bad in (["--session", "a*"], ["--lead", "2"], ["--count", "0"], ["--seconds", "-1"], ["--no-such-flag"]):
        stage.client("usage", *bad)
        if stage.processes["usage"].wait(LIMIT_S) != 2:
            raise Failed(f"{bad} is not refused as wrong usage")
    script = stage.folder / "bad.textproto"
    script.write_text("inputs {\n  time_s: 1\n  gravity { x: nan }\n}\n", encoding="ascii")
    stage.client("usage", "--input-script", script)
    if stage.processes["usage"].wait(LIMIT_S) != 1:
        raise Failed("a script with NaN is not refused")
    said = (stage.folder / "usage.err").read_text()
    if "bad.textproto" not in said:
        raise Failed(f"the message does not name the file: {said}")


def endings(stage):
    """Exit codes of runs that are short, cannot write, or find no interface."""
    server = ("--scene", "half_pipe", "--bodies", 50, "--json")

    def run(code, *command, out=subprocess.PIPE, err=subprocess.PIPE, uri=None):
        environment = {**stage.environment, **({"CYCLONEDDS_URI": uri} if uri else {})}
        done = subprocess.run(list(map(str, command)) + stage.common, stdout=out, stderr=err, env=environment,
                              stdin=subprocess.DEVNULL, timeout=LIMIT_S, check=False)  # fmt: skip
        if done.returncode != code:
            raise Failed(f"{command} ended with {done.returncode}, not {code}: {done.stderr}")
        return done

    short = json.loads(run(0, stage.options.tandemd, *server, "--duration", 0.2).stdout)
    if not short["frames"] > 0:
        raise Failed("a duration of 0.2 s ends before the first frame")
    missing = '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="nowhere0"/></Interfaces></General></Domain></CycloneDDS>'
    run(1, stage.options.tandemd, *server, uri=missing)
    with open("/dev/full", "wb") as full:
        for error in (run(1, stage.options.tandemd, *server, "--duration", 0.2, out=full).stderr,
                      run(1, stage.options.tandem, "top", "--once", "--json", out=full).stderr):  # fmt: skip
            if b"stdout" not in error:
                raise Failed(f"a full disk is not named: {error}")
        run(1, stage.options.tandem, "join", "--count", 3, "--timeout", 1, err=full)


def emitter(stage):
    """Bodies that come and go for some minutes, a client joining every ten seconds: no mismatch, flat memory."""
    seconds = stage.options.seconds
    stage.server("server", "--scripted", scene="emitter", bodies=2000)
    stage.client("steady")
    stage.wait_live(["steady"], lambda live: live.get("frame", 0) > 30, "frame 30")
    begun, visitors, memory = time.monotonic(), [], {"server": [], "steady": []}
    while time.monotonic() - begun < seconds:
        name = f"visitor{len(visitors)}"
        visitors.append(name)
        stage.client(name, *(["--observe"] if len(visitors) % 2 else []), "--seconds", 15)
        time.sleep(max(0, begun + 10 * len(visitors) - time.monotonic()))
        for process, sizes in memory.items():
            sizes.append(stage.resident_kb(process))
        print(f"{time.monotonic() - begun:4.0f} s: {len(visitors)} clients came, resident KiB: "
              + ", ".join(f"{process} {sizes[-1]}" for process, sizes in memory.items()), flush=True)  # fmt: skip
    for name in visitors:
        check_report(stage.end(name), ["frames_applied", "join_ms"])
    report = stage.stop("steady")
    check_report(report)
    stage.stop("server")
    compare(stage, ["server"], "steady", 25 * seconds, report["resyncs"])
    for name in visitors:
        compare(stage, ["server"], name, 300)
    for process, sizes in memory.items():
        # The first minute fills all bounded memory: histories, buffers of hash logs, tables of clients.
        settled = max(sizes[: max(1, min(6, len(sizes) // 2))])
        if max(sizes) > settled + MEMORY_SLACK_KB:
            raise Failed(f"{process} grew from {settled} to {max(sizes)} KiB")


def reference(stage):
    """500 frames of every codec and predictor, and of bodies that come and go, through the reference decoder."""
    paper = ["none", "selective", "quantized", "entropy", "limited"]
    rows = [("half_pipe", 300, codec, "ballistic") for codec in paper]
    rows += [("half_pipe_3", 300, codec, predictor) for codec in ("entropy", "tracker") for predictor in ("field", "contact")]
    rows += [("four_cubes", 300, "tracker", "ballistic")]
    rows += [("emitter", 400, codec, predictor) for codec, predictor in (("entropy", "ballistic"), ("tracker", "field"))]
    for i, (scene, bodies, codec, predictor) in enumerate(rows):
        print(f"{scene}, {bodies} bodies, {codec}, {predictor}:", flush=True)
        file = stage.folder / f"{i}.mcap"
        stage.server(f"server{i}", "--codec", codec, "--predictor", predictor, "--rate", 90, "--scripted",
                     scene=scene, bodies=bodies)  # fmt: skip
        stage.client(f"client{i}", "--seconds", 7, "--capture", file)
        check_report(stage.end(f"client{i}"))
        stage.stop(f"server{i}")
        compare(stage, [f"server{i}"], f"client{i}", 500)
        check_capture(file, stage.hashes(f"client{i}"))


# Accounts of up to 256 clients (1.1 KB each), and what was reserved at the start but is written to only later: a server of
# 2,000 bodies reserves 5 MB.
MEMORY_SLACK_KB = 4096
SCENARIOS = {
    f.__name__: f
    for f in (two_thousand_frames, hundred_thousand_bodies, server_restart, killed_server_starts_again_at_once, killed_server_goes_on, standby_takes_over, hung_server_is_replaced, checkpoint_refusals, rigid, rigid_codecs, two_delays,
              no_server, endings, emitter, reference)  # fmt: skip
}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", choices=SCENARIOS)
    parser.add_argument("--tandemd", required=True)
    parser.add_argument("--tandem", required=True)
    parser.add_argument("--seconds", type=int, default=600, help="length of the scenario `emitter`")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        try:
            with Stage(options, folder) as stage:
                SCENARIOS[options.scenario](stage)
        except Failed as failure:
            print(f"{options.scenario}: {failure}", file=sys.stderr)
            return 1
    print(f"{options.scenario}: passed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
