"""The solids of the predictor `rigid`: where two of them touch. Plain integers; lengths in 1/64 lattice unit."""

from dataclasses import dataclass
from math import isqrt

ROUND, BOX = 0, 1
ONE = 2**24  # of a component of an axis
UNIT = 2**14  # of a component of a normal
PARALLEL = ONE >> 10


def clamp(x, most):
    """Keep x within -most .. most."""
    return max(-most, min(x, most))


def quotient(a, b):
    """a / b rounded towards zero."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def dot(a, b):
    """The scalar product."""
    return sum(x * y for x, y in zip(a, b))


def plus(a, b):
    """The sum of two vectors."""
    return [x + y for x, y in zip(a, b)]


def minus(a, b):
    """Their difference."""
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    """The vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


@dataclass
class Sized:
    """A type with its learned sizes: `size` in 1/64 lattice unit, `radius` of the sphere around it in lattice units."""

    kind: int
    size: list
    radius: int
    inverse: list
    rounding: int  # radius of edges, 1/64 lattice unit


def sized(solid, longer, rounding):
    """The solid of a type in a frame."""
    kind, size = solid[0], list(solid[1:])
    size = [x and max(1, min(x + ((x * longer + 2**15) >> 16), 2**22)) for x in size]
    if kind == BOX:
        radius, box = isqrt(dot(size, size)) + 1, size
    else:
        radius, box = size[0] + size[1], [size[0], size[1] + size[0], size[0]]
    inverse = []
    for i in range(3):
        y, z = box[(i + 1) % 3], box[(i + 2) % 3]
        inverse.append(min(3 * radius * radius // max(1, (y * y + z * z) >> 12), 2**18))
    if kind == ROUND and size[1] == 0:
        inverse = [5 << 11] * 3
    size = [x << 6 for x in size]
    return Sized(kind, size, radius, inverse, (min(size) * rounding + 2**15) >> 16 if kind == BOX else 0)


@dataclass
class Placed:
    """A solid with its three axes."""

    solid: Sized
    axes: list

    def local(self, x):
        """A vector of the world in the solid's frame."""
        return [dot(axis, x) >> 24 for axis in self.axes]

    def world(self, x):
        """A vector of the solid's frame in the world."""
        return [sum(axis[i] * y for axis, y in zip(self.axes, x)) >> 24 for i in range(3)]


def axes_of(q):
    """The axes of a body."""
    x, y, z, w = q
    one = 2**59

    def axis(*components):
        return [(component + 2**34) >> 35 for component in components]

    return [
        axis(one - y * y - z * z, x * y + w * z, x * z - w * y),
        axis(x * y - w * z, one - x * x - z * z, y * z + w * x),
        axis(x * z + w * y, y * z - w * x, one - x * x - y * y),
    ]


def direction(x, far):
    """Return x of the length `far` as a normal."""
    return [quotient(y * UNIT, far) for y in x]


def is_far(x, most):
    """Whether x is too long on an axis."""
    return any(abs(y) >= most for y in x)


def scaled(axis, length):
    """A way along an axis."""
    return [x * length >> 24 for x in axis]


def touch(a, b, d, margin):
    """Points (n, gap, at) where a and b, not both boxes, are nearer than `margin`: n from b to a, `at` from a's centre; d is b's centre minus a's."""
    if a.solid.kind == BOX:
        return touch_round_and_box(b, a, d, [0, 0, 0], -1, margin)
    if b.solid.kind == BOX:
        return touch_round_and_box(a, b, [-x for x in d], d, 1, margin)
    return touch_rounds(a, b, d, margin)


def touch_rounds(a, b, d, margin):
    """Two round solids: the nearest points of their axes."""
    (radius_a, length_a, _), (radius_b, length_b, _) = a.solid.size, b.solid.size
    axis_a, axis_b = a.axes[1], b.axes[1]
    cosine = dot(axis_a, axis_b) >> 24
    square = ONE - (cosine * cosine >> 24)
    to_b, to_a = dot(axis_a, d) >> 24, -(dot(axis_b, d) >> 24)
    s = 0
    if square > PARALLEL:
        s = clamp(quotient((to_b + (cosine * to_a >> 24)) << 24, square), length_a)
    t = clamp(to_a + (cosine * s >> 24), length_b)
    s = clamp(to_b + (cosine * t >> 24), length_a)
    on_a = scaled(axis_a, s)
    apart = minus(on_a, plus(d, scaled(axis_b, t)))
    radii = radius_a + radius_b
    if is_far(apart, radii + margin):
        return []
    far = isqrt(dot(apart, apart))
    if far - radii >= margin:
        return []
    n = direction(apart, far) if far else [0, UNIT, 0]
    return [(n, far - radii, [x - (y * radius_a >> 14) for x, y in zip(on_a, n)])]


def beyond(half, x):
    """From the nearest point of a box to x."""
    return [y - clamp(y, h) for y, h in zip(x, half)]


def near_box(half, rounding, x, radius, margin):
    """The normal and the gap of a ball at x in the frame of a box with rounded edges, or None."""
    away = beyond([h - rounding for h in half], x)
    if is_far(away, radius + rounding + margin):
        return None
    if any(away):
        far = isqrt(dot(away, away))
        n, gap = direction(away, far), far - rounding - radius
    else:
        inside = [h - abs(y) for y, h in zip(x, half)]
        face = inside.index(min(inside))
        n, gap = [0, 0, 0], -inside[face] - radius
        n[face] = -UNIT if x[face] < 0 else UNIT
    return (n, gap) if gap < margin else None


def touch_round_and_box(round_, box, to_round, at_box, sign, margin):
    """Return the points of a round solid at a box: its ends, and the nearest of 17 points of its axis."""
    radius, length, _ = round_.solid.size
    half = box.solid.size
    centre = box.local(to_round)
    places = [centre]
    if length:
        axis = box.local(scaled(round_.axes[1], length))
        parts = [[c + quotient(x * part, 8) for c, x in zip(centre, axis)] for part in range(-8, 9)]
        squares = [dot(away, away) for away in (beyond(half, x) for x in parts)]
        nearest = squares.index(min(squares))
        places = [minus(centre, axis), *([parts[nearest]] if 0 < nearest < 16 else []), plus(centre, axis)]
    points = []
    for x in places:
        if found := near_box(half, box.solid.rounding, x, radius, margin):
            n, gap = found
            at = box.world([y - (m * radius >> 14) for y, m in zip(x, n)])
            points.append(([sign * m for m in box.world(n)], gap, plus(at_box, at)))
    return points
