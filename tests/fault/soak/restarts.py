"""Cases of checkpoints: what they cost, servers that are killed, and a machine that loses power."""

import os
import subprocess
import time

from clients import Group, wait_until
from stage import Failed

FRAMES_PER_S = 30
KILLED_BODIES = 10_000


def checkpoint(stage, minutes, _):
    """A checkpoint each second: what the copy delays a frame, and what a file costs."""
    rows = []
    for scene, bodies, most_ms, most_bytes in (
        ("half_pipe", 10_000, 1, 56), ("half_pipe", 300_000, 10, 56), ("rubble", 1_000, 1, None),
    ):  # fmt: skip
        server = stage.serve(bodies, "--scripted", "--checkpoint-dir", stage.path(f"{scene}{bodies}"), "--duration",
                             minutes * 60 / 3, scene=scene)  # fmt: skip
        report = server.output(minutes * 60 / 3 + 60)
        kept = report.get("checkpoint")
        if not kept or not kept["written"] or kept["failed"]:
            raise Failed(f"{scene} with {bodies} bodies wrote no checkpoints: {server.lines[-3:]}")
        per_body = kept["bytes"] / bodies
        engine = "particles" if most_bytes else "Bullet"
        rows.append((
            f"checkpoint each second, {scene}, {bodies:,} bodies ({engine}): longest delay of a frame; bytes a body",
            f"{most_ms} ms; {most_bytes or 'measured'}",
            f"{kept['copy_ms_max']:.2f} ms; {per_body:.1f} ({kept['written']} checkpoints, the slowest in the other "
            f"thread {kept['write_ms_max']:.0f} ms; {report['frame_ms']['p50']:.1f} ms a frame)",
            kept["copy_ms_max"] <= most_ms and (most_bytes is None or per_body <= most_bytes),
        ))  # fmt: skip
    return rows


def frames_of(stage, life):
    """Return the frames that a server has published, of all streams: each has a log of its own."""
    logs = [stage.path(f"hashes{life}"), *stage.path("").glob(f"hashes{life}.*")]
    return [int(line.split(",")[1]) for log in logs for line in log.read_text().splitlines()]


def plays(server):
    """Return when each client played, as the server says."""
    return [at for at, line in list(server.lines) if " plays as " in line]


def killed(stage, minutes, rng):
    """A server is killed again and again and goes on from its checkpoint, with two participants and three observers."""
    until = time.monotonic() + minutes * 60
    keeps = ("--scripted", "--checkpoint-dir", stage.path("checkpoints"))
    server = stage.serve(KILLED_BODIES, *keeps, "--hash-log", stage.path("hashes0"))
    groups = [Group(stage, 2, "--input-script", stage.pushes(minutes * 60 + 60)), Group(stage, 3, "--observe")]
    for group in groups:
        group.wait(30)
    everybody = sum(group.count for group in groups)
    took_s, lost = [], []
    while not took_s or time.monotonic() < until:
        time.sleep(rng.uniform(2, 6))
        server.process.kill()
        server.process.wait()
        killed_at = time.monotonic()
        life = len(took_s) + 1
        server = stage.serve(
            KILLED_BODIES, *keeps, "--checkpoint", "require", "--hash-log", stage.path(f"hashes{life}")
        )  # fmt: skip
        wait_until(lambda: len(plays(server)) >= everybody, 60, "all clients after a restart")  # noqa: B023
        took_s.append(plays(server)[everybody - 1] - killed_at)
        lost.append(max(frames_of(stage, life - 1)) - min(frames_of(stage, life)))
    wrong = check_after_restarts(groups, len(took_s) + 1)
    server.stop()
    return [(
        f"server killed (-9) and restarted from its checkpoint, {KILLED_BODIES:,} bodies, {everybody} clients",
        "playing within 3 s; at most 1 s of the world lost; each client complete",
        f"{len(took_s)} times: playing after {max(took_s):.2f} s at most (the start of the process included); "
        f"{max(lost) / FRAMES_PER_S:.2f} s of the world lost at most; {wrong} clients incomplete",
        max(took_s) <= 3 and max(lost) <= FRAMES_PER_S and not wrong,
    )]  # fmt: skip


def check_after_restarts(groups, epochs):
    """Count the clients that did not play every epoch, or that saw another state than a server."""
    wrong = 0
    for group in groups:
        report = group.process.stop()
        wrong += sum(
            1 for client in report["clients"] if client["hash_mismatches"] or client["epochs"] != epochs
        ) + (group.count - len(report["clients"]))  # fmt: skip
    return wrong


def power(stage, _, __):
    """The machine loses power at any moment of a write: on the simulated disk, every prefix and every lost fsync."""
    ran = subprocess.run([stage.options.test_checkpoint, "--gtest_filter=PowerLoss.*"], capture_output=True, text=True,
                         timeout=300, check=False, env={**os.environ, "GTEST_COLOR": "no"})  # fmt: skip
    passed = sum(line.startswith("[       OK ]") for line in ran.stdout.splitlines())
    return [(
        "the machine loses power at any moment of a write (simulated disk: every prefix, every lost fsync)",
        "the newest complete checkpoint is found, always",
        f"{passed} tests of test_checkpoint passed" if ran.returncode == 0 else f"failed: {ran.stdout[-300:]!r}",
        ran.returncode == 0 and passed >= 3,
    )]  # fmt: skip
