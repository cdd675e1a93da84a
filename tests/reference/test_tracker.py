"""The codec tracker."""

import unittest

import numpy as np
import worlds
import writer
from refusals import RefusalCase
from tandem_reference import payload, tracker

# One body of threshold 100, never corrected before; all models as at the start. Its code stream is the byte 0e:
# flag:   bound 0fffffff of 65536ths 4096: code 0e000000 is below: 1, corrected; range 0fffffff
# rest:   bound 00ffffff of 65536ths 4096: not below: 0; code 0d000001, range 0f000000
# zero x: bound 07800000: not below: 0; code 05800001, range 07800000
# zero y: bound 03c00000: not below: 0; code 01c00001, range 03c00000; z is not asked
# sign z: bound 01e00000: below: 1, negative; range 01e00000
# more than 1: bound 00f00000: not below: 0
ONE_STEP_DOWN_Z = bytes.fromhex("83 02 00 0e")


class TrackerCase(RefusalCase):
    def setUp(self):
        self.stream = worlds.stream("tracker")
        self.world = worlds.world(self.stream, {0: ((0, 0, 0), (0, 0, 0))})

    def apply(self, data):
        return payload.apply_delta(self.world, self.stream, data)

    def section(self, steps, **arguments):
        return writer.tracker_section(self.world, self.world.parameters[1], steps, **arguments)


class Decisions(TrackerCase):
    def test_a_correction_by_hand(self):
        state = self.apply(ONE_STEP_DOWN_Z).state
        # unit = 100 * 60293 / 65536 = 91; for_v = 128 * 26214 / 2; 91 * 1677696 / 65536 = 2330; for_c = 503290 / 9; 91 * 55921 / 65536 = 78
        self.assertEqual(state.p[:, 0].tolist(), [0, 0, -91])
        self.assertEqual(state.v[:, 0].tolist(), [0, 0, -2330])
        self.assertEqual(state.c[:, 0].tolist(), [0, 0, -78])
        self.assertEqual(state.codec[:, 0].tolist(), [0, 1, 0, 0, -1])

    def test_models_learn_by_hand(self):
        models = self.apply(ONE_STEP_DOWN_Z).models
        learnt = {tracker.FLAG + 45: (4096 + 65536) // 2, tracker.REST: 2048, tracker.ZERO: 16384, tracker.ZERO + 120: 16384,
                  tracker.SIGN + (54 + 9 + 3 + 1) * 4: 49152, tracker.SIZE: 16384}  # fmt: skip
        self.assertEqual({int(i): int(models.p[i]) for i in np.flatnonzero(models.weight)}, learnt)
        self.assertEqual(models.weight.max(), 1)
        self.assertEqual(self.world.models.weight.max(), 0)

    def test_an_empty_delta_teaches_and_ages(self):
        after = self.apply(b"")
        self.assertEqual((after.state.codec[0, 0], after.models.p[45], after.models.weight[45]), (1, 2048, 1))
        self.world.state.codec[0, 0] = 254
        self.assertEqual(self.apply(b"").state.codec[0, 0], 254)

    def test_probability_and_weight_have_limits(self):
        models = tracker.Models()
        many = np.zeros_like(models.weight)
        many[:2] = 10**6, 300
        models.learn(many, np.zeros_like(many))
        self.assertEqual((models.p[0], models.weight[0], models.weight[2]), (32, 255, 0))
        models.learn(np.zeros_like(many), many)
        self.assertEqual(models.p[0], 65504)
        self.assertEqual(models.p[1], (256 * 32 + 65536 * 300) // (256 + 300))

    def test_buckets(self):
        self.assertEqual(tracker.bucket(np.array([0, 1, 2, 4, 5, 6, 7, 250, 251, 255])).tolist(),
                         [0, 1, 2, 4, 5, 5, 6, 13, 14, 14])  # fmt: skip

    def test_streams_that_are_refused(self):
        for rule, bad in (
            ("stream", "830100"),  # empty
            ("stream", "8303000e00"),  # ends with a zero
            ("stream", "8307000e0000000001"),  # a byte left over
            ("corrections", "8302 0010"),  # nobody corrected
            ("values", "8305000100000e"),  # too many steps
        ):
            with self.subTest(bytes=bad):
                self.refused(rule, self.apply, bytes.fromhex(bad))

    def test_steps_of_any_size_come_back(self):
        for size in (*range(1, 19), 24, 25, 32, 33, 48, 49, 63, 64, 65, 66, 67, 126, 127, 128, 1000, 2**20, 2**31 - 1):
            for sign in (1, -1):
                state = self.apply(self.section({0: [0, sign * size, sign]})).state
                self.assertEqual(state.codec[2:, 0].tolist(), [0, sign * min(size, 127), sign])


class Filter(TrackerCase):
    def test_steps_that_agree_are_trusted(self):
        for _ in range(3):
            self.world = self.apply(b"")
        self.world = self.apply(self.section({0: [0, 3, 0]}))
        # interval 4; unit = 100 * 62259 >> 16 = 94 (95 less); for_v: 128 * 26214 / 4 = 838848
        self.assertEqual(self.world.state.codec[:, 0].tolist(), [0, 4, 0, 3, 0])
        self.assertEqual(self.world.state.p[1, 0], 3 * 94)
        self.assertEqual(self.world.state.v[1, 0], 3 * ((94 * 838848 + 2**15) >> 16))
        # for_c: 128 * 26214 * 9830 >> 16 = 503290, over 16: 31455; 94 * 31455 in 65536ths, rounded: 45
        self.assertEqual(self.world.state.c[1, 0], 3 * 45)
        v, c = self.world.state.v[1, 0], self.world.state.c[1, 0]
        self.world = self.apply(b"")
        self.world = self.apply(self.section({0: [0, 2, 0]}))
        # agreement is cut to 256: trust 384, one and a half; now = 2: over 3
        one = (((94 * (128 * 26214 // 3) + 2**15) >> 16) * 384 + 128) >> 8
        self.assertEqual(self.world.state.v[1, 0], v + 2 * one)
        one = (((94 * (503290 // 9) + 2**15) >> 16) * 384 + 128) >> 8
        self.assertEqual(self.world.state.c[1, 0], c + 2 * one)

    def test_a_long_step_of_a_body_corrected_in_the_frame_before_is_an_error_of_velocity(self):
        self.world = self.apply(self.section({0: [0, 3, 0]}))
        # unit = 100 * 62259 >> 16 = 94; v takes all of it, c a ninth without trust
        self.assertEqual(self.world.state.v[1, 0], 64 * 3 * 94)
        self.assertEqual(self.world.state.c[1, 0], 3 * ((94 * (503290 // 9) + 2**15) >> 16))

    def test_a_body_put_to_rest_holds_itself_up_and_wakes_when_it_is_corrected_again(self):
        gravity = (5, -640, 0)
        self.world.state.v[:, 0] = 0, -640, 0
        data = self.section({0: [0, 2, 0]}, rests=(0,))
        self.world = payload.apply_delta(self.world, self.stream, data, gravity)
        state = self.world.state
        self.assertEqual((state.rest[0], state.p[1, 0]), (1, 2 * 94))
        self.assertEqual((state.v[:, 0].tolist(), state.c[:, 0].tolist()), ([0, 0, 0], [-5, 640, 0]))
        contexts = tracker.Contexts(state, np.zeros(1, bool), 100)
        self.assertEqual((contexts.flag[0], contexts.rest[0]), (tracker.FLAG_AT_REST + 1, tracker.REST + 15))
        awake = payload.apply_delta(self.world, self.stream, self.section({0: [0, 0, 1]}), gravity).state
        self.assertEqual((awake.rest[0], awake.c[1, 0]), (0, 640))
        self.assertGreater(awake.v[2, 0], 0)

    def test_c_reaches_twice_gravity(self):
        for _ in range(40):
            data = self.section({0: [0, 10**6, 0]})
            self.world = payload.apply_delta(self.world, self.stream, data, (0, -50000, 0))
        self.assertEqual(self.world.state.c[1, 0], 100000)

    def test_the_context_of_rest_knows_speeds(self):
        self.world.state.v[1, 0] = -2001
        contexts = tracker.Contexts(self.world.state, np.zeros(1, bool), 100)
        self.assertEqual(contexts.rest[0], tracker.REST + 1)
        self.world.state.v[1, 0] = 6401
        contexts = tracker.Contexts(self.world.state, np.zeros(1, bool), 100)
        self.assertEqual(contexts.rest[0], tracker.REST + 2)

    def test_single_steps_of_three_axes(self):
        state = self.apply(self.section({0: [1, -1, 1]})).state
        self.assertEqual(state.p[:, 0].tolist(), [58, -58, 58])  # 100 * 38666 >> 16

    def test_contact_takes_a_third_at_first(self):
        self.stream = worlds.stream("tracker", "contact")
        state = self.apply(ONE_STEP_DOWN_Z).state
        self.assertEqual(state.v[2, 0], -((91 * (128 * 26214 // 3) + 2**15) >> 16))

    def test_c_is_kept_within_the_threshold(self):
        self.world.parameters.update({1: 1, 5: 65535, 6: 65535})
        self.world.state.codec[0, 0] = 2
        state = self.apply(self.section({0: [2**20, 0, 0]})).state
        self.assertEqual(state.c[0, 0], 256)

    def test_a_correction_wakes(self):
        self.world.state.rest[0] = 1
        self.assertTrue(self.apply(b"").state.rest[0])
        self.assertFalse(self.apply(ONE_STEP_DOWN_Z).state.rest[0])


class Renewed(TrackerCase):
    def test_a_body_renewed_starts_anew(self):
        self.world = self.apply(ONE_STEP_DOWN_Z)
        self.world = self.apply(b"")
        place = writer.position((5, 5, 5), (6000, 6000, 6000))
        teleport = writer.section(0x81, writer.record(0, 2, b"\1", place))
        teleported = self.apply(teleport)
        self.assertEqual(teleported.state.codec[:, 0].tolist(), [0, 0, 0, 0, 0])
        between = payload.World(teleported.state, self.world.parameters, self.world.models)
        renewed = np.arange(8) == 0
        section = writer.tracker_section(between, 100, {0: [1, 0, 0]}, renewed)
        after = self.apply(teleport + section)
        self.assertEqual(after.state.codec[:, 0].tolist(), [0, 1, 1, 0, 0])
        self.assertEqual(after.state.v[:, 0].tolist(), [6000 + 2330, 6000, 6000])

    def test_a_type_change_does_not_renew(self):
        self.world = self.apply(ONE_STEP_DOWN_Z)
        after = self.apply(bytes.fromhex("8102 0301"))
        self.assertEqual(after.state.codec[:, 0].tolist(), [1, 1, 0, 0, -1])


class Blocks(RefusalCase):
    def test_blocks_share_models_that_learn_once_a_delta(self):
        of = worlds.stream("tracker", capacity=16386)
        world = worlds.world(of, {0: ((0, 0, 0), (0, 0, 0)), 16385: ((0, 0, 0), (0, 0, 0))})
        sections = [writer.tracker_section(world, 100, {slot: [1, 0, 0]}, block=i) for i, slot in ((0, 0), (1, 16385))]
        after = payload.apply_delta(world, of, b"".join(sections))
        self.assertEqual(after.state.p[0, [0, 16385]].tolist(), [91, 91])
        self.assertEqual((after.models.p[45], after.models.weight[45]), ((4096 + 2 * 65536) // 3, 2))
        one = payload.apply_delta(world, of, sections[1])
        self.assertEqual((one.models.weight[45], one.state.codec[0, 0]), (1, 1))
        self.refused("stream", payload.apply_delta, world, of, sections[1] + sections[0])
        last = writer.section(0x83, b"\1" + sections[1][1:])
        self.assertEqual(payload.apply_delta(world, of, last).state.hash(), one.state.hash())
        self.refused("order", payload.apply_delta, world, of, last + sections[0])


if __name__ == "__main__":
    unittest.main()
