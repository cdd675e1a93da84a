"""Reads the folder of an audience as idl/AUDIENCE.md tells, with the independent decoder of tests/reference."""

import hashlib
import json
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "reference"))
from tandem_reference import cdr  # noqa: E402

KINDS = {1: "TandemSession", 2: "TandemDelta", 3: "TandemScheduledInput", 4: "TandemSnapshot"}


class Wrong(Exception):
    """The folder breaks a rule."""


def manifest(folder):
    return json.loads((pathlib.Path(folder) / "manifest.json").read_text(encoding="utf-8"))


def read_object(folder, named, ending="bin"):
    name, size = named[:2]
    data = (pathlib.Path(folder) / "objects" / f"{name}.{ending}").read_bytes()
    if len(data) != size or hashlib.sha256(data).hexdigest() != name:
        raise Wrong(f"object {name} is not what its name says")
    return data


def messages(data):
    at = 0
    while at < len(data):
        (size,) = struct.unpack_from("<I", data, at)
        yield KINDS[data[at + 4]], cdr.decode(KINDS[data[at + 4]], data[at + 5 : at + 4 + size])
        at += 4 + size


def hashes(folder):
    """{(epoch, frame): hash as 16 hex digits} of all that the manifest names; checks names, order and gaps."""
    now = manifest(folder)
    passages = []
    for chapter in now["chapters"]:
        passages += json.loads(read_object(folder, chapter, "json"))["passages"]
    passages += now["passages"]
    runs = {run["run"]: run for run in now["runs"]}
    found = {}
    for passage in passages:
        run, frame = runs[passage["run"]], passage["frame"]
        if [kind for kind, _ in messages(read_object(folder, passage["snapshot"]))] != ["TandemSnapshot"]:
            raise Wrong("a passage does not begin with a snapshot")
        for segment in passage["segments"]:
            for kind, message in messages(read_object(folder, segment)):
                if kind != "TandemDelta":
                    continue
                frame += 1
                if (message.epoch, message.frame) != (int(run["epoch"]), frame):
                    raise Wrong(f"frame {message.frame} follows {frame - 1}")
                found[message.epoch, frame] = f"{message.hash:016x}"
    return found
