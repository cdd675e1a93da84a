"""Finds the pairs of bodies that may touch each other within a frame."""

import numpy as np

MOST_IN_CELL = 16


def short(values):
    """Cut to 16 bits, signed."""
    return ((values + 2**15) & 0xFFFF) - 2**15


def short_difference(a, b):
    """b's minus a's, cut to 16 bits, signed."""
    return short(b - a)


def cells_of(world, p, capacity):
    """The cell of every body, and s: there are 2^(3s) cells."""
    s = 2
    while 2 ** (3 * s) < 2 * capacity:
        s += 1
    scale = 2**32 // (world.width + 1)
    x, y, z = ((p >> world.shift) * scale) >> 32
    return (x + (y << s) + (z << 2 * s)) & (2 ** (3 * s) - 1), s


def candidates(cells, s):
    """Pairs (a, b) of bodies of the same cell or of neighbours; each pair once, a before b as the rule says."""
    count = 2 ** (3 * s)
    order = np.argsort(cells, kind="stable")
    held = np.bincount(cells, minlength=count)
    first = np.cumsum(held) - held
    held = np.minimum(held, MOST_IN_CELL)
    place = np.arange(len(cells)) - first[cells[order]]
    taking_part = order[place < MOST_IN_CELL]
    place = place[place < MOST_IN_CELL]

    def with_cells(offset, start):
        other = (cells[taking_part] + offset) & (count - 1)
        partners = np.maximum(held[other] - start, 0)
        a = np.repeat(taking_part, partners)
        within = np.arange(len(a)) - np.repeat(np.cumsum(partners) - partners, partners)
        return a, order[np.repeat(first[other] + start, partners) + within]

    found = [with_cells(0, place + 1)]
    for x in (-1, 0, 1):
        for y in (-1, 0, 1):
            for z in (-1, 0, 1):
                offset = (x + (y << s) + (z << 2 * s)) % count
                if 0 < offset < count // 2:
                    found.append(with_cells(offset, 0))
    return np.concatenate([a for a, _ in found]), np.concatenate([b for _, b in found])


def find(world, p, v, capacity):
    """The pairs of a frame, from p and v of the alive bodies (ascending by slot) at its start."""
    cells, s = cells_of(world, p, capacity)
    a, b = candidates(cells, s)
    slack = world.width >> 5 if world.substeps > 1 else 0
    limit = (((world.width + slack) >> 5) + 3) ** 2

    def is_near(place):
        gap = short_difference(place[:, a] >> (world.shift + 5), place[:, b] >> (world.shift + 5))
        return (gap * gap).sum(axis=0) < limit

    near = is_near(p)
    if world.substeps > 1:
        near |= is_near(p + ((v * (2**15 - world.slice_of_step())) >> 21))
    return a[near], b[near]
