#pragma once
// A question to a program with --metrics: whether it is alive or ready. It is for health checks where there
// is neither curl nor a shell, as in a container.

#include <cstdint>
#include <string>
#include <string_view>

#include "services/program/metrics/address.hpp"
#include "tandem/result.hpp"

namespace tandem::metrics {

struct Question {
  Address address;
  std::string path = "/healthz";  ///< or /readyz
};

/// Reads an address as of --metrics, with or without /healthz or /readyz behind it. Errors: kInvalidArgument,
/// which says what is expected.
[[nodiscard]] Result<Question> read_question(std::string_view text);

/// Returns the line of a good answer. Blocks, `patience_ns` at most. Errors: kIo, with the line of another
/// answer or why there is none.
[[nodiscard]] Result<std::string> ask(const Question& question, std::int64_t patience_ns);

/// What --help says of --probe.
inline constexpr const char* kProbeHelp =
    "ADDRESS:PORT of a program with --metrics, with or without /healthz or /readyz behind it: ask whether it is alive or "
    "ready, print its answer, and exit with 0 if it is, else with 1";
/// Does what --probe says. Returns the exit code: 0, 1, or 2 for a text that is no question.
[[nodiscard]] int probe(const char* program, std::string_view text);

}  // namespace tandem::metrics
