#include "services/tool/doctor/configuration.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cctype>

namespace tandem::doctor {

std::string fault_of_xml(std::string_view text) {
  // A root makes several elements, and what stands between them, one document. A declaration would have to
  // stand before it.
  std::string document = "<root>" + std::string(text) + "</root>";
  for (std::size_t at = document.find("<?"); at != std::string::npos; at = document.find("<?", at)) {
    const std::size_t end = document.find("?>", at);
    if (end == std::string::npos) return "it breaks off within a tag";
    document.erase(at, end + 2 - at);
  }
  tinyxml2::XMLDocument parsed;
  if (parsed.Parse(document.data(), document.size()) == tinyxml2::XML_SUCCESS) return {};
  std::string what = parsed.ErrorName();  // as XML_ERROR_MISMATCHED_ELEMENT
  what.erase(0, std::string_view("XML_ERROR_").size());
  std::ranges::transform(what, what.begin(),
                         [](unsigned char c) { return c == '_' ? ' ' : std::tolower(c); });
  return fmt::format("line {}: {}", parsed.ErrorLineNum(), what);
}

}  // namespace tandem::doctor
