#pragma once
// A host with several streams of one world, and clients that name the one they play.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/frame_bundle.hpp"
#include "tests/unit/host/fakes.hpp"

namespace tandem::host {

inline constexpr std::uint32_t kThin = 0, kRich = 1;

[[nodiscard]] inline HostConfig two_streams() {
  HostConfig config = test_config();
  config.streams.push_back(config.streams[0]);
  config.streams[kThin].name = "thin";
  config.streams[kRich].name = "rich";
  config.streams[kRich].layout.codec = "tracker";
  return config;
}

struct StreamsBench {
  explicit StreamsBench(const HostConfig& config) : bench(config) {
    bench.simulation.on_step = [this](std::uint64_t step) {
      for (std::size_t body = 0; body < bench.simulation.alive.size(); ++body)
        bench.simulation.position[1][body] += 0.05F * static_cast<float>((step + body) % 7) - 0.15F;
      if (step % 11 == 0) bench.simulation.alive[3] ^= 1U;
    };
    bench.poll();
    bench.run_to(10);
  }

  transport::AckMessage ack_of(transport::ClientId client, std::uint32_t stream, transport::Phase phase,
                               Frame applied, std::uint32_t attempt = 1) const {
    auto ack = bench.ack(client, phase, applied, transport::Role::kParticipant, attempt);
    ack.stream.id = stream;
    return ack;
  }
  void joining(transport::ClientId client, std::uint32_t stream, std::uint32_t attempt = 1) {
    bench.send(ack_of(client, stream, transport::Phase::kJoining, 0, attempt));
  }
  void playing(transport::ClientId client, std::uint32_t stream, std::uint32_t attempt = 1) {
    bench.send(ack_of(client, stream, transport::Phase::kPlaying, bench.host->frame(), attempt));
  }
  /// Says that it joins `stream` while it goes on with the one it plays.
  void changing(transport::ClientId client, std::uint32_t stream, std::uint32_t attempt) {
    bench.send(ack_of(client, stream, transport::Phase::kJoining, bench.host->frame(), attempt));
  }
  [[nodiscard]] StreamTotals totals(std::uint32_t stream) const {
    return bench.host->totals().streams[stream];
  }
  [[nodiscard]] std::size_t deltas_of(std::uint32_t stream) const {
    return static_cast<std::size_t>(
        std::ranges::count(bench.port.deltas, stream, [](const auto& delta) { return delta.stream.id; }));
  }
  [[nodiscard]] std::size_t snapshots_of(std::uint32_t stream) const {
    return static_cast<std::size_t>(std::ranges::count(
        bench.port.snapshots, stream, [](const auto& snapshot) { return snapshot.stream.id; }));
  }
  /// Returns the state that a client of `stream` computes from its last snapshot and all that was published.
  ClientTimeline follow(std::uint32_t stream) const {
    const auto& session = bench.host->session();
    ClientTimeline client = std::move(*ClientTimeline::create(session.streams[stream].layout));
    const auto cut = std::find_if(bench.port.snapshots.rbegin(), bench.port.snapshots.rend(),
                                  [stream](const auto& snapshot) { return snapshot.stream.id == stream; });
    EXPECT_TRUE(client.load(cut->bytes, session.epoch, cut->stream));
    auto input = bench.port.scheduled.begin();
    for (const auto& delta : bench.port.deltas) {
      if (delta.stream.id != stream || delta.frame <= cut->frame) continue;
      for (; input != bench.port.scheduled.end() && input->number <= delta.last_input; ++input) {
        EXPECT_TRUE(client.schedule({input->number,
                                     input->frame,
                                     {{input->values[0], input->values[1], input->values[2]},
                                      static_cast<std::uint16_t>(input->values[3])}}));
      }
      for (const transport::FrameRun& run : transport::read_frames(delta)) {
        for (Frame frame = run.last - run.before; frame <= run.last; ++frame) {
          if (frame <= cut->frame) continue;
          const auto applied = client.apply(frame, delta.last_input, run.hash, run.payload);
          EXPECT_TRUE(applied) << applied.error().message;
          if (!applied) return client;
        }
      }
    }
    return client;
  }

  Bench bench;
};

}  // namespace tandem::host
