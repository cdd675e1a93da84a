"""Runs programs, measures recordings with `tandem bench bandwidth --trajectory`, and writes tables; Python alone."""

import functools
import hashlib
import json
import pathlib
import subprocess
import sys

TIMEOUT_S = 900


def run(command, **more):
    """The output of a command; ends the program if it fails."""
    try:
        done = subprocess.run([str(part) for part in command], timeout=TIMEOUT_S, capture_output=True, check=False, **more)
    except (OSError, subprocess.TimeoutExpired) as error:
        sys.exit(f"generate: {command[0]}: {error}")
    if done.returncode:
        output = (done.stdout[-1000:] if len(done.stdout) < 10000 else b"") + done.stderr[-1000:]
        sys.exit(f"generate: {command[0]} failed with {done.returncode}:\n{output.decode(errors='replace')}")
    return done.stdout


@functools.cache
def digest(file):
    return hashlib.sha256(pathlib.Path(file).read_bytes()).hexdigest()


def said_once(command, inputs):
    """The output of a command, kept beside the last of its inputs until one of them changes: a run that was stopped goes on."""
    key = hashlib.sha256("\n".join([*map(str, command), *map(digest, inputs)]).encode()).hexdigest()[:16]
    kept = pathlib.Path(f"{inputs[-1]}.{key}.measured")
    if not kept.is_file():
        part = kept.with_suffix(".part")
        part.write_bytes(run(command))
        part.replace(kept)
    return kept.read_bytes()


def measure(tool, npy, codecs, predictor, *more):
    """Rows by codec, with `bytes` a frame."""
    command = [tool, "bench", "bandwidth", "--trajectory", npy, "--codec", codecs, "--predictor", predictor, "--json", *more]
    about = npy.with_suffix(".json")
    scene = json.loads(about.read_text(encoding="utf-8")).get("scene")
    rows = json.loads(said_once(command, [tool, about, *([npy.with_name(scene)] if scene else []), npy]))["rows"]
    for row in rows:
        if not row["missing"]:
            row["bytes"] = row["mbit_per_s"] * 2**20 / 8 * row["dt_s"]
    return {row["codec"]: row for row in rows}


def table(header, lines):
    head = "| " + " | ".join(header) + " |\n|" + "---|" * len(header)
    return "\n".join([head, *("| " + " | ".join(line) + " |" for line in lines)]) + "\n"


def peer_cells(rows, ours):
    """Names of the peers among `rows`, what they take, and how often the best of them takes what `ours` does."""
    peers = [codec for codec, row in rows.items() if not row["predictor"]]
    there = [rows[peer]["bytes"] for peer in peers if not rows[peer]["missing"]]
    cells = [f"needs {rows[p]['missing']}" if rows[p]["missing"] else f"{rows[p]['bytes']:.0f}" for p in peers]
    return peers, [*cells, f"{min(there) / ours:.1f}" if there else "-"]
