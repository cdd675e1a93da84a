// `tandem record`: an observer that writes what it receives into a file.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <optional>
#include <utility>

#include "services/program/configuration/common.hpp"
#include "services/program/process/heap.hpp"
#include "services/program/process/signal_watch.hpp"
#include "services/tool/client_options.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/headless_client.hpp"
#include "services/tool/log_options.hpp"
#include "services/tool/record_metrics.hpp"

namespace tandem::tool {
namespace {

struct RecordOptions {
  HeadlessOptions client;
  std::string to = "mcap";
  std::optional<double> keep_s;
  std::optional<double> keep_mb;
  bool plain = false;
  bool json = false;
  std::optional<metrics::Address> metrics;  ///< empty: none are served
  logging::LogOptions log;
};

/// What was published for an audience, and what of it is still there.
Json report(const HeadlessClient& client, const audience::Writer& writer) {
  const audience::Writer::Totals& totals = writer.totals();
  Json out = client.report();
  out["frames_recorded"] = totals.frames;
  out["payload_recorded_bytes"] = totals.payload_bytes;
  out["segments"] = totals.segments;
  out["segment_bytes"] = totals.segment_bytes;
  out["snapshots"] = totals.snapshots;
  out["snapshot_bytes"] = totals.snapshot_bytes;
  out["manifests"] = totals.manifests;
  out["manifest_bytes"] = totals.manifest_bytes;
  out["objects"] = totals.objects;
  out["object_bytes"] = totals.object_bytes;
  return out;
}

Json report(const HeadlessClient& client) {
  if (client.publication() != nullptr) return report(client, *client.publication());
  const recording::Recorder::Totals& totals = client.recorder()->totals();
  Json out = client.report();
  out["file"] = client.recorder()->file().path();
  // Sizes of the whole file and of its parts besides payloads.
  out["file_bytes"] = totals.file_bytes;
  out["frames_recorded"] = totals.frames;
  out["payload_recorded_bytes"] = totals.payload_bytes;
  out["start_bytes"] = totals.start_bytes;
  out["fixed_bytes"] = totals.fixed_bytes;
  out["snapshots_cut"] = totals.snapshots_cut;
  for (const auto& [topic, share] : totals.topics) {
    out["topics"][topic] = {{"messages", share.messages}, {"bytes", share.bytes}};
  }
  return out;
}

/// Has the log name the epoch that is recorded, and the metrics follow the client.
class Watch final : public TurnListener {
 public:
  explicit Watch(RecordMetrics& metrics) : metrics_(metrics) {}
  void turned(const client::ClientCore& core, const Kept& kept, std::int64_t now_ns) override {
    if (const auto* const session = core.session(); session != nullptr && session->epoch != epoch_) {
      epoch_ = session->epoch;
      logging::set_context(session->session, epoch_);
    }
    metrics_.turned(core, kept, now_ns);
  }

 private:
  RecordMetrics& metrics_;
  std::uint64_t epoch_ = 0;
};

int run_record(RecordOptions options) {
  begin_log("tandem record", options.log, options.client.wanted_session());
  SignalWatch signals("tandem record", SignalWatch::Hangup::kStop, {&transport::dds_fault, &logging::error});
  const HeapTrimmer trimmer;
  options.client.observe = true;
  options.client.lead = 0;  // nothing is drawn
  options.client.log = &logging::write;
  if (!options.plain) options.client.compression = recording::Compression::kZstd;
  const std::string target = options.client.capture;
  if (options.to == "http") {
    options.client.publish = std::exchange(options.client.capture, {});
    options.client.publication.keep_ns = static_cast<std::int64_t>(options.keep_s.value_or(0) * 1e9);
    options.client.publication.keep_bytes = static_cast<std::uint64_t>(options.keep_mb.value_or(0) * 1e6);
  }
  RecordMetrics metrics;
  if (options.metrics) {
    const auto served = metrics.serve(*options.metrics, options.client.wanted_session(), target);
    if (!served) {
      spdlog::error(served.error().message);
      return signals.finish(1);
    }
  }
  auto client = HeadlessClient::create(options.client);
  if (!client) {
    spdlog::error(client.error().message);
    return signals.finish(1);
  }
  Watch watch(metrics);
  (*client)->run(signals.stop(), &watch);
  if (options.json) {
    fmt::print("{}\n", report(**client).dump());
  } else if (const audience::Writer* const published = (*client)->publication()) {
    fmt::print("{}: {} frames in {} segments; {} objects with {} bytes\n", options.client.publish,
               published->totals().frames, published->totals().segments, published->totals().objects,
               published->totals().object_bytes);
  } else {
    const recording::Recorder::Totals& totals = (*client)->recorder()->totals();
    fmt::print("{}: {} frames, {} bytes, {} of them deltas\n", (*client)->recorder()->file().path(),
               totals.frames, totals.file_bytes, totals.payload_bytes);
  }
  return signals.finish((*client)->succeeded() ? 0 : 1);
}

}  // namespace

void add_record(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "record", "Records a session: into a file (MCAP), for `tandem replay`, or for an audience.");
  const auto options = std::make_shared<RecordOptions>();
  HeadlessOptions& client = options->client;
  command.add_option("file", client.capture, "File to write, FILE.mcap; with --to http a folder").required();
  command.add_choice<std::string>(
      "--to", options->to, {{"mcap", "mcap"}, {"http", "http"}},
      "mcap: one file. http: a folder that a web server serves to an audience, also while "
      "it is written (default: mcap)");
  command
      .add_option("--keep", options->keep_s,
                  "With --to http: seconds of the session that stay to be played; older files are removed "
                  "(default: all)")
      .positive();
  command
      .add_option(
          "--keep-mb", options->keep_mb,
          "With --to http: megabytes that the folder may have; older files are removed (default: all)")
      .positive();
  client.prefer = "bandwidth";
  add_client_options(command, client);
  command.add_option("--timeout", client.timeout_s, "Seconds to wait for the first frame (default: for ever)")
      .positive();
  command
      .add_option("--seconds", client.seconds,
                  "Seconds to record, counted from the first applied frame (default: until stopped)")
      .positive();
  command.add_flag(
      "--overwrite", client.overwrite,
      "Replace FILE if it exists. Without it FILE stays, and the recording becomes FILE-2, FILE-3, "
      "...; with --to http, the recording goes on behind what is there");
  command.add_flag("--no-compression", options->plain, "Write chunks without compression by zstd");
  command.add_option("--hash-log", client.hash_log,
                     "File to which a line `epoch,frame,hash` is added for every applied frame");
  configuration::add_metrics_flag(command, options->metrics);
  configuration::add_log_flags(command, options->log);
  command.add_flag("--json", options->json, "Print the result as one JSON object");
  command.footer(
      "The file holds all that a client receives (TandemSession, TandemSnapshot, TandemScheduledInput, "
      "TandemDelta, TandemReply\n"
      "to this client, TandemServerStatus), all that it sends, and a snapshot of the agreed state once a "
      "minute. It can be read\n"
      "while it grows. Until the first snapshot it is called FILE.part.\n"
      "With --to http the folder gets manifest.json and objects (idl/AUDIENCE.md), which the viewer plays with\n"
      "`?from=` and their address.\n"
      "Exits with 1 on any hash mismatch, if no frame came at all or for 5 s before the end though the server neither ended nor\n"
      "paused, or if the file could not be written.");
  command.on_chosen([options, &run] {
    if (options->to != "http" && (options->keep_s || options->keep_mb))
      commandline::refuse(options->keep_s ? "--keep" : "--keep-mb", "only with --to http");
    if (options->to == "http" && options->plain)
      commandline::refuse("--no-compression", "not with --to http");
    run = [options] { return run_record(*options); };
  });
}

}  // namespace tandem::tool
