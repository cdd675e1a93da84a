// In place of prometheus_text.cpp, where prometheus-cpp is missing.
#include "services/program/metrics/page.hpp"

namespace tandem::metrics {

bool has_text() { return false; }
std::string to_text(const Page& /*page*/) { return {}; }

}  // namespace tandem::metrics
