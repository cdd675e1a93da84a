#!/usr/bin/env python3
"""Recordings are MCAP files that tools which know nothing of Tandem read, types included.

mcap_test.py --writer PATH --tandemd PATH --tandem PATH --modules FOLDER

The npm packages are installed in FOLDER, which is kept. Exit 0 passed, 1 failed, 77 not run: without npm.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    f"</General><Discovery><Tag>mcap-test-{os.getpid()}</Tag></Discovery></Domain></CycloneDDS>"
)
NOT_RUN = 77


def install(folder):
    """Installs the npm packages as locked. Exits if they are not available."""
    for program in ("npm", "node"):
        if shutil.which(program) is None:
            print(f"not run: {program} is not installed")
            sys.exit(NOT_RUN)
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json", "read.mjs", "rewrite.mjs"):
        shutil.copy(HERE / name, folder)
    done = subprocess.run(
        ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--fetch-retries=1", "--fetch-retry-mintimeout=1000"], cwd=folder, capture_output=True, text=True, check=False
    )  # fmt: skip
    if done.returncode != 0:
        print(f"not run: npm cannot install the packages: {done.stderr.strip()[-300:]}")
        sys.exit(NOT_RUN)


def read(file, folder):
    """The summary that read.mjs prints of a file."""
    done = subprocess.run(["node", "read.mjs", file], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{file.name} cannot be read: {done.stderr[-1000:]}")
    return json.loads(done.stdout)


def check_fixed(writer, compression, folder, scratch):
    """The messages of write_capture.cpp, decoded by their schema alone."""
    file = scratch / f"{compression}.mcap"
    subprocess.run([writer, file, compression], check=True)
    found = read(file, folder)
    assert found["compression"] == ("zstd" if compression == "zstd" else ""), found["compression"]
    assert found["indexed"] == 4, found["indexed"]
    assert found["profile"] == "" and found["library"].startswith("tandem "), found["library"]
    assert found["statistics"] == {"messages": "4", "channels": 4}, found["statistics"]
    session, delta, scheduled, ack = found["messages"]
    assert session["topic"] == "TandemSession"
    content = session["content"]
    assert content["epoch"] == "1700000000123" and content["session"] == "arena", content
    assert content["lattice_unit"] == 1 / 1024
    assert [each["name"] for each in content["types"]] == ["sand", "box"]
    assert content["types"][1]["shape_values"] == [1, 2, 3.5]
    stream = content["streams"][0]
    assert stream["codec"] == "entropy" and stream["codec_tables"] == "ababab", stream
    assert stream["groups"] == ["position"] and stream["layout_hash"] == str(0xFEDCBA9876543210)
    assert stream["parameters"][0] == {"id": 1, "value": 100} and len(stream["parameters"]) == 6
    assert stream["predictor_constants"] == [1, -2]
    assert delta["topic"] == "TandemDelta"
    assert delta["publishTime"] == "1700000001000000000" and delta["logTime"] == "1700000001005000000"
    assert delta["content"]["stream"] == 2 and delta["content"]["generation"] == 3
    assert delta["content"]["hash"] == str(0x0123456789ABCDEF) and delta["content"]["payload"] == "11" * 5
    assert scheduled["content"]["values"] == [0, -980, 0, 12]
    assert ack["content"]["clock_ns"] == "-5" and ack["content"]["missing"] == [1, 2]
    print(f"fixed messages, compression {compression}: {len(found['messages'])} read")


def check_live(options, folder, scratch):
    """A session of a second or two; its recording."""
    file = scratch / "live.mcap"
    environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
    server = subprocess.Popen(
        [options.tandemd, "--scene", "half_pipe", "--bodies", "200", "--session", "mcap"], env=environment
    )
    try:
        subprocess.run(
            [options.tandem, "record", file, "--session", "mcap", "--timeout", "60", "--seconds", "3"],
            env=environment, check=True,
        )  # fmt: skip
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(60)
    found = read(file, folder)
    topics = [message["topic"] for message in found["messages"]]
    of_the_state = [topic for topic in topics if topic in ("TandemSession", "TandemSnapshot", "TandemDelta")]
    assert of_the_state[:3] == ["TandemSession", "TandemSession", "TandemSnapshot"], topics[:9]
    start = next(message["content"] for message in found["messages"] if message["topic"] == "TandemSnapshot")
    assert start["part"] == 0 and start["parts"] == 1 and start["total_bytes"] == len(start["bytes"]) // 2
    frames = [int(message["content"]["frame"]) for message in found["messages"] if message["topic"] == "TandemDelta"]
    first = int(start["frame"]) + 1
    assert len(frames) >= 30 and frames == list(range(first, first + len(frames))), frames
    assert found["statistics"]["messages"] == str(len(topics)) == str(found["indexed"])
    assert found["compression"] == "zstd" and found["chunks"] >= 3, found["chunks"]
    assert {"TandemAck", "TandemReply", "TandemServerStatus", "TandemClientStatus"} <= set(topics), set(topics)
    print(f"live session: {len(frames)} deltas read")
    return file


def rows_of(npy):
    """The positions in a trajectory, by row and slot."""
    data = npy.read_bytes()
    rows, bodies, columns = map(int, re.search(rb"\((\d+), (\d+), (\d+)\)", data[:128]).groups())
    floats = struct.unpack(f"<{rows * bodies * columns}f", data[128:])
    each = [floats[i : i + 3] for i in range(0, len(floats), columns)]
    return [each[row * bodies : (row + 1) * bodies] for row in range(rows)]


def check_points(options, recording, folder, scratch):
    """Point clouds of a recording hold the positions of its trajectory, and say how to read them."""
    clouds, npy = scratch / "points.mcap", scratch / "states.npy"
    for out in (("--points", clouds), ("--out", npy)):
        subprocess.run([options.tandem, "export", "--from", recording, *out], check=True)
    found = read(clouds, folder)
    rows = rows_of(npy)
    assert len(found["messages"]) == found["indexed"] == len(rows) >= 30, (found["indexed"], len(rows))
    types = {"x": "f", "y": "f", "z": "f", "radius": "f", "red": "B", "green": "B", "blue": "B", "alpha": "B", "type": "I"}
    numeric = {"f": 7, "B": 1, "I": 5}
    for message, row in zip(found["messages"], rows):
        cloud = message["content"]
        assert message["topic"] == "/bodies" and cloud["schema"] == "foxglove.PointCloud", message["topic"]
        at = cloud["timestamp"]["sec"] * 10**9 + cloud["timestamp"]["nsec"]
        assert str(at) == message["logTime"], (at, message["logTime"])
        assert {field["name"]: field["type"] for field in cloud["fields"]} == {k: numeric[v] for k, v in types.items()}
        data, stride = bytes.fromhex(cloud["data"]), cloud["point_stride"]
        assert len(data) == stride * len(row) and len(row) == 200, len(data)

        def column(name):
            start = next(field["offset"] for field in cloud["fields"] if field["name"] == name)
            return [struct.unpack_from("<" + types[name], data, i + start)[0] for i in range(0, len(data), stride)]

        assert list(zip(column("x"), column("y"), column("z"))) == row, "other positions than the trajectory"
        assert set(column("alpha")) == {255} and min(column("radius")) > 0
    print(f"point clouds: {len(rows)} read")


def chunks_of(mcap):
    """Where its chunks begin."""
    found, at = [], 8
    while at + 9 <= len(mcap):
        opcode, size = struct.unpack_from("<BQ", mcap, at)
        found += [at] if opcode == 6 else []
        at += 9 + size
    return found


def check_rewritten(options, recording, folder, scratch):
    """What tools make of a recording has the same states, whatever the order in the file, or is refused by name."""

    def export(file):
        out = scratch / "rewritten.npy"
        done = subprocess.run(
            [options.tandem, "export", "--from", file, "--out", out, "--overwrite"], capture_output=True, text=True, check=False
        )
        return out.read_bytes() if done.returncode == 0 else b"", done.stderr

    truth, _ = export(recording)
    made = scratch / "rewritten"
    made.mkdir()
    run = subprocess.run(["node", "rewrite.mjs", recording, made], cwd=folder, capture_output=True, text=True, check=False)
    names = run.stdout.split()
    assert run.returncode == 0 and len(names) == 8, run.stderr[-1000:]
    for name in names:
        states, errors = export(made / f"{name}.mcap")
        assert states == truth and not errors, (name, len(states), len(truth), errors)
    whole = bytearray(recording.read_bytes())
    last = chunks_of(whole)[-1]
    cut, rot = scratch / "cut.mcap", scratch / "rot.mcap"
    cut.write_bytes(whole[: last + 100])
    whole[last + 60 : last + 124] = bytes(byte ^ 255 for byte in whole[last + 60 : last + 124])
    rot.write_bytes(whole)
    for file, said in ((cut, "is cut short at byte"), (rot, "is damaged (at byte")):
        states, errors = export(file)
        assert 128 < len(states) < len(truth) and states[128:] == truth[128 : len(states)], (file.name, len(states), errors)
        assert said in errors, errors
    print(f"written anew: {', '.join(names)}: the same states", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--writer", "--tandemd", "--tandem", "--modules"):
        parser.add_argument(option, type=pathlib.Path, required=True)
    options = parser.parse_args()
    install(options.modules)
    with tempfile.TemporaryDirectory() as scratch:
        try:
            for compression in ("none", "zstd"):
                check_fixed(options.writer, compression, options.modules, pathlib.Path(scratch))
            recording = check_live(options, options.modules, pathlib.Path(scratch))
            check_points(options, recording, options.modules, pathlib.Path(scratch))
            check_rewritten(options, recording, options.modules, pathlib.Path(scratch))
        except (AssertionError, subprocess.SubprocessError) as failure:
            print(f"FAILED: {failure!r}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
