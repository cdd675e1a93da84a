#include "services/tandemd/configuration/config_file.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "services/engines/scenes/text_file.hpp"
#include "services/tandemd/configuration/settings.hpp"

namespace tandem::daemon {
namespace {

namespace pb = google::protobuf;
using idl::ServerConfig;

/// The text between `begin` and the next quotation mark; empty without them.
std::string between(const std::string& text, const std::string& begin) {
  const std::size_t at = text.find(begin);
  if (at == std::string::npos) return {};
  const std::size_t from = at + begin.size();
  const std::size_t end = text.find('"', from);
  return end == std::string::npos ? std::string() : text.substr(from, end - from);
}

/// Says what the field takes, or that there is no such field, in words of the manual.
Error explained(Error error) {
  if (const std::string unknown = between(error.message, "has no field named \""); !unknown.empty()) {
    const std::string place = error.message.substr(0, error.message.find(": "));
    error.message =
        fmt::format("{}: field \"{}\" is unknown; tandemd --print-config shows all", place, unknown);
  } else if (const Setting* setting = find_setting(between(error.message, "field \"")); setting != nullptr) {
    while (error.message.ends_with('.')) error.message.pop_back();
    error.message += fmt::format("; it takes {}", setting->takes);
  }
  return error;
}

std::string place_of(const std::string& path, int line) { return fmt::format("{}:{}", path, line + 1); }

Places places_of(const std::string& path, const ServerConfig& config,
                 const pb::TextFormat::ParseInfoTree& tree) {
  Places places{{"", path}};
  std::vector<const pb::FieldDescriptor*> present;
  config.GetReflection()->ListFields(config, &present);
  for (const pb::FieldDescriptor* field : present)
    places[field->name()] = place_of(path, tree.GetLocation(field, field->is_repeated() ? 0 : -1).line);
  const pb::FieldDescriptor* const streams = ServerConfig::descriptor()->FindFieldByName("stream");
  for (int i = 0; i < config.stream_size(); ++i)
    places["stream:" + config.stream(i).name()] = place_of(path, tree.GetLocation(streams, i).line);
  return places;
}

/// The lines of a comment.
std::string comment(const std::string& text) {
  constexpr std::size_t kWidth = 110;
  std::istringstream words(text);
  std::string out, line = "#";
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > kWidth) {
      out += line + '\n';
      line = "#";
    }
    line += ' ' + word;
  }
  return out + line + '\n';
}

std::string value_of(const ServerConfig& config, const pb::FieldDescriptor& field, int index) {
  pb::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  std::string text;
  printer.PrintFieldValueToString(config, &field, index, &text);
  return field.cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE ? fmt::format("{{ {}}}", text) : text;
}

std::string line_of(const pb::FieldDescriptor& field, const std::string& value) {
  const bool message = field.cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE;
  return fmt::format("{}{} {}\n", field.name(), message ? "" : ":", value);
}

}  // namespace

Result<std::string> read_config_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ErrorCode::kIo, fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
  // Does not use iterators, because they throw if reading fails, for example for a directory.
  std::string text;
  std::array<char, 4096> piece{};
  while (in.read(piece.data(), piece.size()), in.gcount() > 0)
    text.append(piece.data(), static_cast<std::size_t>(in.gcount()));
  if (in.bad()) return fail(ErrorCode::kIo, fmt::format("{}: cannot be read", path));
  return text;
}

Result<ConfigFile> parse_config(const std::string& text, const std::string& path) {
  ConfigFile file;
  pb::TextFormat::ParseInfoTree tree;
  if (auto parsed = scenes::parse_text(text, path, file.config, tree); !parsed)
    return tl::unexpected(explained(parsed.error()));
  file.places = places_of(path, file.config, tree);
  return file;
}

Result<ConfigFile> load_config(const std::string& path) {
  return read_config_text(path).and_then(
      [&path](const std::string& text) { return parse_config(text, path); });
}

Places places_beside(const ServerConfig& flags, Places places) {
  std::vector<const pb::FieldDescriptor*> set;
  flags.GetReflection()->ListFields(flags, &set);
  for (const pb::FieldDescriptor* field : set) places.erase(field->name());
  if (flags.stream_size() > 0)
    std::erase_if(places, [](const auto& place) { return place.first.starts_with("stream:"); });
  return places;
}

std::string print_config(const ServerConfig& config) {
  std::string out =
      "# Configuration of tandemd, for --config. A flag of the same name, with dashes, overrides a line.\n";
  for (const Setting& setting : settings()) {
    const pb::FieldDescriptor* const field = ServerConfig::descriptor()->FindFieldByName(setting.field);
    out += '\n' + comment(text_of(setting));
    const pb::Reflection& values = *config.GetReflection();
    const int count =
        field->is_repeated() ? values.FieldSize(config, field) : int{values.HasField(config, field)};
    for (int i = 0; i < count; ++i)
      out += line_of(*field, value_of(config, *field, field->is_repeated() ? i : -1));
    if (count == 0) out += "# " + line_of(*field, setting.example);
  }
  return out;
}

}  // namespace tandem::daemon
