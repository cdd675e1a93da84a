"""The predictors `contact` and `field`: forces of bodies that overlap and of the static geometry."""

from dataclasses import dataclass

import numpy as np

from . import geometry, pairs
from .errors import require
from .integers import clamp, root
from .state import MOST_C, MOST_P, MOST_V


@dataclass(frozen=True)
class Kind:
    """The constants of one kind of contact: spring in 2^-14, dampings in 2^-13."""

    spring: int
    normal: int
    shear: int


@dataclass(frozen=True)
class World:
    """The constants of `contact`, and what follows from the largest radius."""

    substeps: int
    bodies: Kind
    ground: Kind
    radius: np.ndarray
    mobility: np.ndarray
    planes: list
    boxes: list
    balls: list

    @property
    def shift(self):
        """A grid unit is 2^shift lattice units."""
        return max(0, (2 * int(self.radius.max())).bit_length() - 14)

    @property
    def width(self):
        """The largest diameter in grid units."""
        return (2 * int(self.radius.max())) >> self.shift

    def slice_of_step(self):
        """A sub-step's part of a frame, in 2^-15."""
        return (2**15 + self.substeps // 2) // self.substeps


def read_world(constants):
    """The world that `predictor_constants` tells."""
    values = list(constants)

    def take(count, least, most):
        require(len(values) >= count, "session", "too few predictor constants")
        taken, values[:count] = values[:count], []
        for value in taken:
            require(least <= value <= most, "session", f"predictor constant {value} is not in {least} .. {most}")
        return taken

    substeps = take(1, 1, 16)[0]
    kinds = [Kind(*take(1, 0, 2**16), *take(2, 0, 2**13)) for _ in range(2)]
    types = take(1, 1, 65536)[0]
    counts = take(3, 0, 256)
    of_types = [take(1, 1, 2**24) + take(1, 0, 2**20) for _ in range(types)]
    wide = 2**30
    planes = [take(4, -wide, wide) for _ in range(counts[0])]
    boxes = [take(3, -wide, wide) + take(3, 0, wide) + take(9, -wide, wide) for _ in range(counts[1])]
    balls = [take(3, -wide, wide) + take(1, 0, wide) for _ in range(counts[2])]
    require(not values, "session", "too many predictor constants")
    table = np.array(of_types, np.int64)
    return World(substeps, kinds[0], kinds[1], table[:, 0], table[:, 1], planes, boxes, balls)


def contact_force(kind, depth, n, relative):
    """Return the force that a contact adds to F, on each axis; n points from the body towards the other."""
    approach = (relative * n).sum(axis=0) >> 11
    push = clamp(((kind.spring * depth) >> 11) + ((kind.shear * approach) >> 11), 2**15 - 1)
    return (((kind.normal + kind.shear) * relative) >> 9) - ((push * n) >> 11)


def pair_forces(world, p, velocity, radius, couples):
    """Return the forces of touching pairs: (first bodies, second bodies, force on the first)."""
    a, b = couples
    apart = pairs.short_difference(p[:, a] >> world.shift, p[:, b] >> world.shift)
    square = (apart * apart).sum(axis=0)
    reach = (radius[a] >> world.shift) + (radius[b] >> world.shift)
    touching = square < reach * reach
    a, b, apart, square, reach = a[touching], b[touching], apart[:, touching], square[touching], reach[touching]
    inverse = 2**38 // root((2 * (square >> 16) + 1) << 31)
    t = (square + ((square >> 16) << 16) + 2**15) >> 1
    depth = np.maximum(0, reach - (((t >> 12) * inverse) >> 18))
    n = (apart * inverse) >> 18
    n[:, square == 0] = [[0], [2**12], [0]]
    return a, b, contact_force(world.bodies, depth, n, velocity[:, b] - velocity[:, a])


def total_force(world, p, v, radius, couples):
    """Return F of every body, from the state before a sub-step."""
    velocity = clamp(v >> (world.shift + 6), 2**14 - 1)
    force = np.zeros_like(p)
    a, b, of_pairs = pair_forces(world, p, velocity, radius, couples)
    for axis in range(3):
        np.add.at(force[axis], a, of_pairs[axis])
        np.subtract.at(force[axis], b, of_pairs[axis])
    for touched, depth, n in geometry.contacts(world, p, radius):
        force[:, touched] += contact_force(world.ground, depth, n, -velocity[:, touched])
    return force


def step(state, world, moving, gravity, decay, damping):
    """Make one frame: find pairs once, then make all sub-steps. Only the slots `moving` change."""
    alive = np.flatnonzero(state.alive)
    p, v, c = state.p[:, alive], state.v[:, alive], state.c[:, alive]
    kind = np.minimum(state.type[alive], len(world.radius) - 1)
    radius, mobility = world.radius[kind], world.mobility[kind]
    moves = np.isin(alive, moving, assume_unique=True)
    couples = pairs.find(world, p, v, state.capacity)
    part = world.slice_of_step()
    for substep in range(world.substeps):
        force = total_force(world, p, v, radius, couples)
        pushed = (clamp(force * 2 ** (world.shift + 2), 2**26) * mobility + 2**15) >> 16
        new_v, new_c = v + pushed, c
        if substep == 0:
            new_v = new_v + gravity + c
            new_c = c - ((c * decay + 2**15) >> 16)
            new_v -= (new_v * damping + 2**15) >> 16
        new_v, new_c = clamp(new_v, MOST_V), clamp(new_c, MOST_C)
        new_p = clamp(p + ((new_v * part + 2**20) >> 21), MOST_P)
        p, v, c = np.where(moves, new_p, p), np.where(moves, new_v, v), np.where(moves, new_c, c)
    state.p[:, alive], state.v[:, alive], state.c[:, alive] = p, v, c
