#include "services/tandemd/configuration/reload.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <array>

#include "services/tandemd/configuration/config.hpp"
#include "services/tandemd/configuration/config_file.hpp"

namespace tandem::daemon {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::util::MessageDifferencer;
using idl::ServerConfig;

bool same(const ServerConfig& a, const ServerConfig& b, const FieldDescriptor& field) {
  MessageDifferencer differencer;
  return differencer.CompareWithFields(a, b, {&field}, {&field});
}

void copy(const ServerConfig& from, const FieldDescriptor& field, ServerConfig& to) {
  ServerConfig one = from;
  one.GetReflection()->SwapFields(&one, &to, {&field});
}

}  // namespace

bool changes_live(std::string_view field) {
  constexpr std::array<std::string_view, 3> kLive{"client_limit", "stall_timeout", "checkpoint_interval"};
  return std::ranges::find(kLive, field) != kLive.end();
}

Rereader::Rereader(std::string path, ServerConfig flags, ServerConfig in_force)
    : path_(std::move(path)), flags_(std::move(flags)), in_force_(std::move(in_force)) {}

Result<Changes> Rereader::read() {
  auto file = load_config(path_);
  if (!file) return tl::unexpected(file.error());
  const ServerConfig wanted = merge(flags_, std::move(file->config));
  // All of it has to be right, or a restart would fail.
  if (const auto good = check_config(wanted, places_beside(flags_, file->places)); !good)
    return tl::unexpected(good.error());
  Changes changes;
  ServerConfig next = in_force_;
  for (int i = 0; i < ServerConfig::descriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *ServerConfig::descriptor()->field(i);
    if (same(wanted, in_force_, field)) continue;
    const bool live = changes_live(field.name());
    (live ? changes.live : changes.after_restart).push_back(field.name());
    if (live) copy(wanted, field, next);
  }
  auto options = check_config(next);
  if (!options) return tl::unexpected(options.error());
  changes.client_limit = options->client_limit;
  changes.stall_timeout_s = options->stall_timeout_s;
  changes.checkpoint_interval_s = options->checkpoint.interval_s;
  in_force_ = std::move(next);
  return changes;
}

}  // namespace tandem::daemon
