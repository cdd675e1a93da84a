#include "sdk/transport/network/reach.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string_view>
#include <vector>

#include "sdk/transport/network/interfaces.hpp"
#include "sdk/transport/network/profile.hpp"

namespace tandem::transport {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;

std::string file_text(std::string_view path) {
  constexpr std::string_view kScheme = "file://";
  if (path.starts_with(kScheme)) path.remove_prefix(kScheme.size());
  std::ifstream file{std::string(path)};
  std::string text(kMaxBytes, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

std::string without_comments(std::string_view text) {
  std::string rest;
  while (!text.empty()) {
    const std::size_t begin = std::min(text.find("<!--"), text.size());
    rest += text.substr(0, begin);
    const std::size_t end = text.find("-->", begin);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 3);
  }
  return rest;
}

/// The value of the attribute of that name in a tag.
std::string attribute(std::string_view tag, const std::string& name) {
  const std::size_t at = tag.find(name + '=');
  if (at == std::string_view::npos || at + name.size() + 1 >= tag.size()) return {};
  const std::size_t quote = at + name.size() + 1;
  const std::size_t end = tag.find(tag[quote], quote + 1);
  return std::string(tag.substr(quote + 1, std::min(end, tag.size()) - quote - 1));
}

/// The interfaces that a configuration of Cyclone DDS names, by name or address.
std::vector<std::string> interfaces_in(const std::string& configuration) {
  const std::string text = without_comments(configuration);
  std::vector<std::string> names;
  constexpr std::string_view kElement = "<NetworkInterface";
  for (std::size_t at = text.find(kElement); at != std::string::npos; at = text.find(kElement, at + 1)) {
    const std::size_t end = std::min(text.find('>', at), text.size());
    const std::string_view tag = std::string_view(text).substr(at, end - at);
    if (tag.starts_with("<NetworkInterfaceAddress")) {  // of older versions: a list
      names.push_back(text.substr(end + 1, std::min(text.find('<', end), text.size()) - end - 1));
    } else {
      const std::string name = attribute(tag, "name");
      names.push_back(name.empty() ? attribute(tag, "address") : name);
    }
  }
  return names;
}

std::string joined(const std::vector<std::string>& all) {
  std::string text;
  for (const std::string& each : all) text += (text.empty() ? "" : ", ") + each;
  return text;
}

}  // namespace

std::string configuration_text(const std::string& uri) {
  std::string all;
  for (std::size_t at = 0; at < uri.size();) {
    if (uri[at] == '<') return all + uri.substr(at);  // XML in place, to the end
    const std::size_t comma = std::min(uri.find(',', at), uri.size());
    all += file_text(std::string_view(uri).substr(at, comma - at));
    at = comma + 1;
  }
  return all;
}

std::string reach_of_dds(const std::string& profile, const std::string& configuration) {
  constexpr const char* kAny = "its network";
  if (!profile.empty()) {
    const auto parsed = parse_profile(profile, Side::kServer);
    if (!parsed) return kAny;
    if (parsed->name == "loopback") return {};
    return parsed->interfaces.empty() ? kAny : joined(parsed->interfaces);
  }
  std::vector<std::string> names = interfaces_in(configuration);
  if (names.empty()) return kAny;
  std::erase_if(names, [](const std::string& name) { return name == "lo" || is_loopback(name); });
  for (std::string& name : names)
    if (name.empty()) name = kAny;  // Cyclone DDS chooses
  return joined(names);
}

std::string warning_without_security(const std::string& profile, const std::string& secure) {
  if (!secure.empty()) return {};
  const char* const uri = std::getenv("CYCLONEDDS_URI");
  const std::string reach = reach_of_dds(profile, configuration_text(uri != nullptr ? uri : ""));
  if (reach.empty()) return {};
  std::vector<std::string> now = own_udp_addresses();
  std::erase_if(now, &is_loopback);
  return "without --secure, everybody who reaches " +
         (now.empty() ? "this machine over " + reach : joined(now)) +
         " can watch this session, act in it and pretend to be its server; see `tandem pki --help`";
}

}  // namespace tandem::transport
