"""Scenarios of session_test.py with servers that stand by."""

import json
import subprocess
import time

from stage import LIMIT_S, Failed, check_report, compare

from hang import Hang


BODIES = 2000
EVERYBODY = ["participant", "observer"]


def play(stage):
    stage.server("first", "--scripted", scene="half_pipe", bodies=BODIES)
    stage.client("participant", "--input-script", stage.script("script", 1, 200, 0.1))
    stage.client("observer", "--observe")
    stage.wait_live(EVERYBODY, lambda live: live.get("frame", 0) > 60, "frame 60")


def start_standby(stage, name, rank, live):
    stage.server(name, "--standby", "--standby-rank", rank, "--scripted", scene="half_pipe", bodies=BODIES)
    stage.wait(lambda: stage.says(name, "can take over"), f"{name} to stand by")
    stage.wait(lambda: stage.says(live, f"of rank {rank} stands by"), f"{live} to hear of {name}")


def check_successor(stage, name, before, began):
    stage.wait(lambda: stage.hashes(name), f"the first frame of {name}")
    epoch, frame = next(iter(stage.hashes(name)))
    last_epoch, last = max(stage.hashes(before))
    stage.wait(lambda: (stage.folder / f"{name}.err").read_text().count(" plays as ") == len(EVERYBODY), "all playing")
    took_s = time.monotonic() - began
    print(f"{name}: {max(0, last - frame)} frames lost, all play after {took_s:.2f} s", flush=True)
    # A server that is stopped between a frame and its line in the log has made one more.
    if epoch <= last_epoch or frame > last + 1:
        raise Failed(f"{name} begins at frame {frame} of epoch {epoch}, after frame {last} of {last_epoch}")
    stage.wait_live(EVERYBODY, lambda live: live.get("frame", 0) > frame + 60, "two more seconds")
    return last_epoch, frame


def check_nothing_lost(stage, takeovers):
    """No client had a frame that the next server did not. What a killed server made and did not send is nobody's loss."""
    for epoch, frame in takeovers:
        known = max(at for name in EVERYBODY for of, at in stage.hashes(name) if of == epoch)
        if known > frame:
            raise Failed(f"clients had frame {known} of epoch {epoch}, and the next server began at frame {frame}")


def standby_takes_over(stage):
    """Servers stand by: one takes over without losing a frame when the live one is killed, and hands over when it is asked to."""
    play(stage)
    start_standby(stage, "second", 2, "first")
    start_standby(stage, "third", 1, "first")
    stage.wait_live(EVERYBODY, lambda live: live.get("frame", 0) > 150, "frame 150")
    began = time.monotonic()
    stage.kill("first")
    takeovers = [check_successor(stage, "third", "first", began)]
    stage.wait(lambda: stage.says("third", "of rank 2 stands by"), "the other to follow the new server")
    began = time.monotonic()
    command = [stage.options.tandem, "handover", "--json", *stage.common]
    asked = subprocess.run(command, capture_output=True, text=True, env=stage.environment, timeout=LIMIT_S, check=False)
    if asked.returncode != 0 or not json.loads(asked.stdout)["continues_frame"]:
        raise Failed(f"tandem handover ended with {asked.returncode}: {asked.stdout}{asked.stderr}")
    if stage.processes["third"].wait(LIMIT_S) != 0 or not stage.says("third", "another server continues"):
        raise Failed("the server that handed over did not end well")
    takeovers.append(check_successor(stage, "second", "third", began))
    alone = subprocess.run(command, capture_output=True, text=True, env=stage.environment, timeout=LIMIT_S, check=False)
    if alone.returncode != 1 or "no server stands by" not in alone.stderr:
        raise Failed(f"a handover to nobody: {alone.returncode}, {alone.stderr}")
    # One of another world stands by in vain, and says why.
    stage.server("foreign", "--standby", scene="half_pipe", bodies=BODIES + 1)
    stage.wait(lambda: stage.says("foreign", "[warning] standby: cannot stand by"), "a refusal")
    reports = {name: stage.stop(name) for name in EVERYBODY}
    check_nothing_lost(stage, takeovers)
    for name in EVERYBODY:
        check_report(reports[name])
        compare(stage, ["first", "third", "second"], name, 200, reports[name]["resyncs"])


def hung_server_is_replaced(stage):
    """A server hangs, and another one takes over. The first one wakes, stands by again, and takes over in its turn."""
    play(stage)
    start_standby(stage, "second", 1, "first")
    stage.kill("first")
    began = time.monotonic()
    stage.server("again", "--scripted", scene="half_pipe", bodies=BODIES)  # as a service does; it begins no new world
    takeovers = [check_successor(stage, "second", "first", began)]
    if stage.processes["again"].wait(LIMIT_S) != 1 or not stage.says("again", "already has a server"):
        raise Failed("the server that was started again did not leave the session to the one that stood by")
    start_standby(stage, "third", 1, "second")
    stage.wait_live(EVERYBODY, lambda live: live.get("frame", 0) > 150, "frame 150")
    began = time.monotonic()
    with Hang(stage.processes["second"]):
        takeovers.append(check_successor(stage, "third", "second", began))
        if not stage.says("third", "so it hangs"):
            raise Failed("third does not say why it took over")
    stage.wait(lambda: stage.says("second", "stands by again"), "second to find that another has its place")
    stage.wait(lambda: (stage.folder / "second.err").read_text().count("can take over") == 2, "second to stand by")
    stage.kill("third")
    stage.wait(lambda: (stage.folder / "second.err").read_text().count(" plays as ") == 2 * len(EVERYBODY), "all playing again")
    reports = {name: stage.stop(name) for name in EVERYBODY}
    check_nothing_lost(stage, takeovers)
    for name in EVERYBODY:
        check_report(reports[name])
        compare(stage, ["first", "second", "third"], name, 200, reports[name]["resyncs"])
