#include "services/program/configuration/form.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "options.pb.h"
#include "sdk/core/lattice/assert.hpp"
#include "services/program/configuration/places.hpp"
#include "services/program/number.hpp"

namespace tandem::configuration {
namespace {

namespace pb = google::protobuf;

std::string filled(std::string text, const std::map<std::string, std::string>& names) {
  for (const auto& [name, value] : names) {
    const std::string hole = "{" + name + "}";
    for (std::size_t at = text.find(hole); at != std::string::npos; at = text.find(hole, at + value.size()))
      text.replace(at, hole.size(), value);
  }
  return text;
}

/// "1 to 24 frames, or auto"; "text or json".
std::string range_and_words(const idl::Option& option) {
  std::string text;
  if (option.has_least() && option.has_most()) {
    text = fmt::format("{} to {}", option.least(), option.most());
  } else if (option.has_least()) {
    text = fmt::format("at least {}", option.least());
  }
  if (!option.unit().empty()) text += " " + option.unit();
  for (int i = 0; i < option.words_size(); ++i) {
    if (!text.empty()) text += i + 1 < option.words_size() ? ", " : option.has_least() ? ", or " : " or ";
    text += option.words(i);
  }
  return text;
}

const idl::Option& option_of(const pb::FieldDescriptor& field) {
  if (field.options().HasExtension(idl::option)) return field.options().GetExtension(idl::option);
  const pb::FieldDescriptor* const shared = idl::Common::descriptor()->FindFieldByName(field.name());
  TANDEM_ASSERT(shared != nullptr);
  return shared->options().GetExtension(idl::option);
}

Setting setting_of(const pb::FieldDescriptor& field, const std::map<std::string, std::string>& names) {
  const idl::Option& option = option_of(field);
  Setting setting{.field = &field,
                  .flag = option.flag().empty() ? usual_flag(field.name()) : option.flag(),
                  .help = filled(option.help(), names),
                  .takes = filled(option.takes(), names),
                  .value = option.value(),
                  .otherwise = option.otherwise(),
                  .example = option.example(),
                  .least = {},
                  .most = {},
                  .words = {option.words().begin(), option.words().end()},
                  .may_be_empty = option.may_be_empty(),
                  .live = option.live()};
  const bool is_bool = field.cpp_type() == pb::FieldDescriptor::CPPTYPE_BOOL;
  if (setting.takes.empty()) setting.takes = is_bool ? "true or false" : range_and_words(option);
  if (option.has_least()) setting.least = option.least();
  if (option.has_most()) setting.most = option.most();
  if (!setting.value.empty()) setting.example = setting.value;
  if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_STRING)
    setting.example = fmt::format("\"{}\"", setting.example);
  return setting;
}

bool within(double value, const Setting& setting) {  // false for NaN
  return value >= setting.least.value_or(value) && value <= setting.most.value_or(value);
}

/// Whether a value is one that the setting takes.
bool good(const Setting& setting, const pb::Message& config, const std::string& text) {
  switch (setting.field->cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_UINT32:
      return within(config.GetReflection()->GetUInt32(config, setting.field), setting);
    case pb::FieldDescriptor::CPPTYPE_UINT64:
      return within(static_cast<double>(config.GetReflection()->GetUInt64(config, setting.field)), setting);
    case pb::FieldDescriptor::CPPTYPE_DOUBLE:
      return within(config.GetReflection()->GetDouble(config, setting.field), setting);
    case pb::FieldDescriptor::CPPTYPE_STRING: {
      if (setting.words.empty() && !setting.least) return true;
      if (std::ranges::find(setting.words, text) != setting.words.end()) return true;
      const auto value = text::number<double>(text);
      return setting.least && value && within(*value, setting);
    }
    default:
      return true;
  }
}

bool set_numbers(const pb::FieldDescriptor& field, const std::string& text, pb::Message& message) {
  TANDEM_ASSERT(field.cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE);
  const pb::Reflection& values = *message.GetReflection();
  values.ClearField(&message, &field);
  std::istringstream all(text + ",");
  for (std::string one; std::getline(all, one, ',');) {
    const auto value = text::number<double>(one);
    if (!value) return false;
    values.AddDouble(&message, &field, *value);
  }
  return true;
}

}  // namespace

std::string Setting::text() const {
  const std::string& without = value.empty() ? otherwise : value;
  return fmt::format("{}: {}{}", help, takes, without.empty() ? "" : fmt::format(" [{}]", without));
}

Form::Form(const pb::Descriptor& message, const std::map<std::string, std::string>& names) {
  for (int i = 0; i < message.field_count(); ++i) settings_.push_back(setting_of(*message.field(i), names));
}

const Setting* Form::find(std::string_view field) const {
  const auto found =
      std::ranges::find_if(settings_, [&](const Setting& one) { return one.field->name() == field; });
  return found == settings_.end() ? nullptr : &*found;
}

const Setting& common(std::string_view field) {
  static const Form form(*idl::Common::descriptor());
  const Setting* const found = form.find(field);
  TANDEM_ASSERT(found != nullptr);
  return *found;
}

bool is_set(const pb::FieldDescriptor& field, const pb::Message& message) {
  const pb::Reflection& values = *message.GetReflection();
  return field.is_repeated() ? values.FieldSize(message, &field) > 0 : values.HasField(message, &field);
}

bool set_text(const pb::FieldDescriptor& field, const std::string& text, pb::Message& message) {
  const pb::Reflection& values = *message.GetReflection();
  if (field.is_repeated()) return set_numbers(field, text, message);
  const auto set = [&](const auto& value, auto store) {
    if (value) (values.*store)(&message, &field, *value);
    return value.has_value();
  };
  switch (field.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_DOUBLE:
      return set(text::number<double>(text), &pb::Reflection::SetDouble);
    case pb::FieldDescriptor::CPPTYPE_UINT32:
      return set(text::number<std::uint32_t>(text), &pb::Reflection::SetUInt32);
    case pb::FieldDescriptor::CPPTYPE_UINT64:
      return set(text::number<std::uint64_t>(text), &pb::Reflection::SetUInt64);
    case pb::FieldDescriptor::CPPTYPE_BOOL:
      values.SetBool(&message, &field, text == "true");
      return text == "true" || text == "false";
    default:
      values.SetString(&message, &field, text);
      return true;
  }
}

std::string text_of(const pb::FieldDescriptor& field, const pb::Message& message) {
  const pb::Reflection& values = *message.GetReflection();
  if (field.is_repeated()) {
    TANDEM_ASSERT(field.cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE);
    std::string text;
    for (int i = 0; i < values.FieldSize(message, &field); ++i)
      text += fmt::format("{}{}", i == 0 ? "" : ",", values.GetRepeatedDouble(message, &field, i));
    return text;
  }
  switch (field.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_DOUBLE:
      return fmt::format("{}", values.GetDouble(message, &field));
    case pb::FieldDescriptor::CPPTYPE_UINT32:
      return fmt::format("{}", values.GetUInt32(message, &field));
    case pb::FieldDescriptor::CPPTYPE_UINT64:
      return fmt::format("{}", values.GetUInt64(message, &field));
    case pb::FieldDescriptor::CPPTYPE_BOOL:
      return values.GetBool(message, &field) ? "true" : "false";
    default:
      return values.GetString(message, &field);
  }
}

Result<void> check_values(const Form& form, const pb::Message& config) {
  const pb::Reflection& values = *config.GetReflection();
  for (const Setting& setting : form.settings()) {
    const pb::FieldDescriptor& field = *setting.field;
    const bool is_text = field.cpp_type() == pb::FieldDescriptor::CPPTYPE_STRING;
    if (field.is_repeated() ? !is_text : !values.HasField(config, &field)) continue;
    std::vector<std::string> texts;
    for (int i = 0; field.is_repeated() && i < values.FieldSize(config, &field); ++i)
      texts.push_back(values.GetRepeatedString(config, &field, i));
    if (!field.is_repeated()) texts.push_back(text_of(field, config));
    for (const std::string& text : texts) {
      // As of a variable that nobody set: it is not taken for none, because it may be an identity.
      if (is_text && text.empty() && !setting.may_be_empty)
        return fail(ErrorCode::kInvalidArgument, setting.flag + ": is empty: give a value, or leave it out");
      if (!good(setting, config, text))
        return fail(ErrorCode::kInvalidArgument, fmt::format("{}: must be {}", setting.flag, setting.takes));
    }
  }
  return {};
}

void complete(const Form& form, pb::Message& config) {
  for (const Setting& setting : form.settings()) {
    if (setting.value.empty() || is_set(*setting.field, config)) continue;
    [[maybe_unused]] const bool set = set_text(*setting.field, setting.value, config);
    TANDEM_ASSERT(set);
  }
}

void merge(const pb::Message& flags, pb::Message& file) {
  std::vector<const pb::FieldDescriptor*> set;
  flags.GetReflection()->ListFields(flags, &set);
  for (const pb::FieldDescriptor* field : set)
    if (field->is_repeated()) file.GetReflection()->ClearField(&file, field);
  file.MergeFrom(flags);
}

}  // namespace tandem::configuration
