"""Writes the test vectors: python3 write_vectors.py FOLDER. What they are: idl/vectors/README.md."""

import pathlib
import struct
import sys

import contact_vectors
import hard_vectors
import news_vectors
import orientation_vectors
import rigid_vectors
import tracker_vectors
import worlds
import writer
from tandem_reference import xxh3
from tandem_reference.huffman import Table
from tandem_reference.predict import Drive
from vector_text import NOTE, Vector, scattered


def absolute():
    """Codec none: three forms of selection."""
    line = scattered("none", "ballistic", (0, 1, 5, 9), 10)
    line.world.state.c[:, :] = line.world.state.alive * 77
    vector = Vector("codec none: list, mask and all; c becomes 0", line)
    vector.predict()
    vector.say("list: slot 5")
    vector.delta(writer.section(0x83, bytes.fromhex("00 00 0100 0500") + struct.pack("<6i", 1, -2, 2**30, 3, -4, 2**28)))
    vector.say("mask: slots 1 and 9")
    vector.delta(writer.section(0x83, bytes.fromhex("00 01 0202") + struct.pack("<12i", *range(-6, 6))))
    vector.say("all: slots 0, 1, 5, 9")
    vector.delta(writer.section(0x83, bytes.fromhex("00 02") + struct.pack("<24i", *range(100, 124))))
    vector.say("all, of which 0 was despawned and 3 spawned in this delta")
    born = writer.record(0, 0) + writer.record(3, 1, b"\1\1", writer.position((9, 8, 7), (6, 5, 4)))
    everyone = writer.section(0x83, bytes.fromhex("00 02") + struct.pack("<24i", *range(200, 224)))
    vector.delta(writer.section(0x81, born) + everyone)
    vector.refuse(writer.section(0x83, bytes.fromhex("00 00 0100 0500") + struct.pack("<6i", 2**30 + 1, 0, 0, 0, 0, 0)),
                 "a position out of range")  # fmt: skip
    vector.refuse(writer.section(0x83, bytes.fromhex("00 01 0206") + bytes(72)), "an unused bit of the mask")
    vector.refuse(writer.section(0x83, bytes.fromhex("00 00 0000")), "nobody selected")
    vector.refuse(writer.section(0x83, bytes.fromhex("00 00 0100 0200") + bytes(24)), "a dead slot")
    return vector


def quantized():
    """Codec quantized, with the ends of the residuals and of the state."""
    line = scattered("quantized", "ballistic", (0, 3), 4)
    line.world.state.p[0, 0], line.world.state.v[0, 0] = -(2**30), 2**28
    line.world.state.c[:, 3], line.world.state.rest[3] = (5, 3000, -7), 1
    vector = Vector("codec quantized: residuals to -128 and 127, sums clamped, c stays, rest ends", line)
    vector.delta(writer.section(0x83, bytes.fromhex("00 02 8000 7f7f 0080 010203 ff8000")))
    vector.predict(2)
    vector.say("p is rounded before the corrections alone, v and c behind them")
    rounded = writer.section(0x87, bytes([6, 5, 4]))
    vector.delta(rounded + writer.section(0x83, bytes.fromhex("00 01 08 010203 040506")))
    vector.predict()
    return vector


def huffman():
    """Codec entropy, with another table for velocities than for positions."""
    # The codes of velocities are of 1 to 10, 17 and 18 bits.
    tables = worlds.huffman_lengths() + bytes([*range(1, 11), *[17] * 10, *[18] * 236])
    vector = Vector("codec entropy", scattered("entropy", "ballistic", (0, 2, 3, 7), 8, tables))
    residuals = [[0, 0, -1, 0, 1, 255], [2, -2, 3, -128, 127, 0], [-128, 127, 4, 128, 5, 6]]
    codes = [Table(tables[:256]).code_of, Table(tables[256:]).code_of]
    packed = []
    for body in residuals:
        for i, value in enumerate(body):
            packed.append(codes[i // 3][value - 256 if value > 127 else value])
    data = bytes.fromhex("00 01 8c") + writer.joined_codes(packed)
    vector.predict()
    vector.say("slots 2, 3 and 7; the codes of all three follow each other without gaps")
    vector.delta(writer.section(0x83, data))
    vector.predict()
    vector.refuse(writer.section(0x83, data + b"\0"), "a byte behind the last code")
    vector.refuse(writer.section(0x83, data[:-1]), "a byte too few")
    vector.refuse(writer.section(0x83, data[:-1] + bytes([data[-1] | 1])), "a bit of the last byte that is not zero")
    return vector


def lifecycle():
    """Records of every kind."""
    line = scattered("none", "ballistic", (0, 2, 5), 8)
    line.world.state.rest[[0, 2]] = 1
    line.world.state.c[:, 0] = line.world.state.c[:, 2] = 0, 3000, 0
    line.world.state.reuse[5] = 255
    vector = Vector("lifecycle records of every kind", line)
    place = writer.position((-1, 2, -3), (4, -5, 6))
    for why, records in (
        ("despawn of 2", [writer.record(2, 0)]),
        ("spawn in 2", [writer.record(2, 1, b"\1\1", place)]),
        ("teleport of 0, which wakes it", [writer.record(0, 2, b"\1", place)]),
        ("type change of 2", [writer.record(2, 3, b"\0")]),
        ("despawn and spawn of 5", [writer.record(5, 0), writer.record(0, 1, b"\0\1", place)]),
        ("several", [writer.record(0, 0), writer.record(1, 1, b"\1\0", place), writer.record(1, 3, b"\1")]),
        ("despawn of 2, which zeroes reuse", [writer.record(2, 0)]),
    ):
        vector.say(why)
        vector.delta(writer.section(0x81, b"".join(records)))
    vector.predict()
    for why, records in (
        ("despawn of a dead slot", [writer.record(0, 0)]),
        ("spawn in a slot with a body", [writer.record(1, 1, b"\1\1", place)]),
        ("a slot beyond the capacity", [writer.record(8, 1, b"\1\1", place)]),
        ("a teleport of no group", [writer.record(1, 2, b"\0")]),
        ("a teleport of a group that is not listed", [writer.record(1, 2, b"\3", place)]),
        ("a type beyond the session's", [writer.record(1, 3, b"\2")]),
        ("two records of a slot", [writer.record(1, 3, b"\1"), writer.record(0, 2, b"\1", place)]),
        ("a spawn followed by a despawn", [writer.record(0, 1, b"\1\1", place), writer.record(0, 0)]),
        ("no record", []),
    ):
        vector.refuse(writer.section(0x81, b"".join(records)), why)
    return vector


def sections():
    """Parameters, unknown sections, order."""
    vector = Vector("parameters and unknown sections", scattered("quantized", "ballistic", (0, 1), 2))
    correct = writer.section(0x83, bytes.fromhex("00 02") + bytes([1, 2, 3, 4, 5, 6] * 2))
    vector.say("steps that change hold in the delta that carries them")
    vector.delta(writer.section(0x82, writer.parameters({2: 1000, 3: 70})) + correct)
    vector.say("the decay holds from the next step")
    vector.delta(writer.section(0x82, writer.parameters({4: 65535})))
    vector.predict()
    vector.say("one that names the value in force")
    vector.delta(writer.section(0x82, writer.parameters({4: 65535})))
    vector.say("unknown sections, before, between and behind")
    vector.delta(bytes.fromhex("0103aabbcc 8202 0400 7f00") + correct + bytes.fromhex("0200"))
    vector.say("corrections of the last block, without length and block")
    vector.delta(bytes.fromhex("86 02") + bytes([1, 2, 3, 4, 5, 6] * 2))
    vector.refuse(bytes.fromhex("86 02") + bytes([1, 2, 3, 4, 5, 6] * 2) + bytes.fromhex("0200"), "nothing may follow them")
    vector.refuse(bytes.fromhex("8400"), "an unknown critical section")
    vector.refuse(correct + bytes.fromhex("82020400"), "parameters behind corrections")
    vector.refuse(bytes.fromhex("8204 04000202"), "parameters that do not ascend")
    vector.refuse(bytes.fromhex("8202 0702"), "an unknown parameter")
    vector.refuse(bytes.fromhex("8202 0100"), "a threshold of 0")
    vector.refuse(bytes.fromhex("8200"), "no parameter")
    vector.refuse(bytes.fromhex("8203 048000"), "a value that is not in the shortest form")
    vector.refuse(bytes.fromhex("8203 0400"), "a section longer than the payload")
    return vector


def snapshots():
    """A snapshot with inputs to act, and snapshots that are refused."""
    line = scattered("none", "ballistic", [slot for slot in range(80) if slot % 11], 80, b"", 5)
    line.frame = 40
    line.world.state.reuse[1], line.world.state.type[2], line.world.state.rest[3] = 255, 1, 1
    line.world.state.c[1, 3] = 3000
    line.world.state.p[:] = line.world.state.p >> 5 << 5
    line.world.state.v[:] = line.world.state.v >> 2 << 2
    line.world.state.c[0, 20:] = line.world.state.alive[20:] * 400
    line.world.parameters[4] = 1234
    line.add_input(3, 42, Drive((1, 2, 3), 4))
    line.add_input(4, 43, Drive((5, 6, 7), 8))
    line.add_input(5, 42, Drive((9, -10, 11), 12))
    line.last_input = 6
    start = writer.snapshot(line)
    vector = Vector("a snapshot with inputs still to act; of two for a frame the highest number counts", line, start)
    vector.say("one that the snapshot counts already changes nothing")
    vector.input(6, 42, Drive((99, 98, 97), 96))
    vector.predict()
    vector.input(7, 44, Drive((0, 0, 0), 0))
    vector.predict(4)
    vector.refuse_snapshot(start[:4] + b"\4" + start[5:], "an unknown version")
    vector.refuse_snapshot(start[:4] + b"\2" + start[5:], "the version before")
    vector.refuse_snapshot(start[:59] + b"\1" + start[60:], "another capacity")
    vector.refuse_snapshot(start[:51] + bytes(8) + start[59:], "another state hash")
    vector.refuse_snapshot(start[:-1], "cut short")
    return vector


def ballistic_rest():
    """Rest with ballistic."""
    line = scattered("none", "ballistic", (0, 1, 2), 4)
    state = line.world.state
    state.rest[:2] = 1
    state.c[:, 0], state.c[:, 1], state.c[:, 2] = (0, 3000, 0), (0, 3000, 1), (0, 3000, 0)
    vector = Vector("ballistic: 0 rests, 1 wakes in the first step, 2 does not rest; a new gravity wakes 0", line)
    vector.predict(3)
    vector.input(1, 6, Drive((0, -2999, 0), 200))
    vector.predict(4)
    return vector


def ballistic():
    """Halves, and the limits of the state."""
    most_p, most_v = 2**30, 2**28
    places = {
        0: ((0, 0, 0), (33, -33, 31)),
        1: ((most_p - 5, 5 - most_p, 0), (most_v, -most_v, most_v - 1)),
        2: ((7, -7, 7), (97, -95, -31)),
        3: ((0, 0, 0), (-most_v, most_v, -96)),
    }
    line = worlds.timeline(worlds.stream(), places, Drive((0, 0, 0), 2**15))
    line.world.parameters[4] = line.stream.parameters[4] = 2**15
    state = line.world.state
    state.c[:, 0], state.c[:, 1], state.c[:, 2] = (1, -1, 3), (most_v, -most_v, 0), (-5, 5, 7)
    vector = Vector("ballistic: halves of every rounding, p and v beyond their limits", line)
    vector.predict(2)
    vector.input(1, 3, Drive((most_v, -most_v, 0), 0))
    vector.predict(2)
    vector.input(2, 5, Drive((1, -1, 0), 1))
    vector.predict()
    return vector


def layout():
    """The layout hash of the specification's example."""
    values = {1: 100, 2: 1, 3: 1, 4: 0, 5: 26214, 6: 9830}
    of = type(worlds.stream())(10000, 2, "tracker", "ballistic", values, lattice_unit=2.0**-10, lead=1)
    lines = ["# The layout hash of the example in PROTOCOL.md", NOTE, "capacity 10000", "types 2",
             "lattice_unit 3f50000000000000", "lead 1", "codec tracker", "predictor ballistic",
             "parameters 1=100 2=1 3=1 4=0 5=26214 6=9830", f"layout_hash {xxh3.text(of.layout_hash())}",
             "hash " + xxh3.text(worlds.world(of).state.hash())]  # fmt: skip
    return "\n".join(lines) + "\n"


def main(folder):
    """Write all vectors."""
    vectors = {
        "absolute": absolute(),
        "quantized": quantized(),
        "huffman": huffman(),
        "lifecycle": lifecycle(),
        "sections": sections(),
        "snapshot": snapshots(),
        "ballistic": ballistic(),
        "ballistic_rest": ballistic_rest(),
        **contact_vectors.vectors(),
        **hard_vectors.vectors(),
        **rigid_vectors.vectors(),
        **news_vectors.vectors(),
        **tracker_vectors.vectors(),
        **orientation_vectors.vectors(),
    }
    for name, vector in vectors.items():
        (pathlib.Path(folder) / f"{name}.txt").write_text(vector.text(), encoding="utf-8")
    (pathlib.Path(folder) / "layout.txt").write_text(layout(), encoding="utf-8")
    (pathlib.Path(folder) / "turn.txt").write_text(orientation_vectors.turns(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
