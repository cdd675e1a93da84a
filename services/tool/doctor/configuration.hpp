#pragma once
// What CYCLONEDDS_URI holds, read without Cyclone DDS, which takes an XML text that breaks off.

#include <string>
#include <string_view>

namespace tandem::doctor {

/// Why the text is no XML, and in which line. Empty: it is. Several root elements may stand side by side, as in
/// CYCLONEDDS_URI.
[[nodiscard]] std::string fault_of_xml(std::string_view text);

}  // namespace tandem::doctor
