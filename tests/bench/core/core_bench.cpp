// A frame of server and client at 10,000 bodies, a tenth of them corrected. Seeded; same bytes every run.

#include <benchmark/benchmark.h>
#include <time.h>

#include <memory>
#include <string>
#include <vector>

#include "sdk/core/predict/ballistic/ballistic.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/workers/block_threads.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kBodies = 10000;
constexpr std::size_t kFrames = 200;
constexpr std::uint64_t kSeed = 42;

struct Delta {
  Frame frame;
  std::uint64_t hash;
  std::vector<std::byte> payload;
};

struct Recording {
  Layout layout;
  std::vector<std::byte> snapshot;
  std::vector<Delta> deltas;
  std::shared_ptr<ServerTimeline> server;  // after the last of them
  double corrected = 0;
};

struct ServerTimes {
  DurationHistogram predict, encode, hash;
};

double median_us(const DurationHistogram& durations) { return 1e3 * durations.quantile_ms(0.5); }

// Time of this thread on a core: what others run on the machine does not count.
std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// Bodies in a box of 2^23 units whose full simulation pushes one in ten beyond the threshold each frame.
Recording record(std::string_view codec, ServerTimes& times) {
  Recording r;
  r.layout.capacity = kBodies;
  r.layout.type_count = synthetic::kTypes;
  r.layout.codec = codec;
  r.layout.codec_tables = synthetic::tables_for(codec);
  r.layout.parameters = {{4096, 256, 1024}};
  r.layout.predictor = "ballistic";
  synthetic::Random random(kSeed);
  State state(kBodies);
  const auto vector = [&random](std::int32_t limit) {
    return Vec3i{random.even(limit), random.even(limit), random.even(limit)};
  };
  for (Slot slot = 0; slot < kBodies; ++slot) state.spawn(slot, 0, 0, {vector(1 << 22), vector(1 << 19)});
  r.server = std::make_shared<ServerTimeline>(*ServerTimeline::create(r.layout, 1));
  ServerTimeline& server = *r.server;
  server.set_clock(now_ns);
  server.start(0, state, Drive{{0, -2000, 0}, 300});
  server.snapshot(r.snapshot);
  Ballistic predictor;
  State target(kBodies);
  for (std::size_t i = 0; i < kFrames; ++i) {
    predictor.step(server.state(), target, {server.drive(), server.parameters().step});
    for (Slot slot = 0; slot < kBodies; ++slot) {
      if (!random.one_in(10)) continue;
      BodyState body = target.body(slot);
      body.p[random.below(3)] += random.one_in(2) ? 5000 : -5000;
      for (std::int32_t& p : body.p) p += random.even(800);
      for (std::int32_t& v : body.v) v += random.value(100000);
      target.set_body(slot, body);
    }
    const auto frame = server.advance(target, {});
    r.deltas.push_back({frame.frame, frame.hash, {frame.payload.begin(), frame.payload.end()}});
    r.corrected += static_cast<double>(frame.corrected) / kFrames;
    times.predict.add(frame.predict_ns);
    times.encode.add(frame.encode_ns);
    times.hash.add(frame.hash_ns);
  }
  return r;
}

void server_frame(benchmark::State& bench, std::string_view codec) {
  ServerTimes times;
  Recording r;
  for (auto _ : bench) r = record(codec, times);
  double bytes = 0;
  for (const Delta& delta : r.deltas) bytes += static_cast<double>(delta.payload.size()) / kFrames;
  bench.counters["predict_us"] = median_us(times.predict);
  bench.counters["encode_us"] = median_us(times.encode);
  bench.counters["hash_us"] = median_us(times.hash);
  bench.counters["corrected"] = r.corrected;
  bench.counters["bytes"] = bytes;
}

// Writing and loading a snapshot in the middle of a session.
void snapshot(benchmark::State& bench, std::string_view codec) {
  ServerTimes ignored;
  const Recording r = record(codec, ignored);
  auto client = *ClientTimeline::create(r.layout);
  DurationHistogram write, load;
  std::vector<std::byte> bytes;
  for (auto _ : bench) {
    const std::int64_t start = now_ns();
    r.server->snapshot(bytes);
    const std::int64_t written = now_ns();
    if (!client.load(bytes, 1)) bench.SkipWithError("snapshot refused");
    load.add(now_ns() - written);
    write.add(written - start);
  }
  bench.counters["write_us"] = median_us(write);
  bench.counters["load_us"] = median_us(load);
  bench.counters["B_per_body"] = static_cast<double>(bytes.size()) / kBodies;
}

// Lead 1: simulate a frame ahead, then take the delta of the frame before it.
void client_frame(benchmark::State& bench, std::string_view codec) {
  ServerTimes ignored;
  const Recording r = record(codec, ignored);
  auto client = *ClientTimeline::create(r.layout);
  client.set_clock(now_ns);
  DurationHistogram total, decode, apply;
  std::size_t next = kFrames;
  for (auto _ : bench) {
    if (next == kFrames) {
      if (!client.load(r.snapshot, 1)) bench.SkipWithError("snapshot refused");
      client.step(1);
      next = 0;
    }
    const Delta& delta = r.deltas[next++];
    const std::int64_t start = now_ns();
    const bool applied = client.apply(delta.frame, 0, delta.hash, delta.payload).has_value();
    client.step(1);
    const std::int64_t taken = now_ns() - start;
    if (!applied) bench.SkipWithError("delta refused");
    bench.SetIterationTime(static_cast<double>(taken) * 1e-9);
    total.add(taken);
    const ClientTimeline::Timings timings = client.timings();
    decode.add(timings.decode_ns);
    apply.add(timings.hash_ns + timings.predict_ns);
  }
  bench.counters["p50_us"] = median_us(total);
  bench.counters["decode_us"] = median_us(decode);
  bench.counters["apply_us"] = median_us(apply);
}

// Works on blocks side by side: wall time of encode(), decode() and the state hash at 65,536 bodies in four
// blocks.
void blocks_frame(benchmark::State& bench, std::uint32_t threads) {
  constexpr std::uint32_t kMany = 4 * kBlockSlots;
  constexpr StreamParameters kParameters{{4096, 256, 1024}};
  synthetic::Random random(kSeed);
  State state(kMany);
  for (Slot slot = 0; slot < kMany; ++slot)
    state.spawn(slot, 0, 0, {{random.even(1 << 22), random.even(1 << 22), random.even(1 << 22)}, {}});
  const RunBlocks run = blocks_on_threads(threads, Callers::kOne);
  DeltaCodec server = synthetic::make_delta("tracker", kMany, kParameters, run);
  DeltaCodec client = synthetic::make_delta("tracker", kMany, kParameters, run);
  std::vector<std::byte> out(server.bound());
  State held = state;
  State target = state;
  StateHasher hasher;
  DurationHistogram encode, decode, hash;
  for (auto _ : bench) {
    for (Slot slot = 0; slot < kMany; ++slot) {
      if (random.one_in(10)) target.p(random.below(3))[slot] += random.one_in(2) ? 5000 : -5000;
    }
    const std::int64_t start_ns = transport::steady_ns();
    const auto encoded = server.encode(state, target, {}, kNoBudget, out);
    const std::int64_t encoded_ns = transport::steady_ns();
    encode.add(encoded_ns - start_ns);
    const bool good = synthetic::receive(client, held, std::span(out).first(encoded.size_bytes)).has_value();
    const std::int64_t decoded_ns = transport::steady_ns();
    decode.add(decoded_ns - encoded_ns);
    benchmark::DoNotOptimize(hasher.hash(held, {.codec = client.codec().columns(), .predictor = {}}, run));
    hash.add(transport::steady_ns() - decoded_ns);
    if (!good || held != state) bench.SkipWithError("client differs");
  }
  bench.counters["encode_us"] = median_us(encode);
  bench.counters["decode_us"] = median_us(decode);
  bench.counters["hash_us"] = median_us(hash);
}

const bool kRegistered = [] {
  for (const std::string_view codec : codec_names()) {
    benchmark::RegisterBenchmark(("server/" + std::string(codec)).c_str(), server_frame, codec)
        ->Iterations(3)
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(("client/" + std::string(codec)).c_str(), client_frame, codec)
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
    benchmark::RegisterBenchmark(("snapshot/" + std::string(codec)).c_str(), snapshot, codec)
        ->Unit(benchmark::kMillisecond);
  }
  for (const std::uint32_t threads : {1U, 2U}) {
    benchmark::RegisterBenchmark(("blocks/threads:" + std::to_string(threads)).c_str(), blocks_frame, threads)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
  return true;
}();

}  // namespace
}  // namespace tandem
