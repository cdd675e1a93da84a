#include "sdk/transport/nats/site_name.hpp"

#include <unistd.h>

#include <array>

#include "sdk/transport/nats/nats_wire.hpp"

namespace tandem::transport::nats {

std::string default_site_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "site";
  std::string site(name.data());
  site.resize(std::min(site.find('.'), site.size()));
  return is_site_name(site) ? site : "site";
}

std::string refusal_of_site_name(const std::string& text) {
  return is_site_name(text) ? std::string()
                            : "'" + text + "': a site is called by 1 to 32 characters of [A-Za-z0-9_-]";
}

}  // namespace tandem::transport::nats
