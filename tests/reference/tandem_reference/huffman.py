"""Canonical Huffman codes of the codecs `entropy` and `limited`."""

from .errors import require

LONGEST = 18


class Table:
    """A complete prefix code of the 256 residuals, given by their code lengths."""

    def __init__(self, lengths):
        require(all(1 <= length <= LONGEST for length in lengths), "session", "a code length out of range")
        total = sum(2 ** (LONGEST - length) for length in lengths)
        require(total == 2**LONGEST, "session", "a codec table that is not a complete prefix code")
        self.residual_of = {}
        self.code_of = {}
        code, before = 0, 0
        for index in sorted(range(256), key=lambda i: (lengths[i], i)):
            code <<= lengths[index] - before if before else 0
            before = lengths[index]
            residual = index - 256 if index >= 128 else index
            self.residual_of[before, code] = residual
            self.code_of[residual] = (before, code)
            code += 1


def tables(data, count):
    """Return `count` tables of 256 bytes: for residuals of p and of v, with orientations also of the turn and of w."""
    require(len(data) == 256 * count, "session", f"codec tables of {len(data)} bytes instead of {256 * count}")
    return [Table(data[at : at + 256]) for at in range(0, len(data), 256)]


class Bits:
    """The bits of some bytes, the most significant of each byte first."""

    def __init__(self, data, what):
        self.data = data
        self.at = 0
        self.what = what

    def one(self):
        """The next bit."""
        require(self.at < 8 * len(self.data), "length", f"{self.what} ends too soon")
        self.at += 1
        return self.data[(self.at - 1) >> 3] >> (-self.at & 7) & 1

    def number(self, width):
        """The next bits as a number."""
        value = 0
        for _ in range(width):
            value = value << 1 | self.one()
        return value

    def end(self):
        """Only zeros may be left, and less than a byte of them."""
        left = 8 * len(self.data) - self.at
        require(left < 8, "length", f"{self.what}: bytes left over")
        require(self.number(left) == 0, "padding", f"{self.what}: bits behind the last that are not zero")


def decode(data, of_vectors, bodies):
    """Decode three residuals of each table for each body, to the end of the data."""
    bits = Bits(data, "corrections")
    result = []
    for _ in range(bodies):
        residuals = []
        for table in (table for table in of_vectors for _ in range(3)):
            code, length = bits.one(), 1
            while (length, code) not in table.residual_of:
                code, length = code << 1 | bits.one(), length + 1
            residuals.append(table.residual_of[length, code])
        result.append(residuals)
    bits.end()
    return result
