#include "services/engines/scenes/text_file.hpp"

#include <cmath>

#include "services/program/protobuf_text/protobuf_text.hpp"

namespace tandem::scenes {

namespace pb = google::protobuf;
using protobuf_text::located;

const pb::FieldDescriptor* Node::descriptor(const std::string& field) const {
  return message_->GetDescriptor()->FindFieldByName(field);
}

int Node::line_of(const pb::FieldDescriptor* field, int index) const {
  if (lines_ == nullptr || field == nullptr) return line_;
  if (field->is_repeated() && index < 0) return line_;
  int line = lines_->GetLocation(field, index).line;
  if (line < 0 && index > 0)
    line = lines_->GetLocation(field, 0).line;  // a list in brackets has only one place
  return line < 0 ? line_ : line + 1;
}

void Node::require(bool fine, const std::string& field, const std::string& rule, int index) const {
  if (fine || findings_->first) return;
  std::string full = path_;
  if (!path_.empty() && !field.empty()) full += '.';
  full += field;
  if (index >= 0) full.append("[").append(std::to_string(index)).append("]");
  findings_->first = Error{ErrorCode::kMalformed, located(findings_->file, line_of(descriptor(field), index),
                                                          "field \"" + full + "\" " + rule)};
}

Node Node::child(const std::string& field, int index) const {
  const pb::FieldDescriptor* d = descriptor(field);
  const pb::Reflection* reflection = message_->GetReflection();
  const pb::Message& nested =
      index < 0 ? reflection->GetMessage(*message_, d) : reflection->GetRepeatedMessage(*message_, d, index);
  auto* lines = lines_ == nullptr ? nullptr : lines_->GetTreeForNested(d, index);
  std::string path = path_.empty() ? field : path_ + "." + field;
  if (index >= 0) path.append("[").append(std::to_string(index)).append("]");
  return {nested, lines, path, line_of(d, index), *findings_};
}

void Node::require_sane_numbers() const {
  constexpr double kLargest = 1e6;
  const pb::Reflection* reflection = message_->GetReflection();
  std::vector<const pb::FieldDescriptor*> present;
  reflection->ListFields(*message_, &present);
  for (const pb::FieldDescriptor* field : present) {
    const int count = field->is_repeated() ? reflection->FieldSize(*message_, field) : 1;
    for (int i = 0; i < count; ++i) {
      const int index = field->is_repeated() ? i : -1;
      if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE) {
        child(field->name(), index).require_sane_numbers();
      } else if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE) {
        const double value = index < 0 ? reflection->GetDouble(*message_, field)
                                       : reflection->GetRepeatedDouble(*message_, field, index);
        require(std::fabs(value) <= kLargest, field->name(), "must be a number from -1e6 to 1e6", index);
      }
    }
  }
}

}  // namespace tandem::scenes
