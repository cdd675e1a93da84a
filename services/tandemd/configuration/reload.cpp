#include "services/tandemd/configuration/reload.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/message_differencer.h>

#include "services/program/configuration/file.hpp"
#include "services/tandemd/configuration/config.hpp"
#include "services/tandemd/configuration/form.hpp"

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

Rereader::Rereader(std::string path, ServerConfig flags, ServerConfig in_force)
    : path_(std::move(path)), flags_(std::move(flags)), in_force_(std::move(in_force)) {}

Result<Changes> Rereader::read() {
  auto file = load_config(path_);
  if (!file) return tl::unexpected(file.error());
  const ServerConfig wanted = merge(flags_, std::move(file->config));
  // All of it has to be right, or a restart would fail.
  if (const auto good = check_config(wanted, configuration::places_beside(flags_, file->places)); !good)
    return tl::unexpected(good.error());
  Changes changes;
  ServerConfig next = in_force_;
  for (const configuration::Setting& setting : form().settings()) {
    if (same(wanted, in_force_, *setting.field)) continue;
    (setting.live ? changes.live : changes.after_restart).push_back(setting.field->name());
    if (setting.live) copy(wanted, *setting.field, next);
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
