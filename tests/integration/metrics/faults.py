"""Faults that are really made, and the alert that each of them fires."""

import shutil
import signal
import subprocess

from programs import Prometheus, get, values, wait_for

from hang import Hang

SMALL_DISK = "mount -t tmpfs -o size=16m tmpfs {folder} && exec {command}"


def of(address, series):
    return values(get(address, "/metrics")[1]).get(series, 0)


def can_mount():
    trial = ("unshare", "--user", "--map-root-user", "--mount", "sh", "-c", "mount -t tmpfs tmpfs /mnt")
    return shutil.which("unshare") and subprocess.run(trial, capture_output=True, check=False).returncode == 0


def record_on_a_small_disk(stage):
    folder = stage.folder / "disk"
    folder.mkdir()
    command = f"{stage.options.tandem} record {folder}/session.mcap --metrics 127.0.0.1:0"
    shell = SMALL_DISK.format(folder=folder, command=command) if can_mount() else f"exec {command}"
    isolation = ("unshare", "--user", "--map-root-user", "--mount") if can_mount() else ()
    stage.start("recorder", *isolation, "sh", "-c", shell)
    return stage.address("recorder")


def demote_again_and_again(stage, prometheus, server):
    """The third demotion within minutes is the fault."""
    participants = 'tandem_clients{delay="0",stream="0",role="participant"}'
    for count in range(1, 4):
        wait_for(lambda: of(server, participants) == 2, "the participant, besides the gateway")
        stage.signal("participant", signal.SIGSTOP)
        wait_for(lambda n=count: of(server, "tandem_demotions_total") == n, f"demotion {count}")
        stage.signal("participant", signal.SIGCONT)
    prometheus.wait_for_alert("TandemClientDemotedRepeatedly")


def check_standby(stage):
    """Health and figures of a server that stands by. It ends before the other one hangs."""
    arguments = ("--scene", "half_pipe", "--bodies", 500, "--predictor", "ballistic", "--standby", "--metrics", 0)
    stage.start("standby", stage.options.tandemd, *arguments)
    address = stage.address("standby")
    wait_for(lambda: get(address, "/readyz") == (200, "ready\n"), "a server that stands by")
    assert get(address, "/healthz") == (200, "alive\n")
    assert of(address, 'tandem_server_state{state="standing_by"}') == 1
    wait_for(lambda: of(address, "tandem_standby_checkpoint_frame") > 0, "figures, which are at most 0.25 s old")
    assert of(address, "tandem_standby_behind_frames") < 300
    assert of(address, "tandem_standby_received_bytes_total") > 500 * 40
    assert of(address, "tandem_checkpoint_age_seconds") < 10
    stage.processes["standby"].terminate()
    assert stage.processes["standby"].wait(10) == 0


def run(stage):
    checkpoints = stage.folder / "checkpoints"
    server = stage.server(500, "--predictor", "ballistic", "--stall-timeout", 0.3, "--checkpoint-dir", checkpoints)
    stage.start("participant", stage.options.tandem, "join")
    stage.start("gateway", stage.options.gateway, "--port", 0, "--viewer", "", "--metrics", "127.0.0.1:0")
    places = {"tandemd": server, "tandem-gateway": stage.address("gateway"), "tandem-recorder": record_on_a_small_disk(stage)}
    prometheus = Prometheus(stage, places)
    if can_mount():
        prometheus.wait_for_alert("TandemNoSpace")
    else:
        print("TandemNoSpace is not tried: no small disk can be mounted here", flush=True)

    check_standby(stage)
    wait_for(lambda: of(server, "tandem_checkpoint_age_seconds") > 0, "a checkpoint")
    shutil.rmtree(checkpoints)
    checkpoints.write_text("in the way", "utf-8")
    prometheus.wait_for_alert("TandemCheckpointOld")

    demote_again_and_again(stage, prometheus, server)

    with Hang(stage.processes["server"]):
        prometheus.wait_for_alert("TandemHangs")

    stage.signal("server", signal.SIGKILL)
    stage.start("faulty", stage.options.wrong_hashes, "half_pipe", 200)
    mismatches = "tandem_client_hash_mismatches_total"
    wait_for(lambda: of(places["tandem-gateway"], mismatches) > 0, "a mismatch")
    prometheus.wait_for_alert("TandemHashMismatch")
