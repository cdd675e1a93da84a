"""The turn, and orientations in a predicted step."""

import math
import unittest

import numpy as np
import worlds
from tandem_reference import predict, turn
from tandem_reference.predict import Drive

ONE, MOST = turn.ONE, turn.MOST_W


def turned(q, w):
    after = turn.turned(np.array(q, np.int64).reshape(4, 1), np.array(w, np.int64).reshape(3, 1))
    return after[:, 0].tolist()


def exact(q, w):
    """The same in floating point."""
    x, y, z = (axis / 2**28 for axis in w)
    angle = math.sqrt(x * x + y * y + z * z)
    s = math.sin(angle / 2) / angle if angle else 0.5
    x, y, z, c = x * s, y * s, z * s, math.cos(angle / 2)
    a, b, d, e = (axis / ONE for axis in q)
    return [c * a + x * e + y * d - z * b, c * b - x * d + y * e + z * a,
            c * d + x * b - y * a + z * e, c * e - x * a - y * b - z * d]  # fmt: skip


class Turn(unittest.TestCase):
    def test_by_hand(self):
        self.assertEqual(turned((0, 0, 0, ONE), (0, 0, 0)), [0, 0, 0, ONE])
        # t = 0, S = C = 2^30: half of (1, -1, 1) in 2^-28 is (2, -2, 2) in 2^-30
        self.assertEqual(turned((0, 0, 0, ONE), (1, -1, 1)), [2, -2, 2, ONE])
        # t = (2^26 >> 28 = 0) >> 2 for w = 2^13: x = 2^14; the square, 2^28 >> 2 = 2^26, is below half a unit of n
        self.assertEqual(turned((0, 0, 0, ONE), (2**13, 0, 0)), [2**14, 0, 0, ONE])

    def test_at_the_limit(self):
        x, y, z, w = turned((0, 0, 0, ONE), (MOST, 0, 0))
        self.assertEqual((y, z), (0, 0))
        self.assertAlmostEqual(x / ONE, math.sin(1), delta=1e-6)
        self.assertAlmostEqual(w / ONE, math.cos(1), delta=1e-6)

    def test_equals_floating_point_and_keeps_the_norm(self):
        following = worlds.random_numbers(5)
        for _ in range(500):
            q, w = worlds.some_quaternion(following), worlds.some_spin(following)
            after = [axis / ONE for axis in turned(q, w)]
            for axis, wanted in zip(after, exact(q, w)):
                self.assertAlmostEqual(axis, wanted, delta=5e-6)
            self.assertAlmostEqual(math.sqrt(sum(axis * axis for axis in after)), 1, delta=1e-8)

    def test_the_world_turns_about_its_own_axes(self):
        quarter = round(math.pi / 2 * 2**28)
        half = ONE // 2
        first_x = turned(turned((0, 0, 0, ONE), (quarter, 0, 0)), (0, quarter, 0))
        first_y = turned(turned((0, 0, 0, ONE), (0, quarter, 0)), (quarter, 0, 0))
        for after, z in ((first_x, -half), (first_y, half)):
            for axis, wanted in zip(after, (half, half, z, half)):
                self.assertAlmostEqual(axis / ONE, wanted / ONE, delta=1e-6)

    def test_ranges(self):
        half = ONE // 2
        for q, good in (
            ((0, 0, 0, ONE), True),
            ((half, -half, half, -half), True),
            ((0, 0, 0, 0), False),
            ((0, 0, 0, ONE + 1), False),
            ((537132992,) * 4, True),
            ((537132992, 537132992, 537132992, 537132993), False),
            ((0, 0, 1073217408, 0), True),
            ((0, 0, 1073217407, 0), False),
            ((-(2**31),) * 4, False),
        ):
            self.assertEqual(bool(turn.is_quaternion(np.array(q, np.int64))), good, q)
        for w, good in (
            ((0, 0, 0), True),
            ((0, -MOST, 0), True),
            ((MOST + 1, 0, 0), False),
            ((0, MOST, 1), False),
            ((-(2**31),) * 3, False),
        ):
            self.assertEqual(bool(turn.is_spin(np.array(w, np.int64))), good, w)


class Step(unittest.TestCase):
    def test_every_body_turns_that_does_not_rest(self):
        for predictor in ("ballistic", "contact", "field"):
            with self.subTest(predictor=predictor):
                of = worlds.stream(predictor=predictor, turns=True)
                places = {slot: ((slot * 100000, 300000, 0), (0, 0, 0)) for slot in range(3)}
                state = worlds.world(of, places).state
                state.w[0, :3] = MOST
                state.rest[[0, 1]] = 1
                state.c[1, 0] = 100
                predict.step(state, of, {4: 0}, Drive((0, -100, 0), 0))
                self.assertEqual(state.rest[:3].tolist(), [True, False, False])
                self.assertEqual(state.q[:, 0].tolist(), [0, 0, 0, ONE])
                for slot in (1, 2):
                    self.assertEqual(state.q[:, slot].tolist(), turned((0, 0, 0, ONE), (MOST, 0, 0)))
                self.assertEqual(state.w[0].tolist(), [MOST] * 3 + [0] * 5)
                self.assertFalse(state.q[:, 3:].any())


if __name__ == "__main__":
    unittest.main()
