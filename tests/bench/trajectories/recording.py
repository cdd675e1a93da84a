"""Writes trajectories as `tandem bench bandwidth --trajectory` reads them (`tandem export --help`); Python alone."""

import array
import itertools
import json
import math
import random
import struct

CHANNELS = 6


def write_pair(npy, rows, bodies, info, channels=CHANNELS):
    """X.npy from the bytes of float32 [rows][bodies][channels], 6 or 13, and X.json from `info`."""
    count, rest = divmod(len(rows), bodies * channels * 4)
    if rest or count != len(info["gravity"]):
        raise ValueError(f"{npy.name}: {len(rows)} bytes for {bodies} bodies and {len(info['gravity'])} rows of gravity")
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({count}, {bodies}, {channels}), }}".encode()
    header = header.ljust(117) + b"\n"
    npy.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + rows)
    npy.with_suffix(".json").write_text(json.dumps(info) + "\n", encoding="utf-8")


def rows_of_dump(dump, bodies, every):
    """The rows of a LAMMPS dump of `id x y z vx vy vz`, sorted by id, a frame each `every` steps."""
    rows = array.array("f")
    with open(dump, encoding="ascii") as lines:
        for frame in itertools.count():
            head = list(itertools.islice(lines, 9))
            if not head:
                return rows.tobytes()
            where = f"{dump}, frame {frame}"
            if len(head) < 9 or int(head[1]) != frame * every or int(head[3]) != bodies:
                raise ValueError(f"{where}: expected {bodies} atoms at step {frame * every}")
            if head[8].split() != "ITEM: ATOMS id x y z vx vy vz".split():
                raise ValueError(f"{where}: expected the columns id x y z vx vy vz")
            values = " ".join(itertools.islice(lines, bodies)).split()
            if values[::7] != [str(name) for name in range(1, bodies + 1)] or len(values) != 7 * bodies:
                raise ValueError(f"{where}: expected each of the {bodies} atoms once, in order")
            del values[::7]
            rows.extend(map(float, values))


def start_block(bodies, radius, low, high, seed):
    """Layers of bodies with gaps, jittered, from the bottom of the room up."""
    random_ = random.Random(seed)
    spacing, gap = 2.1 * radius, 0.05 * radius
    across = [int((high[axis] - low[axis] - 2 * radius) / spacing) for axis in (0, 2)]
    start = []
    for body in range(bodies):
        layer, place = divmod(body, across[0] * across[1])
        at = (place % across[0], layer, place // across[0])
        start.append([low[i] + radius * 1.5 + spacing * at[i] + random_.uniform(-gap, gap) for i in range(3)])
    if start[-1][1] > high[1] - radius:
        raise ValueError(f"{bodies} bodies do not fit the room")
    return start


def turning_gravity(frames, dt_s, strength, seed):
    """A user turns the room: down for 4 s, then about another direction every 2.5 s, every third of them upwards."""
    random_ = random.Random(seed + 1_000_000)
    gravity, direction, turns = [], (0.0, -1.0, 0.0), 0
    for frame in range(frames):
        due = int(max(0.0, frame * dt_s - 4) / 2.5 + (frame * dt_s >= 4))
        if due != turns:
            turns = due
            up = 1.0 if turns % 3 == 0 else -1.0
            aim = (random_.gauss(0, 0.4), up, random_.gauss(0, 0.4))
            length = math.hypot(*aim)
            direction = tuple(x / length for x in aim)
        gravity.append([strength * x for x in direction])
    return gravity


def world_text(dt_s, radius, low, high, spring, damping, shear):
    """The scene file from which `field` knows the bodies in a closed room: see scene_text()."""
    planes = [(*(side * (i == axis) for i in range(3)), side * bounds[axis])
              for axis in range(3) for side, bounds in ((1, low), (-1, high))]  # fmt: skip
    return scene_text(dt_s, radius, low, high, planes, spring, damping, shear)


def scene_text(dt_s, radius, low, high, planes, spring, damping, shear):
    """A scene file for `field`: `planes` of a normal's x, y, z and the offset along it; spring and damping for a mass of 1."""
    lines = [
        f"dt_s: {dt_s!r}",
        "threshold_radii: 0.1",
        "bounds { low { x: %g y: %g z: %g } high { x: %g y: %g z: %g } }" % (*low, *high),
        f"pair {{ spring: {spring:g} damping: {damping:g} shear: {shear:g} }}",
        f'types {{ name: "body" radius_m: {radius:g} mass_kg: 1 colour: "#808080" share: 1 }}',
        "start { proportions { x: 1 y: 1 z: 1 } spacing: 1 }",
    ]
    for *normal, offset in planes:
        through, towards = (" ".join(f"{axis}: {scale * n:.9g}" for axis, n in zip("xyz", normal) if n) for scale in (offset, 1))
        lines.append(f"planes {{ through {{ {through} }} normal {{ {towards} }} }}")
    return "\n".join(lines) + "\n"
