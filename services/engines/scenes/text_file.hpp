#pragma once
// Checks of protobuf text files, whose errors name file, line and field. Internal to scenes.

#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <optional>
#include <string>

#include "tandem/result.hpp"

namespace tandem::scenes {

/// Remembers the first thing that is wrong with a parsed file.
struct Findings {
  std::string file;
  std::optional<Error> first;
};

/// A message within a parsed file, for checks: knows its field path and its lines.
class Node {
 public:
  Node(const google::protobuf::Message& message, google::protobuf::TextFormat::ParseInfoTree* lines,
       std::string path, int line, Findings& findings)
      : message_(&message), lines_(lines), path_(std::move(path)), line_(line), findings_(&findings) {}

  /// Notes an error unless `fine`. `field` names a field of this message, for its line; `index` as for
  /// child().
  void require(bool fine, const std::string& field, const std::string& rule, int index = -1) const;
  /// A message field that is set; `index` for repeated ones.
  [[nodiscard]] Node child(const std::string& field, int index = -1) const;
  /// Requires every number in here and below to be finite and at most 1e6 from zero.
  void require_sane_numbers() const;

 private:
  [[nodiscard]] const google::protobuf::FieldDescriptor* descriptor(const std::string& field) const;
  [[nodiscard]] int line_of(const google::protobuf::FieldDescriptor* field, int index) const;

  const google::protobuf::Message* message_;
  google::protobuf::TextFormat::ParseInfoTree* lines_;
  std::string path_;
  int line_;
  Findings* findings_;
};

}  // namespace tandem::scenes
