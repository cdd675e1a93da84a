#pragma once
// What a configuration's fields say of themselves (idl/options.proto): their flags, help, values and
// defaults.

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::configuration {

/// A field of a configuration. Texts are as --help has them.
struct Setting {
  const google::protobuf::FieldDescriptor* field = nullptr;
  std::string flag;  ///< with its dashes; an argument has none
  std::string help;  ///< one sentence without its full stop, or several
  std::string takes;
  std::string value;      ///< the default, as a flag has it; empty: none
  std::string otherwise;  ///< what holds without it; may be empty
  std::string example;    ///< a value as a file has it; the default where there is one
  std::optional<double> least, most;
  std::vector<std::string> words;
  bool may_be_empty = false;
  bool live = false;  ///< a change is taken over at SIGHUP

  /// "Maximum number of clients: 1 to 65536 [256]".
  [[nodiscard]] std::string text() const;
};

/// The fields of a message, in their order there.
class Form {
 public:
  /// `names`: texts that only the program knows, for {NAME} in help and in what a field takes. A field
  /// without `(option)`, and which idl/options.proto does not share, is an error of the program.
  explicit Form(const google::protobuf::Descriptor& message,
                const std::map<std::string, std::string>& names = {});

  [[nodiscard]] const std::vector<Setting>& settings() const { return settings_; }
  /// Null for an unknown field.
  [[nodiscard]] const Setting* find(std::string_view field) const;

 private:
  std::vector<Setting> settings_;
};

/// An option that programs share.
[[nodiscard]] const Setting& common(std::string_view field);

[[nodiscard]] bool is_set(const google::protobuf::FieldDescriptor& field,
                          const google::protobuf::Message& message);
/// Sets a field from the text of a flag; that of a list of numbers has commas between them. Returns false for
/// text that is no such number, or one that is too large.
[[nodiscard]] bool set_text(const google::protobuf::FieldDescriptor& field, const std::string& text,
                            google::protobuf::Message& message);
/// The value of a field that is set, as a flag has it.
[[nodiscard]] std::string text_of(const google::protobuf::FieldDescriptor& field,
                                  const google::protobuf::Message& message);

/// Checks the fields that are set one by one. Errors: kInvalidArgument, which begins with the flag.
[[nodiscard]] Result<void> check_values(const Form& form, const google::protobuf::Message& config);
/// Sets the fields that are not set and have a default.
void complete(const Form& form, google::protobuf::Message& config);

/// Merges flags and file. Flags win; a list of flags replaces the file's.
void merge(const google::protobuf::Message& flags, google::protobuf::Message& file);

}  // namespace tandem::configuration
