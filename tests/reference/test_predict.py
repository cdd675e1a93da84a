"""The predicted step."""

import unittest

import numpy as np
import worlds
from tandem_reference import contact, integers, pairs, predict
from tandem_reference.predict import Drive
from tandem_reference.xxh3 import text, xxh3_64


def digest(state):
    """One XXH3-64 of all columns, each over all slots, without rest: as an older version of the protocol hashed."""
    columns = [state.alive.astype("u1"), state.reuse.astype("u1"), state.type.astype("<u2")]
    columns += [row.astype("<i4") for rows in (state.p, state.v, state.c) for row in rows]
    return text(xxh3_64(b"".join(column.tobytes() for column in columns)))


def step(bodies, drive, decay=0, predictor="ballistic"):
    of = worlds.stream(predictor=predictor)
    state = worlds.world(of, bodies).state
    predict.step(state, of, {4: decay}, drive)
    return state


class Ballistic(unittest.TestCase):
    def test_by_hand(self):
        of = worlds.stream()
        state = worlds.world(of, {2: ((100, 0, -100), (64, -33, 0))}).state
        state.c[:, 2] = 10, 0, -7
        predict.step(state, of, {4: 32768}, Drive((0, 1, 0), 6554))
        # v: 74, -32, -7, less a tenth rounded: 7, -3, -1 (11 bits of rounding); c: half, rounded: 10 - 5, 0, -7 + 3
        self.assertEqual(state.v[:, 2].tolist(), [67, -29, -6])
        self.assertEqual(state.c[:, 2].tolist(), [5, 0, -4])
        self.assertEqual(state.p[:, 2].tolist(), [101, 0, -100])

    def test_everything_is_clamped(self):
        fast = step({0: ((2**30, 0, 0), (2**28, -(2**28), 0))}, Drive((2**28, -(2**28), 0), 0))
        self.assertEqual(fast.v[:, 0].tolist(), [2**28, -(2**28), 0])
        self.assertEqual(fast.p[:, 0].tolist(), [2**30, -(2**22), 0])

    def test_dead_slots_stay_zero(self):
        state = step({0: ((1, 2, 3), (0, 0, 0))}, Drive((0, -64, 0), 0))
        self.assertFalse(state.p[:, 1:].any() or state.v[:, 1:].any())

    def test_a_body_at_rest_stays_until_gravity_and_c_do_not_cancel(self):
        of = worlds.stream()
        state = worlds.world(of, {0: ((1, 2, 3), (640, 0, 0)), 1: ((5, 5, 5), (0, 0, 0))}).state
        state.rest[[0, 1]] = 1
        state.c[:, 0] = 0, 100, 0
        predict.step(state, of, {4: 65535}, Drive((0, -100, 0), 100))
        self.assertEqual(state.rest[:2].tolist(), [True, False])
        self.assertEqual([rows[:, 0].tolist() for rows in (state.p, state.v, state.c)],
                         [[1, 2, 3], [640, 0, 0], [0, 100, 0]])  # fmt: skip
        self.assertNotEqual(state.v[1, 1], 0)


class Contact(unittest.TestCase):
    def after_fifty_steps(self, predictor):
        of = worlds.stream(predictor=predictor, capacity=200)
        state = worlds.two_hundred_bodies()
        for _ in range(50):
            predict.step(state, of, {4: 800}, worlds.FALL)
        return digest(state)

    def test_two_hundred_bodies_with_contact(self):
        self.assertEqual(self.after_fifty_steps("contact"), "9642e926eedf7002")

    def test_two_hundred_bodies_with_field(self):
        self.assertEqual(self.after_fifty_steps("field"), "cc81d67cfaebc15b")

    def test_a_body_at_rest_is_felt_but_not_pushed(self):
        of = worlds.stream(predictor="contact")
        state = worlds.world(of, {0: ((0, 500000, 0), (0, 0, 0)), 1: ((30000, 500000, 0), (0, 0, 0))}).state
        state.rest[0] = 1
        predict.step(state, of, {4: 0}, Drive((0, 0, 0), 0))
        self.assertEqual(state.p[:, 0].tolist(), [0, 500000, 0])
        self.assertEqual(state.v[:, 0].tolist(), [0, 0, 0])
        self.assertTrue(state.rest[0])
        self.assertGreater(state.v[0, 1], 0)

    def test_two_bodies_push_each_other_apart_alike(self):
        of = worlds.stream(predictor="contact")
        state = worlds.world(of, {0: ((0, 500000, 0), (0, 0, 0)), 5: ((30000, 500000, 0), (0, 0, 0))}).state
        predict.step(state, of, {4: 0}, Drive((0, 0, 0), 0))
        self.assertEqual(state.v[0, 0], -state.v[0, 5])

    def test_only_sixteen_bodies_of_a_cell_take_part(self):
        cells = np.array([3] * 20 + [4] * 2)
        a, b = pairs.candidates(cells, 2)
        self.assertEqual(sorted(set(a.tolist() + b.tolist())), [*range(16), 20, 21])
        self.assertEqual(len(a), 16 * 15 // 2 + 16 * 2 + 1)
        self.assertTrue((cells[a] <= cells[b]).all())

    def test_constants_out_of_range_and_of_another_number_are_refused(self):
        for constants in ([], worlds.CONTACT[:-1], [*worlds.CONTACT, 0], [17, *worlds.CONTACT[1:]]):
            with self.subTest(constants=constants), self.assertRaises(Exception) as caught:
                contact.read_world(constants)
            self.assertEqual(caught.exception.rule, "session")

    def test_a_step_that_takes_too_long_is_refused(self):
        for predictor, most in (("contact", 731_707), ("field", 1_463_414), ("hard", 2**18), ("rigid", 2**14)):
            turns = predictor == "rigid"
            types = 4 if turns else 2
            worlds.stream(predictor=predictor, capacity=most, types=types, turns=turns)
            with self.subTest(predictor=predictor), self.assertRaises(Exception) as caught:
                worlds.stream(predictor=predictor, capacity=most + 1, types=types, turns=turns)
            self.assertEqual(caught.exception.rule, "session")
        with_planes = [*worlds.HARD[:8], 256, 0, 0, *worlds.HARD[11:15], *[0] * 1024]
        worlds.stream(predictor="hard", capacity=187_500, constants=with_planes)
        with self.assertRaises(Exception):
            worlds.stream(predictor="hard", capacity=187_501, constants=with_planes)


class Integers(unittest.TestCase):
    def test_root(self):
        values = np.array([0, 1, 3, 4, 2**52 - 1, (2**31 - 1) ** 2 - 1, (2**31 - 1) ** 2, 2**62])
        self.assertEqual(integers.root(values).tolist(), [0, 1, 1, 2, 2**26 - 1, 2**31 - 2, 2**31 - 1, 2**31])

    def test_towards_zero(self):
        self.assertEqual(integers.towards_zero(np.array([7, -7, -1]), np.array([2, 2, 2])).tolist(), [3, -3, 0])

    def test_sixteen_bits(self):
        self.assertEqual(pairs.short(np.array([32767, 32768, -32769, 65536])).tolist(), [32767, -32768, 32767, 0])


if __name__ == "__main__":
    unittest.main()
