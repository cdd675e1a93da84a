#include "services/program/configuration/common.hpp"

#include "services/program/configuration/form.hpp"

namespace tandem::configuration {
namespace {

std::string text_in(const google::protobuf::Message& config, const char* name) {
  return text_of(*config.GetDescriptor()->FindFieldByName(name), config);
}

}  // namespace

void add_log_flags(commandline::Command command, logging::LogOptions& options) {
  const Setting &format = common("log_format"), &level = common("log_level");
  const auto set_format = [&options](const std::string& text) { options.json = text == "json"; };
  command.add_option_function<std::string>(format.flag, set_format, format.text()).one_of(format.words);
  command.add_option(level.flag, options.level, level.text()).one_of(level.words);
}

void add_metrics_flag(commandline::Command command, std::optional<metrics::Address>& address) {
  const Setting& setting = common("metrics");
  command.add_option_function<std::string>(
      setting.flag,
      [&address, &setting](const std::string& text) {
        auto read = metrics::read_address(text);
        if (!read) commandline::refuse(setting.flag, read.error().message);
        address = std::move(*read);
      },
      setting.text());
}

logging::LogOptions log_of(const google::protobuf::Message& config) {
  return {.json = text_in(config, "log_format") == "json", .level = text_in(config, "log_level")};
}

Result<std::optional<metrics::Address>> metrics_of(const google::protobuf::Message& config) {
  const std::string text = text_in(config, "metrics");
  if (text.empty()) return std::nullopt;
  auto address = metrics::read_address(text);
  if (!address) return fail(address.error().code, common("metrics").flag + ": " + address.error().message);
  return std::move(*address);
}

}  // namespace tandem::configuration
