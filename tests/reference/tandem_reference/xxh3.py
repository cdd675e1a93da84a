"""XXH3-64 with seed 0, from the public specification of xxHash."""

import struct

import numpy as np

MASK = 2**64 - 1
PRIME32_1, PRIME32_2, PRIME32_3 = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D
PRIME64_1, PRIME64_2, PRIME64_3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
PRIME64_4, PRIME64_5 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5
PRIME_MX1, PRIME_MX2 = 0x165667919E3779F9, 0x9FB21C651E98DF25

SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671f"
    "cb79e64eccc0e578825ad07dccff7221b8084674f743248ee03590e6813a264c"
    "3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364"
    "eac5ac8334d3ebc3c581a0fffa1363eb170ddd51b7f0da49d316552629d4689e"
    "2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e"
)


def u64(data, at):
    """The u64 at a place of some bytes."""
    return int.from_bytes(data[at : at + 8], "little")


def u32(data, at):
    """The u32 at a place of some bytes."""
    return int.from_bytes(data[at : at + 4], "little")


def fold(a, b):
    """The two halves of a 128-bit product, one xor the other."""
    product = a * b
    return (product & MASK) ^ (product >> 64)


def avalanche(h):
    """XXH3's last mixing."""
    h ^= h >> 37
    h = h * PRIME_MX1 & MASK
    return h ^ (h >> 32)


def avalanche64(h):
    """XXH64's last mixing, used for the shortest inputs."""
    h ^= h >> 33
    h = h * PRIME64_2 & MASK
    h ^= h >> 29
    h = h * PRIME64_3 & MASK
    return h ^ (h >> 32)


def rotate_left(h, bits):
    """A u64 rotated."""
    return ((h << bits) | (h >> (64 - bits))) & MASK


def mix16(data, at, secret_at):
    """16 bytes mixed with 16 bytes of the secret."""
    return fold(u64(data, at) ^ u64(SECRET, secret_at), u64(data, at + 8) ^ u64(SECRET, secret_at + 8))


def hash_up_to_16(data):
    """Inputs of 0 to 16 bytes."""
    size = len(data)
    if size == 0:
        return avalanche64(u64(SECRET, 56) ^ u64(SECRET, 64))
    if size <= 3:
        combined = data[size - 1] | size << 8 | data[0] << 16 | data[size >> 1] << 24
        return avalanche64(combined ^ u32(SECRET, 0) ^ u32(SECRET, 4))
    if size <= 8:
        h = u32(data, size - 4) | u32(data, 0) << 32
        h ^= u64(SECRET, 8) ^ u64(SECRET, 16)
        h ^= rotate_left(h, 49) ^ rotate_left(h, 24)
        h = h * PRIME_MX2 & MASK
        h ^= (h >> 35) + size
        h = h * PRIME_MX2 & MASK
        return h ^ (h >> 28)
    low = u64(data, 0) ^ u64(SECRET, 24) ^ u64(SECRET, 32)
    high = u64(data, size - 8) ^ u64(SECRET, 40) ^ u64(SECRET, 48)
    swapped = int.from_bytes(low.to_bytes(8, "little"), "big")
    return avalanche((size + swapped + high + fold(low, high)) & MASK)


def hash_17_to_128(data):
    """Inputs of 17 to 128 bytes: pairs of 16 bytes, from both ends."""
    size = len(data)
    total = size * PRIME64_1
    for i in range((size - 1) // 32, -1, -1):
        total += mix16(data, 16 * i, 32 * i) + mix16(data, size - 16 * (i + 1), 32 * i + 16)
    return avalanche(total & MASK)


def hash_129_to_240(data):
    """Inputs of 129 to 240 bytes."""
    size = len(data)
    total = size * PRIME64_1
    for i in range(8):
        total += mix16(data, 16 * i, 16 * i)
    total = avalanche(total & MASK)
    for i in range(8, size // 16):
        total += mix16(data, 16 * i, 16 * (i - 8) + 3)
    total += mix16(data, size - 16, 136 - 17)
    return avalanche(total & MASK)


SECRET_WORDS = [u64(SECRET, 8 * i) for i in range(24)]
STRIPE_KEYS = np.array([SECRET_WORDS[i : i + 8] for i in range(16)], dtype=np.uint64)
SCRAMBLE_KEY = np.array(SECRET_WORDS[16:24], dtype=np.uint64)
LAST_KEY = np.array([u64(SECRET, 192 - 64 - 7 + 8 * i) for i in range(8)], dtype=np.uint64)
START = np.array(
    [PRIME32_3, PRIME64_1, PRIME64_2, PRIME64_3, PRIME64_4, PRIME32_2, PRIME64_5, PRIME32_1], dtype=np.uint64
)
NEIGHBOUR = [1, 0, 3, 2, 5, 4, 7, 6]
LOW_HALF, SHIFT_32, SHIFT_47, PRIME = np.uint64(0xFFFFFFFF), np.uint64(32), np.uint64(47), np.uint64(PRIME32_1)


def stripe_sums(words, keys):
    """Return what stripes (..., stripes, 8 words) add to the eight lanes."""
    keyed = words ^ keys
    return ((keyed & LOW_HALF) * (keyed >> SHIFT_32) + words[..., NEIGHBOUR]).sum(axis=-2, dtype=np.uint64)


def hash_long(data):
    """Inputs above 240 bytes: blocks of 16 stripes of 64 bytes."""
    size = len(data)
    blocks = (size - 1) // 1024
    stripes = (size - 1 - 1024 * blocks) // 64
    lanes = START.copy()
    words = np.frombuffer(data, "<u8", 128 * blocks).reshape(blocks, 16, 8)
    for block in stripe_sums(words, STRIPE_KEYS):
        lanes += block
        lanes ^= lanes >> SHIFT_47
        lanes ^= SCRAMBLE_KEY
        lanes *= PRIME
    rest = np.frombuffer(data, "<u8", 8 * stripes, 1024 * blocks).reshape(stripes, 8)
    lanes += stripe_sums(rest, STRIPE_KEYS[:stripes])
    lanes += stripe_sums(np.frombuffer(data, "<u8", 8, size - 64).reshape(1, 8), LAST_KEY)
    result = size * PRIME64_1
    lanes = [int(lane) for lane in lanes]
    for i in range(4):
        result += fold(lanes[2 * i] ^ u64(SECRET, 11 + 16 * i), lanes[2 * i + 1] ^ u64(SECRET, 19 + 16 * i))
    return avalanche(result & MASK)


def xxh3_64(data):
    """XXH3-64, seed 0, of bytes."""
    data = bytes(data)
    if len(data) <= 16:
        return hash_up_to_16(data)
    if len(data) <= 128:
        return hash_17_to_128(data)
    if len(data) <= 240:
        return hash_129_to_240(data)
    return hash_long(data)


def text(value):
    """A hash as it stands in logs: 16 lower-case hex digits."""
    return struct.pack(">Q", value).hex()
