"""Plans of rigid bodies for the recorders rigid_bullet, rigid_ode and rigid_mujoco; Python alone."""

import array
import math
import random

import recording

GRAVITY, DT_S, SUBSTEPS, EDGE = 9.81, 1 / 60, 2, 0.4
DOWN = (0.0, -GRAVITY, 0.0)
# A body is EDGE large: a cube's edge, and about the middle size of the others.
ERRORS = {1: 0.01 * EDGE, 5: 0.05 * EDGE, 10: 0.1 * EDGE}
SPHERE, BOX, CAPSULE = "sphere", "box", "capsule"
KINDS = {SPHERE: 1, BOX: 2, CAPSULE: 3}
CUBE = (BOX, [EDGE / 2] * 3)


def uniform_turn(random_):
    """A quaternion w, x, y, z, uniform over all."""
    q = [random_.gauss(0, 1) for _ in range(4)]
    length = math.hypot(*q)
    return [v / length for v in q]


def room(half):
    """A floor and four walls: normal and offset."""
    return [(0, 1, 0, 0), (1, 0, 0, -half), (-1, 0, 0, -half), (0, 0, 1, -half), (0, 0, -1, -half)]


def poured(random_, bodies, half, pitch, shapes):
    """A loose block of bodies, each turned at random: shape, mass, position, quaternion."""
    across = int((2 * half - pitch) / pitch)
    placed = []
    for body in range(bodies):
        layer, place = divmod(body, across * across)
        at = [pitch * (v - (across - 1) / 2) for v in (place % across, place // across)]
        jitter = [random_.uniform(-0.05, 0.05) * pitch for _ in range(3)]
        position = (at[0] + jitter[0], pitch * (layer + 0.7) + jitter[1], at[1] + jitter[2])
        placed.append((random_.randrange(shapes), 1.0, position, uniform_turn(random_)))
    return placed


def kicks_at(random_, times_s, half):
    """Blows from below: time, centre, radius, change of velocity."""
    return [(t, (random_.uniform(-half, half), 0, random_.uniform(-half, half)), 1.5, (0, 6, 0)) for t in times_s]


def leaning(angle):
    """Gravity that leans from straight down towards +x by an angle in rad."""
    return (GRAVITY * math.sin(angle), -GRAVITY * math.cos(angle), 0.0)


def down(_t_s):
    """Gravity that never changes."""
    return DOWN


def turned_at_18(t_s):
    """Gravity that is turned once."""
    return leaning(math.pi / 4) if round(t_s / DT_S) >= round(18 / DT_S) else DOWN


def pile(random_, bodies):
    """Cubes poured; two kicks, gravity turned once; none falls asleep."""
    return {"planes": room(4), "shapes": [CUBE], "bodies": poured(random_, bodies, 4, 0.75, 1), "sleep": False,
            "kicks": kicks_at(random_, (10, 14), 2), "gravity": turned_at_18}  # fmt: skip


def mixed(random_, bodies):
    """Boxes, capsules and balls of many sizes; kicks, gravity turned once."""
    shapes = []
    for _ in range(24):
        size = random_.uniform(0.6, 1.4) * EDGE / 2
        shapes += [(BOX, [size, size * random_.uniform(0.4, 1), size * random_.uniform(0.6, 1)]),
                   (CAPSULE, [0.6 * size, size * random_.uniform(0.2, 1)]), (SPHERE, [0.8 * size])]  # fmt: skip
    return {"planes": room(4.5), "shapes": shapes, "bodies": poured(random_, bodies, 4.5, 0.95, len(shapes)), "sleep": True,
            "kicks": kicks_at(random_, (10, 14), 2), "gravity": turned_at_18}  # fmt: skip


def towers(random_, bodies):
    """Towers of 3 x 3 x 11 cubes that are knocked over, one after the other."""
    placed, count = [], max(1, bodies // 99)
    side = math.ceil(math.sqrt(count))
    for body in range(bodies):
        tower, place = divmod(body, 99)
        layer, spot = divmod(place, 9)
        jitter = [random_.uniform(-0.004, 0.004) for _ in range(2)]
        position = (3.5 * (tower % side) + 0.41 * (spot % 3) + jitter[0], EDGE * (layer + 0.5),
                    3.5 * (tower // side) + 0.41 * (spot // 3) + jitter[1])  # fmt: skip
        placed.append((0, 1.0, position, (1, 0, 0, 0)))
    blows = [(2 + i, (3.5 * (i % side) + 0.4, 3.2, 3.5 * (i // side) + 0.4), 1.0,
              (random_.choice((-5, 5)), 0, random_.uniform(-3, 3))) for i in range(0, count, 2)]  # fmt: skip
    return {"planes": [(0, 1, 0, 0)], "shapes": [CUBE], "bodies": placed, "sleep": True, "kicks": blows, "gravity": down}


def dominoes(random_, bodies):
    """Rows of 50 that are tipped over one after the other."""
    placed = []
    for body in range(bodies):
        row, place = divmod(body, 50)
        position = (0.4 * place + random_.uniform(-0.002, 0.002), 0.4, 0.7 * row)
        placed.append((0, 1.0, position, (1, 0, 0, 0)))
    blows = [(1 + 0.7 * row, (0, 0.4, 0.7 * row), 0.2, (1.6, 0, 0)) for row in range((bodies + 49) // 50)]
    return {"planes": [(0, 1, 0, 0)], "shapes": [(BOX, [0.06, 0.4, 0.2])], "bodies": placed, "sleep": True, "kicks": blows,
            "gravity": down}  # fmt: skip


def rest(random_, bodies):
    """Cubes poured, then left alone."""
    return {"planes": room(4), "shapes": [CUBE], "bodies": poured(random_, bodies, 4, 0.75, 1), "sleep": True, "kicks": [],
            "gravity": down}  # fmt: skip


def block(random_, bodies, pitch, centre, shapes):
    """A loose cube of bodies about a centre, each turned at random."""
    side = math.ceil(round(bodies ** (1 / 3), 6))
    placed = []
    for body in range(bodies):
        cell = (body % side, body // (side * side), body // side % side)
        at = [centre[i] + pitch * (cell[i] - (side - 1) / 2 + random_.uniform(-0.05, 0.05)) for i in range(3)]
        placed.append((random_.randrange(shapes), 1.0, at, uniform_turn(random_)))
    return placed


def drum(random_, bodies):
    """Balls and cubes in a drum of sixteen planes that stands still while gravity goes round it, once in 12 s."""
    radius, sides, half = 5.5, 16, 4
    around = [(math.cos(a), math.sin(a), 0, radius * (math.sin(a) - 1)) for a in (2 * math.pi * i / sides for i in range(sides))]
    shapes = [CUBE, (SPHERE, [EDGE / 2]), (SPHERE, [0.3 * EDGE])]

    def gravity(t_s):
        return leaning(2 * math.pi * max(0, t_s - 1) / 12)

    return {"planes": [*around, (0, 0, 1, -half), (0, 0, -1, -half)], "shapes": shapes,
            "bodies": block(random_, bodies, 0.72, (0, radius, 0), len(shapes)), "sleep": False, "kicks": [], "gravity": gravity}  # fmt: skip


def chute(random_, bodies):
    """Boxes, capsules and balls that run down a chute of 40 degrees on to its end; after 8 s it stands level."""
    half, shapes = 3, mixed(random_, 1)["shapes"]
    planes = [(0, 1, 0, 0), (1, 0, 0, -4), (-1, 0, 0, -20), (0, 0, 1, -half), (0, 0, -1, -half)]
    placed = [(shape, mass, (x + 0.5, y, z), turn) for shape, mass, (x, y, z), turn in poured(random_, bodies, half, 0.95, len(shapes))]
    return {"planes": planes, "shapes": shapes, "bodies": placed, "sleep": True, "kicks": [],
            "gravity": lambda t_s: leaning(math.radians(40)) if t_s < 8 else DOWN}  # fmt: skip


def wall(random_, bodies):
    """Two walls of bricks side by side, out of which some are pulled, low ones first."""
    half, long = EDGE / 4, 25
    brick = (BOX, [2 * half, half, half])
    placed = []
    for body in range(bodies):
        side, place = divmod(body, (bodies + 1) // 2)
        layer, spot = divmod(place, long)
        at = (4.02 * half * (spot + layer % 2 / 2) + random_.uniform(-0.002, 0.002), half * (2 * layer + 1), 2 * side)
        placed.append((0, 1.0, at, (1, 0, 0, 0)))
    pulls = [(2 + 1.5 * i, (4 * half * random_.uniform(3, long - 3), half * (1 + 4 * i), 2 * (i % 2)), 0.45,
              (0, 0, random_.choice((-4, 4)))) for i in range(8)]  # fmt: skip
    return {"planes": [(0, 1, 0, 0)], "shapes": [brick], "bodies": placed, "sleep": True, "kicks": pulls, "gravity": down}


def avalanche(random_, bodies):
    """Cubes and balls that come to rest, until the room leans by 5 degrees a second, up to 50."""
    shapes = [CUBE, CUBE, (SPHERE, [EDGE / 2])]
    return {"planes": room(4), "shapes": shapes, "bodies": poured(random_, bodies, 4, 0.75, len(shapes)), "sleep": True, "kicks": [],
            "gravity": lambda t_s: leaning(math.radians(min(50, 5 * max(0, t_s - 6))))}  # fmt: skip


WORLDS = {world.__name__: world for world in (pile, mixed, towers, dominoes, rest, drum, chute, wall, avalanche)}


def plan(world, bodies, frames, seed):
    """Return the input of a recorder, for `frames` frames of 1/60 s, and the contents of X.json."""
    planned = WORLDS[world](random.Random(seed), bodies)
    gravity = [planned["gravity"](f * DT_S) for f in range(frames)]
    kicks = [(max(1, round(t / DT_S)), *centre, radius, *change) for t, centre, radius, change in planned["kicks"]]
    lines = [[repr(DT_S), SUBSTEPS, int(planned["sleep"])]]

    def listed(items):
        lines.append([len(items)])
        lines.extend(items)

    listed(planned["planes"])
    listed([[KINDS[kind], len(values), *values] for kind, values in planned["shapes"]])
    listed([[shape, mass, *at, *turn] for shape, mass, at, turn in planned["bodies"]])
    listed(kicks)
    listed(gravity)
    sizes = [min(values) if kind == BOX else values[0] for kind, values in planned["shapes"]]
    info = {"dt_s": DT_S, "damping_per_s": 0, "radius": min(sizes), "threshold": ERRORS[5], "gravity": [gravity[0], *gravity],
            "shapes": [{"shape": kind, "values": values} for kind, values in planned["shapes"]],
            "shape_of": [body[0] for body in planned["bodies"]]}  # fmt: skip
    return "\n".join(" ".join(map(str, line)) for line in lines) + "\n", info


def halved(rows, bodies, info):
    """Return every second row of a recording at 60 Hz, and the contents of its X.json at 30 Hz."""
    size = bodies * 13 * 4
    kept = b"".join(rows[i : i + size] for i in range(0, len(rows), 2 * size))
    return kept, {**info, "dt_s": 2 * info["dt_s"], "gravity": info["gravity"][::2]}


def positions(rows):
    """Return the first six of thirteen columns."""
    values, kept = array.array("f", rows), array.array("f", bytes(len(rows) // 13 * 6))
    for column in range(6):
        kept[column::6] = values[column::13]
    return kept.tobytes()


def scene(world, dt_s):
    """Return the scene for `field`: the planes, and springs of half the strength that would turn a body round in one frame."""
    planes = WORLDS[world](random.Random(0), 1)["planes"]
    return recording.scene_text(dt_s, EDGE / 2, (-60, -10, -60), (60, 60, 60), planes, 0.5 / dt_s**2, 0.1 / dt_s, 0.01 / dt_s)
