#include "services/engines/scenes/text_file.hpp"

#include <google/protobuf/io/tokenizer.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace tandem::scenes {
namespace {

namespace pb = google::protobuf;

std::string located(const std::string& file, int line, const std::string& text) {
  return file + ":" + std::to_string(line) + ": " + text;
}

// The last name before `column` in a line such as `  gravity { y: oops }`: what a misplaced value belongs to.
std::string field_before(const std::string& line, std::size_t column) {
  std::string name;
  std::string current;
  for (std::size_t i = 0; i < std::min(column, line.size()); ++i) {
    const auto c = static_cast<unsigned char>(line[i]);
    if (std::isalnum(c) != 0 || c == '_') {
      current.push_back(line[i]);
      continue;
    }
    if ((c == ':' || c == '{' || c == ' ') && !current.empty() &&
        std::isdigit(static_cast<unsigned char>(current[0])) == 0) {
      name = current;
    }
    current.clear();
  }
  return name;
}

class FirstError final : public pb::io::ErrorCollector {
 public:
  FirstError(std::string file, const std::string& text) : file_(std::move(file)), text_(text) {}
  void AddError(int line, pb::io::ColumnNumber column, const std::string& message) override {
    if (!what_.empty()) return;
    std::istringstream lines(text_);
    std::string source;
    for (int i = 0; i <= line; ++i) std::getline(lines, source);
    const std::string field = field_before(source, column < 0 ? 0 : static_cast<std::size_t>(column));
    what_ = located(file_, std::max(line, 0) + 1,
                    field.empty() ? message : "field \"" + field + "\": " + message);
  }
  [[nodiscard]] const std::string& what() const { return what_; }

 private:
  std::string file_;
  const std::string& text_;
  std::string what_;
};

Result<std::string> read_all(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return fail(ErrorCode::kIo, path + ": no such file");
  std::ifstream in(path, std::ios::binary);
  std::string text;
  // Reads in pieces: files are small, and one may grow while it is read.
  std::array<char, 16384> piece{};
  while (in.read(piece.data(), piece.size()), in.gcount() > 0) {
    text.append(piece.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > kMaxFileBytes) return fail(ErrorCode::kIo, path + ": larger than 16 MiB");
  }
  if (in.bad() || !in.is_open()) return fail(ErrorCode::kIo, path + ": cannot be read");
  return text;
}

}  // namespace

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

Result<void> parse_text(const std::string& text, const std::string& source, pb::Message& message,
                        pb::TextFormat::ParseInfoTree& lines) {
  FirstError errors(source, text);
  pb::TextFormat::Parser parser;
  parser.RecordErrorsTo(&errors);
  parser.WriteLocationsTo(&lines);
  if (!parser.ParseFromString(text, &message)) return fail(ErrorCode::kMalformed, errors.what());
  return {};
}

Result<void> read_text_file(const std::string& path, pb::Message& message,
                            pb::TextFormat::ParseInfoTree& lines) {
  return read_all(path).and_then(
      [&](const std::string& text) { return parse_text(text, path, message, lines); });
}

}  // namespace tandem::scenes
