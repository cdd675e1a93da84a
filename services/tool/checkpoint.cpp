// tandem checkpoint show|verify: what a file of a server's folder holds.

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/wire/plain_text.hpp"
#include "services/host/checkpoint/disk.hpp"
#include "services/host/checkpoint/format.hpp"
#include "services/program/json/json.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::tool {
namespace {

using checkpoint::Checkpoint;

struct CheckpointOptions {
  std::string file;
  bool json = false;
};

struct File {
  std::uint64_t bytes = 0;
  Checkpoint checkpoint;
};

Result<File> read(const std::string& path) {
  const auto bytes = checkpoint::read_file(path, checkpoint::kMaxFileBytes);
  if (!bytes) return tl::unexpected(bytes.error());
  return checkpoint::decode(*bytes).map([&](Checkpoint&& checkpoint) {
    return File{bytes->size(), std::move(checkpoint)};
  });
}

std::string time_of(std::int64_t wall_ms) {
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(static_cast<std::time_t>(wall_ms / 1000)));
}

Json json_of(const File& file) {
  const Checkpoint& c = file.checkpoint;
  Json streams = Json::array(), clients = Json::array(), types = Json::array();
  for (const checkpoint::StreamState& stream : c.streams) {
    streams.push_back({{"name", stream.name},
                       {"layout_hash", to_hex(stream.layout_hash)},
                       {"generation", stream.generation},
                       {"threshold", stream.parameters.codec.threshold * c.lattice_unit}});
  }
  for (const checkpoint::ClientState& client : c.clients)
    clients.push_back({{"id", to_hex(client.id)}, {"highest_input", client.highest}});
  for (const std::string& type : c.types) types.push_back(type);
  return {{"ok", true},
          {"bytes", file.bytes},
          {"session", c.session},
          {"scene", c.scene},
          {"engine", c.engine},
          {"program", c.program},
          {"epoch", c.epoch},
          {"frame", c.frame},
          {"wall_ms", c.wall_ms},
          {"capacity", c.capacity()},
          {"bodies", c.bodies},
          {"dt_s", c.dt_s},
          {"gravity", Json::array({c.gravity[0], c.gravity[1], c.gravity[2]})},
          {"damping_per_s", c.damping_per_s},
          {"last_input", c.last_input},
          {"scheduled_inputs", c.scheduled.size()},
          {"immediate_inputs", c.immediate.size()},
          {"engine_bytes", c.engine_state.size()},
          {"types", types},
          {"streams", streams},
          {"clients", clients}};
}

std::string text_of(const File& file) {
  const Checkpoint& c = file.checkpoint;
  // A file is untrusted, and a terminal obeys control characters.
  const auto line = [](const char* what, const std::string& value) {
    return fmt::format("{:<9} {}\n", what, transport::plain_text(value, value.size()));
  };
  std::string text =
      line("session",
           fmt::format("{}, scene {}, engine {}", c.session, c.scene, c.engine.empty() ? "-" : c.engine)) +
      line("moment", fmt::format("frame {} of epoch {}, {}", c.frame, c.epoch, time_of(c.wall_ms))) +
      line("bodies", fmt::format("{} in {} slots, {} types", c.bodies, c.capacity(), c.types.size())) +
      line("drive", fmt::format("gravity {:g} {:g} {:g}, damping {:g} /s, step {:.6g} s", c.gravity[0],
                                c.gravity[1], c.gravity[2], c.damping_per_s, c.dt_s)) +
      line("inputs", fmt::format("{} scheduled so far; waiting: {} scheduled, {} immediate", c.last_input,
                                 c.scheduled.size(), c.immediate.size()));
  for (const checkpoint::StreamState& stream : c.streams) {
    text += line("stream",
                 fmt::format("{}, layout {}, threshold {:.4g}", stream.name.empty() ? "-" : stream.name,
                             to_hex(stream.layout_hash), stream.parameters.codec.threshold * c.lattice_unit));
  }
  for (const checkpoint::ClientState& client : c.clients)
    text += line("client", fmt::format("{}, inputs up to {}", to_hex(client.id), client.highest));
  return text + line("file", fmt::format("{} bytes, {} of them the engine's, written by tandem {}",
                                         file.bytes, c.engine_state.size(), c.program));
}

int run_checkpoint(const CheckpointOptions& options, bool show) {
  const auto file = read(options.file);
  if (!file) {
    print_error(fmt::format("tandem: {}: {}\n", options.file, file.error().message));
    if (options.json) fmt::print("{}\n", Json{{"ok", false}, {"error", file.error().message}}.dump());
    return 1;
  }
  if (options.json) {
    fmt::print("{}\n",
               (show ? json_of(*file) : Json{{"ok", true}, {"frame", file->checkpoint.frame}}).dump());
  } else {
    fmt::print("{}", show ? text_of(*file)
                          : fmt::format("{}: good, frame {}\n", options.file, file->checkpoint.frame));
  }
  return 0;
}

}  // namespace

void add_checkpoint(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "checkpoint", "Reads checkpoints, from which a server goes on (tandemd --checkpoint-dir).");
  command.require_subcommand();
  const auto options = std::make_shared<CheckpointOptions>();
  const auto add = [&](const char* name, const char* help, bool show) {
    commandline::Command action = command.add_subcommand(name, help);
    action.add_option("FILE", options->file, "A file of the folder").required();
    action.add_flag("--json", options->json, "Print one JSON object");
    action.footer("Exits with 1 if the file is not a whole checkpoint that this build can read.");
    action.on_chosen(
        [options, show, &run] { run = [options, show] { return run_checkpoint(*options, show); }; });
  };
  add("show", "Prints what a checkpoint is of.", true);
  add("verify", "Checks that a file is a whole checkpoint. Only a server can check that its engine takes it.",
      false);
}

}  // namespace tandem::tool
