#pragma once
// Protobuf text files with errors that name file, line and field.

#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <string>

#include "tandem/result.hpp"

namespace tandem::protobuf_text {

inline constexpr std::size_t kMaxFileBytes = std::size_t{16} << 20U;

/// "FILE:LINE: TEXT".
[[nodiscard]] std::string located(const std::string& file, int line, const std::string& text);

/// Reads `text` into `message`; `lines` receives where its fields are. `source` names it in errors. Errors:
/// kMalformed.
[[nodiscard]] Result<void> parse(const std::string& text, const std::string& source,
                                 google::protobuf::Message& message,
                                 google::protobuf::TextFormat::ParseInfoTree& lines);
/// Reads a file in the same way. Errors: kIo, kMalformed.
[[nodiscard]] Result<void> read_file(const std::string& path, google::protobuf::Message& message,
                                     google::protobuf::TextFormat::ParseInfoTree& lines);

}  // namespace tandem::protobuf_text
