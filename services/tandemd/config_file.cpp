// The configuration file of tandemd (idl/server.proto).
#include <fmt/format.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <fstream>
#include <iterator>

#include "server.pb.h"
#include "services/tandemd/options.hpp"

namespace tandem::daemon {
namespace {

// Keeps the first error as one line; protobuf counts lines and columns from 0.
class FirstError final : public google::protobuf::io::ErrorCollector {
 public:
  explicit FirstError(std::string path) : path_(std::move(path)) {}
  void AddError(int line, int column, const std::string& message) override {
    if (text_.empty()) text_ = fmt::format("{}:{}:{}: {}", path_, line + 1, column + 1, message);
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string path_;
  std::string text_;
};

Settings settings_of(const idl::ServerConfig& file) {
  Settings settings;
  if (file.has_scene()) settings.scene = file.scene();
  if (file.has_bodies()) settings.bodies = file.bodies();
  if (file.has_session()) settings.session = file.session();
  if (file.has_domain()) settings.domain = file.domain();
  if (file.has_codec()) settings.codec = file.codec();
  if (file.has_predictor()) settings.predictor = file.predictor();
  if (file.has_threshold()) settings.threshold = file.threshold();
  if (file.has_threshold_scale()) settings.threshold_scale = file.threshold_scale();
  if (file.has_threshold_auto()) settings.automatic = file.threshold_auto();
  if (file.has_target_bandwidth()) settings.target_bandwidth = file.target_bandwidth();
  if (file.has_max_error()) settings.max_error = file.max_error();
  if (file.has_budget_bytes()) settings.budget_bytes = file.budget_bytes();
  if (file.has_window()) settings.window = file.window();
  if (file.has_lead()) settings.lead = file.lead();
  if (file.has_rate()) settings.rate = file.rate();
  if (file.has_stall_timeout()) settings.stall_timeout = file.stall_timeout();
  if (file.has_client_limit()) settings.client_limit = file.client_limit();
  if (file.has_wait_for()) settings.wait_for = file.wait_for();
  if (file.has_duration()) settings.duration = file.duration();
  if (file.has_threads()) settings.threads = file.threads();
  if (file.has_seed()) settings.seed = file.seed();
  if (file.has_scripted()) settings.scripted = file.scripted();
  if (file.has_users()) settings.users = file.users();
  if (file.has_hash_log()) settings.hash_log = file.hash_log();
  return settings;
}

}  // namespace

Result<Settings> load_config(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ErrorCode::kIo, fmt::format("{}: cannot be opened", path));
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) return fail(ErrorCode::kIo, fmt::format("{}: cannot be read", path));
  idl::ServerConfig file;
  FirstError errors(path);
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&errors);
  if (!parser.ParseFromString(text, &file)) return fail(ErrorCode::kMalformed, errors.text());
  return settings_of(file);
}

}  // namespace tandem::daemon
