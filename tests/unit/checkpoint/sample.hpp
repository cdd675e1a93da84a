#pragma once
// A small checkpoint with something of everything in it.

#include "services/host/checkpoint/checkpoint.hpp"

namespace tandem::checkpoint {

inline Checkpoint sample(Epoch epoch = 1'700'000'000'000, Frame frame = 120) {
  Checkpoint c;
  c.session = "arena";
  c.scene = "half_pipe";
  c.engine = "particles";
  c.program = "0.1.0";
  c.epoch = epoch;
  c.frame = frame;
  c.wall_ms = 1'700'000'004'000;
  c.dt_s = 0.0625;
  c.lattice_unit = 0.001;
  c.gravity = {0, -9.5, 0.25};
  c.damping_per_s = 0.125;
  c.bodies = 2;
  c.types = {"ball", "cube"};
  c.next_reuse = {1, 255, 0, 7};
  c.withheld = {0, 0, 0, 1};
  StreamParameters parameters;
  parameters.codec.threshold = 4096;
  parameters.step.decay = 600;
  c.streams = {{"thin", 0x1234567890ABCDEF, 0, parameters}, {"rich", 42, 0, parameters}};
  c.last_input = 9;
  c.scheduled = {{8, frame + 1, {1, {0, -9, 1}, {}}}, {9, frame + 2, {1, {0, -8, 1}, {}}}};
  c.immediate = {{2, {0, 0, 0, 1, 2, 3, 4}, {}}, {16, {}, {std::byte{1}, std::byte{2}}}};
  c.clients = {{77, {{1, 2, 3}}, 12, {{11, frame - 1, 0}, {12, 0, 3}}}};
  c.engine_state = {std::byte{5}, std::byte{6}, std::byte{7}};
  return c;
}

}  // namespace tandem::checkpoint
