#pragma once
// A configuration as a file: read with the places of its fields, and written with comments.

#include <google/protobuf/message.h>

#include <string>

#include "services/program/configuration/form.hpp"
#include "services/program/configuration/places.hpp"
#include "tandem/result.hpp"

namespace tandem::configuration {

/// Errors: kIo.
[[nodiscard]] Result<std::string> read_text(const std::string& path);
/// Reads a file's text into `config`. `path` names the file in errors and places, `program` is who shows all
/// fields. Errors: kMalformed naming file, line and field, and what the field takes.
[[nodiscard]] Result<Places> parse(const Form& form, const std::string& program, const std::string& text,
                                   const std::string& path, google::protobuf::Message& config);

/// Leaves out what a flag sets.
[[nodiscard]] Places places_beside(const google::protobuf::Message& flags, Places places);

/// The configuration as a file with all fields, each with what it means and takes. What is not set is a
/// comment.
[[nodiscard]] std::string print(const Form& form, const std::string& program,
                                const google::protobuf::Message& config);

}  // namespace tandem::configuration
