"""Two boxes of the predictor `rigid`: where they touch, in words of 16 bits."""

from dataclasses import dataclass

from .solids import clamp

MOST = 2**15 - 1
LEAST_SQUARE = 2**11  # of the sine of edges that make an axis
FACE_SHIFT, NEAR_SHIFT, EDGE_PART = 9, 4, 655


def word(x):
    """Keep x within 16 bits."""
    return max(-(2**15), min(x, MOST))


def times(x, y):
    """The product of two words."""
    return word((x * y + 2**14) >> 15)


def total(*terms):
    """The sum of words, from the left."""
    result = terms[0]
    for term in terms[1:]:
        result = word(result + term)
    return result


def less(x, y):
    """The difference."""
    return word(x - y)


def minus(x):
    """The same of 0 and x."""
    return word(-x)


def twice(x):
    """x + x."""
    return total(x, x)


def fourfold(x):
    """Four times x."""
    return twice(twice(x))


def size_of(x):
    """The absolute value."""
    return max(x, minus(x))


def dot(a, b):
    """The scalar product."""
    return total(*(times(x, y) for x, y in zip(a, b)))


def plus(a, b):
    """The sum of two vectors."""
    return [total(x, y) for x, y in zip(a, b)]


def difference(a, b):
    """Their difference."""
    return [less(x, y) for x, y in zip(a, b)]


def scaled(axis, x):
    """A way along an axis."""
    return [times(y, x) for y in axis]


def turned(matrix):
    """Rows for columns."""
    return [list(column) for column in zip(*matrix)]


def from_(k, things):
    """Three things, the k-th first, then the next two."""
    return [*things[k:], *things[:k]]


@dataclass
class Box:
    """A placed box in words: lengths in the unit of pairs."""

    axes: list
    size: list
    radius: int

    def arm(self, at):
        """A point by the radius, in 2^-12."""
        scale = 2 ** (15 - self.radius.bit_length())
        inverse = 2**27 // (self.radius * scale)
        return [times(clamp(x, self.radius) * scale, inverse) for x in at]


def rounded(length, shift):
    """Return a length in lattice units as a word."""
    return clamp(((length << 6) + (2**shift >> 1)) >> shift, MOST)


def box_of(placed, shift):
    """The box of a body."""
    axes = [[clamp((x + 2**8) >> 9, MOST) for x in axis] for axis in placed.axes]
    size = [rounded(x >> 6, shift) for x in placed.solid.size]
    return Box(axes, size, max(1, rounded(placed.solid.radius, shift)))


def touch(a, b, d, margin):
    """Points (n, gap, arm of a, arm of b) of two boxes; d is b's centre minus a's."""
    cosine = [[clamp(dot(x, y), MOST) for y in b.axes] for x in a.axes]
    in_a, in_b = ([dot(axis, d) for axis in box.axes] for box in (a, b))

    def by_faces(inside, one, other, rows):
        return [less(less(size_of(x), s), dot(other.size, map(size_of, row))) for x, s, row in zip(inside, one.size, rows)]

    of_a, of_b = by_faces(in_a, a, b, cosine), by_faces(in_b, b, a, turned(cosine))
    edges = best_edges(a, b, in_a, cosine)
    smallest = min(*a.size, *b.size)
    by_b = max(of_b) > total(max(of_a), smallest >> FACE_SHIFT)
    if max(*of_a, *of_b, edges[0]) >= margin:
        return []
    near = smallest >> NEAR_SHIFT
    if edges[0] > total(max(of_b if by_b else of_a), times(smallest, EDGE_PART)):
        n, found = touch_edges(a, b, d, cosine, edges)
    elif by_b:
        n, found = touch_faces(b, a, [minus(x) for x in in_b], turned(cosine), of_b.index(max(of_b)), margin, near)
        n, found = [total(x, 4) >> 3 for x in n], [(gap, plus(d, at)) for gap, at in found]
    else:
        n, found = touch_faces(a, b, in_a, cosine, of_a.index(max(of_a)), margin, near)
        n = [total(minus(x), 4) >> 3 for x in n]
    return [(n, gap, a.arm(at), b.arm(difference(at, d))) for gap, at in found]


def inverse_root(y):
    """1 / root(y), in 2^-13."""
    r = less(23777, times(y, 18115))
    for _ in range(3):
        r = twice(times(r, fourfold(less(3 * 2**11, times(times(y, r), r)))))
    return r


def best_edges(a, b, in_a, cosine):
    """The two edges along whose axis the boxes are furthest apart: how far; i, j; 1 / sine; side."""
    best = -MOST, 0, 0, 0, 0
    whole = [[size_of(x) for x in row] for row in cosine]
    for i in range(3):
        for j in range(3):
            i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            side = less(times(in_a[i2], cosine[i1][j]), times(in_a[i1], cosine[i2][j]))
            both = total(times(a.size[i1], whole[i2][j]), times(a.size[i2], whole[i1][j]),
                         times(b.size[j1], whole[i][j2]), times(b.size[j2], whole[i][j1]))  # fmt: skip
            square = less(MOST, times(whole[i][j], whole[i][j]))
            per_sine = inverse_root(square)
            apart = times(fourfold(less(size_of(side), both)), per_sine)
            if apart > best[0] and square >= LEAST_SQUARE:
                best = apart, i, j, per_sine, side
    return best


def touch_edges(a, b, d, cosine, edges):
    """The normal, and the nearest points of two edges."""
    apart, i, j, per_sine, side = edges
    axes_a, axes_b, size_a, size_b = from_(i, a.axes), from_(j, b.axes), from_(i, a.size), from_(j, b.size)
    c = from_(i, [from_(j, row) for row in cosine])

    def flipped(x):
        return minus(x) if side > 0 else x

    def on(size, x):
        return minus(size) if flipped(x) > 0 else size

    one, two = axes_a[0], axes_b[0]
    cross = [less(times(one[m - 2], two[m - 1]), times(one[m - 1], two[m - 2])) for m in range(3)]
    n = [total(flipped(times(x, per_sine)), 1) >> 1 for x in cross]
    start = plus(scaled(axes_a[1], on(size_a[1], minus(c[2][0]))), scaled(axes_a[2], on(size_a[2], c[1][0])))
    end = plus(scaled(axes_b[1], on(size_b[1], minus(c[0][2]))), scaled(axes_b[2], on(size_b[2], c[0][1])))
    between = difference(plus(end, d), start)
    along = less(dot(one, between), times(c[0][0], dot(two, between)))
    place = clamp(times(fourfold(times(fourfold(along), per_sine)), per_sine), size_a[0])
    return n, [(apart, plus(start, scaled(one, place)))]


def inverse(z):
    """1 / z of a cosine that is the greatest of three, in 2^-14."""
    r = total(2**14, less(27058, times(z, 27705)))
    for _ in range(2):
        r = twice(times(r, less(MOST, times(z, r))))
    return r


def touch_faces(one, other, d, cosine, k, margin, near):
    """The normal out of face k of `one`, and points of the other's face that looks at it: (gap, from one's centre)."""
    axes, half, d = from_(k, one.axes), from_(k, one.size), from_(k, d)
    c = from_(k, cosine)
    j = max(range(3), key=lambda j: size_of(c[0][j]))
    size = from_(j, other.size)
    c = [from_(j, row) for row in c]
    inwards = d[0] < 0
    if inwards:
        c[0] = [minus(x) for x in c[0]]
    if c[0][0] > 0:
        c = [[minus(row[0]), *row[1:]] for row in c]
    column = turned(c)
    middle = plus([size_of(d[0]), *d[1:]], scaled(column[0], size[0]))
    along, across = scaled(column[1], size[1]), scaled(column[2], size[2])
    per = inverse(minus(c[0][0]))
    slopes = [times(row[0], per) for row in c[1:]]
    corners = []
    for first, second in ((plus, plus), (difference, plus), (difference, difference), (plus, difference)):
        corners.append(second(first(middle, along), across))
    places = [place for m in range(4) for place in cut(corners[m], corners[m - 3], half)]
    for u, v in ((half[1], half[2]), (minus(half[1]), half[2]), (minus(half[1]), minus(half[2])), (half[1], minus(half[2]))):
        flat = [less(u, middle[1]), less(v, middle[2])]
        up = total(*(times(twice(x), slope) for x, slope in zip(flat, slopes)))
        if all(size_of(dot(column[m], [up, *flat])) <= size[m] for m in (1, 2)):
            places.append([total(middle[0], up), u, v])
    places = [[less(x[0], half[0]), *x[1:]] for x in places]
    found = []
    for gap, u, v in most_important([x for x in places if x[0] < margin], near):
        above = total(gap, half[0])
        place = [minus(above) if inwards else above, u, v]
        found.append((gap, [total(*(times(axis[m], y) for axis, y in zip(axes, place))) for m in range(3)]))
    n = [minus(x) for x in axes[0]] if inwards else axes[0]
    return n, found


def cut(corner, following, half):
    """Where the edge between two corners begins to be within a face, and where it ends, if that is no corner."""
    begin, end = 0, MOST
    for i, sign in ((1, 1), (1, -1), (2, 1), (2, -1)):
        one, two = (less(x[i] if sign > 0 else minus(x[i]), half[i]) for x in (corner, following))
        if one > 0 and two > 0:
            return []
        at = min((size_of(one) << 15) // max(total(size_of(one), size_of(two)), 1), MOST)
        if one > 0:
            begin = max(begin, at)
        elif two > 0:
            end = min(end, at)
    edge = difference(following, corner)
    ends = [begin, end] if end < MOST else [begin]
    return [plus(corner, scaled(edge, at)) for at in ends] if begin <= end else []


def most_important(places, near):
    """The lowest, then up to three times that which is the furthest from those chosen, if it is not near."""
    if not places:
        return []
    chosen = [min(places, key=lambda x: x[0])]
    far = [MOST] * len(places)
    while len(chosen) < 4:
        far = [min(y, total(*(size_of(less(x[i], chosen[-1][i])) for i in (1, 2)))) for x, y in zip(places, far)]
        if max(far) <= near:
            break
        chosen.append(places[far.index(max(far))])
    return chosen
