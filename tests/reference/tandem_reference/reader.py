"""A cursor over bytes, with the integers that the protocol is made of."""

from .errors import Refused, require


class Reader:
    """Reads from the front; every read beyond the end is refused."""

    def __init__(self, data, what):
        self.data = bytes(data)
        self.at = 0
        self.what = what

    def left(self):
        """How many bytes are not read yet."""
        return len(self.data) - self.at

    def take(self, count):
        """The next bytes."""
        require(count <= self.left(), "length", f"{self.what} ends too soon")
        self.at += count
        return self.data[self.at - count : self.at]

    def rest(self):
        """All bytes that are left."""
        return self.take(self.left())

    def unsigned(self, size):
        """An unsigned integer of `size` bytes."""
        return int.from_bytes(self.take(size), "little")

    def signed(self, size):
        """A two's complement integer of `size` bytes."""
        return int.from_bytes(self.take(size), "little", signed=True)

    def u8(self):
        return self.unsigned(1)

    def u16(self):
        return self.unsigned(2)

    def u32(self):
        return self.unsigned(4)

    def u64(self):
        return self.unsigned(8)

    def i32(self):
        return self.signed(4)

    def leb128(self, most_bytes):
        """An unsigned LEB128 of at most so many bytes, in its shortest form."""
        value = 0
        for i in range(most_bytes):
            byte = self.u8()
            value |= (byte & 0x7F) << (7 * i)
            if byte < 0x80:
                require(byte != 0 or i == 0, "leb128", f"{self.what}: a number that is not in its shortest form")
                return value
        raise Refused("leb128", f"{self.what}: a number of more than {most_bytes} bytes")

    def zigzag(self, most_bytes):
        """A signed number, zigzag in LEB128."""
        value = self.leb128(most_bytes)
        return (value >> 1) ^ -(value & 1)

    def end(self):
        """Refuse what is left over."""
        require(self.left() == 0, "length", f"{self.what}: {self.left()} bytes left over")
