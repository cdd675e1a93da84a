#include "services/program/configuration/file.hpp"

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "services/program/protobuf_text/protobuf_text.hpp"

namespace tandem::configuration {
namespace {

namespace pb = google::protobuf;

/// The text between `begin` and the next quotation mark; empty without them.
std::string between(const std::string& text, const std::string& begin) {
  const std::size_t at = text.find(begin);
  if (at == std::string::npos) return {};
  const std::size_t from = at + begin.size();
  const std::size_t end = text.find('"', from);
  return end == std::string::npos ? std::string() : text.substr(from, end - from);
}

/// Says what the field takes, or that there is no such field, in words of the manual.
Error explained(const Form& form, const std::string& program, Error error) {
  if (const std::string unknown = between(error.message, "has no field named \""); !unknown.empty()) {
    const std::string place = error.message.substr(0, error.message.find(": "));
    error.message =
        fmt::format("{}: field \"{}\" is unknown; {} --print-config shows all", place, unknown, program);
  } else if (const Setting* setting = form.find(between(error.message, "field \"")); setting != nullptr) {
    while (error.message.ends_with('.')) error.message.pop_back();
    error.message += fmt::format("; it takes {}", setting->takes);
  }
  return error;
}

Places places_of(const Form& form, const std::string& path, const pb::Message& config,
                 const pb::TextFormat::ParseInfoTree& tree) {
  Places places{.file = path, .of_field = {}, .field_of_flag = {}};
  const pb::Reflection& values = *config.GetReflection();
  const auto line = [&](const pb::FieldDescriptor* field, int index) {
    return fmt::format("{}:{}", path, tree.GetLocation(field, index).line + 1);
  };
  for (const Setting& setting : form.settings()) {
    const pb::FieldDescriptor* const field = setting.field;
    const int count = field->is_repeated() ? values.FieldSize(config, field) : -1;
    if (count == 0 || (count < 0 && !values.HasField(config, field))) continue;
    places.of_field[field->name()] = line(field, count < 0 ? -1 : 0);
    places.field_of_flag.emplace(setting.flag, field->name());
    if (field->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE) continue;
    const pb::FieldDescriptor* const name = field->message_type()->FindFieldByName("name");
    for (int i = 0; i < count && name != nullptr; ++i) {
      const pb::Message& one = values.GetRepeatedMessage(config, field, i);
      places.of_field[field->name() + ":" + text_of(*name, one)] = line(field, i);
    }
  }
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

std::string value_of(const pb::Message& config, const pb::FieldDescriptor& field, int index) {
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

Result<std::string> read_text(const std::string& path) {
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

Result<Places> parse(const Form& form, const std::string& program, const std::string& text,
                     const std::string& path, pb::Message& config) {
  pb::TextFormat::ParseInfoTree tree;
  if (auto parsed = protobuf_text::parse(text, path, config, tree); !parsed)
    return tl::unexpected(explained(form, program, parsed.error()));
  return places_of(form, path, config, tree);
}

Places places_beside(const pb::Message& flags, Places places) {
  std::vector<const pb::FieldDescriptor*> set;
  flags.GetReflection()->ListFields(flags, &set);
  for (const pb::FieldDescriptor* field : set) {
    const auto of_it = [field](const auto& place) {
      return place.first == field->name() || place.first.starts_with(field->name() + ":");
    };
    std::erase_if(places.of_field, of_it);
    std::erase_if(places.field_of_flag, [field](const auto& flag) { return flag.second == field->name(); });
  }
  return places;
}

std::string print(const Form& form, const std::string& program, const pb::Message& config) {
  std::string out = fmt::format(
      "# Configuration of {}, for --config. A flag of the same name, with dashes, overrides a line.\n",
      program);
  const pb::Reflection& values = *config.GetReflection();
  for (const Setting& setting : form.settings()) {
    const pb::FieldDescriptor* const field = setting.field;
    out += '\n' + comment(setting.text());
    const int count =
        field->is_repeated() ? values.FieldSize(config, field) : int{values.HasField(config, field)};
    for (int i = 0; i < count; ++i)
      out += line_of(*field, value_of(config, *field, field->is_repeated() ? i : -1));
    if (count == 0) out += "# " + line_of(*field, setting.example);
  }
  return out;
}

}  // namespace tandem::configuration
