#include "services/program/protobuf_text/protobuf_text.hpp"

#include <google/protobuf/io/tokenizer.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace tandem::protobuf_text {
namespace {

namespace pb = google::protobuf;

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

std::string located(const std::string& file, int line, const std::string& text) {
  return file + ":" + std::to_string(line) + ": " + text;
}

Result<void> parse(const std::string& text, const std::string& source, pb::Message& message,
                   pb::TextFormat::ParseInfoTree& lines) {
  FirstError errors(source, text);
  pb::TextFormat::Parser parser;
  parser.RecordErrorsTo(&errors);
  parser.WriteLocationsTo(&lines);
  if (!parser.ParseFromString(text, &message)) return fail(ErrorCode::kMalformed, errors.what());
  return {};
}

Result<void> read_file(const std::string& path, pb::Message& message, pb::TextFormat::ParseInfoTree& lines) {
  return read_all(path).and_then([&](const std::string& text) { return parse(text, path, message, lines); });
}

}  // namespace tandem::protobuf_text
