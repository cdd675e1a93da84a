#include "sdk/transport/nats/followers.hpp"

#include <algorithm>

namespace tandem::transport::nats {
namespace {

std::uint64_t site_in(const ParticipantId& id) {
  std::uint64_t site = 0;
  for (std::size_t i = 0; i < 8; ++i) site |= std::uint64_t{id.bytes[i]} << (8U * i);
  return site;
}

}  // namespace

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return hash;
}

ParticipantId participant(const std::string& site, std::uint32_t process, ClientId client) {
  ParticipantId id;
  const std::uint64_t of_site = fnv1a(site);
  for (std::size_t i = 0; i < 8; ++i) id.bytes[i] = static_cast<std::uint8_t>(of_site >> (8U * i));
  for (std::size_t i = 0; i < 4; ++i) id.bytes[8 + i] = static_cast<std::uint8_t>(process >> (8U * i));
  for (std::size_t i = 0; i < 8; ++i) id.bytes[12 + i % 4] ^= static_cast<std::uint8_t>(client >> (8U * i));
  return id;
}

bool Allowance::spend(double amount, std::int64_t now_ns) {
  if (at_ns != INT64_MIN) left = std::min(burst, left + rate * 1e-9 * static_cast<double>(now_ns - at_ns));
  at_ns = now_ns;
  if (left <= 0) return false;
  left -= amount;
  return true;
}

bool Followers::has_room(const Site* site, std::uint32_t process, const ParticipantId& client) const {
  if (site == nullptr)
    return sites_.size() < kMaxSites && processes_ < kMaxProcesses && clients_ < most_clients_;
  return (site->processes.contains(process) || site->processes.size() + processes_ < kMaxProcesses) &&
         (site->clients.contains(client) || site->clients.size() + clients_ < most_clients_);
}

std::optional<Followers::Heard> Followers::heard(const std::string& site, std::uint32_t process,
                                                 ClientId client, std::int64_t now_ns) {
  const ParticipantId from = participant(site, process, client);
  const auto known = sites_.find(site_in(from));
  Site* place = known == sites_.end() ? nullptr : &known->second;
  bool room = has_room(place, process, from);
  if (!room && place != nullptr && now_ns - place->swept_ns >= kSecond) {
    place->swept_ns = now_ns;
    sweep(*place, kSilentNs, now_ns);
    count();
    room = has_room(place, process, from);
  }
  if (!room) return std::nullopt;
  if (place == nullptr) place = &sites_[site_in(from)];
  place->name = site;
  place->heard_ns = now_ns;
  Process& sender = place->processes[process];
  sender.heard_ns = now_ns;
  if (place->clients.insert_or_assign(from, Client{client, process, now_ns}).second) count();
  const auto owner = owners_.try_emplace(client, from).first;
  // Another process of that site may have taken the client over. Another site may not.
  if (site_in(owner->second) == site_in(from)) owner->second = from;
  return Heard{from, &sender, &place->bytes};
}

void Followers::disown(const ParticipantId& from, const Client& client) {
  const auto owner = owners_.find(client.id);
  if (owner != owners_.end() && owner->second == from) owners_.erase(owner);
}

void Followers::left(const std::string& site, std::uint32_t process, ClientId client) {
  const ParticipantId from = participant(site, process, client);
  const auto known = sites_.find(site_in(from));
  if (known == sites_.end()) return;
  auto& clients = known->second.clients;
  const auto leaver = clients.find(from);
  if (leaver == clients.end()) return;
  disown(from, leaver->second);
  clients.erase(leaver);
  if (std::none_of(clients.begin(), clients.end(),
                   [process](const auto& entry) { return entry.second.process == process; }))
    known->second.processes.erase(process);
  count();
}

void Followers::sweep(Site& site, std::int64_t silent_ns, std::int64_t now_ns) {
  std::erase_if(site.processes,
                [=](const auto& entry) { return now_ns - entry.second.heard_ns > silent_ns; });
  std::erase_if(site.clients, [=, this](const auto& entry) {
    if (now_ns - entry.second.heard_ns <= silent_ns) return false;
    disown(entry.first, entry.second);
    return true;
  });
}

void Followers::forget_silent(std::int64_t now_ns) {
  for (auto& [key, site] : sites_) sweep(site, kForgottenNs, now_ns);
  // Not as soon as its last client leaves, as what it has spent still counts.
  std::erase_if(sites_,
                [now_ns](const auto& entry) { return now_ns - entry.second.heard_ns > kForgottenNs; });
  count();
}

void Followers::count() {
  processes_ = clients_ = 0;
  for (const auto& [key, site] : sites_) {
    processes_ += site.processes.size();
    clients_ += site.clients.size();
  }
}

const Followers::Client* Followers::find(const ParticipantId& client) const {
  const auto site = sites_.find(site_in(client));
  if (site == sites_.end()) return nullptr;
  const auto found = site->second.clients.find(client);
  return found == site->second.clients.end() ? nullptr : &found->second;
}

bool Followers::alive(const ParticipantId& client, std::int64_t now_ns) const {
  const Client* const found = find(client);
  return found != nullptr && now_ns - found->heard_ns < kSilentNs;
}

std::string Followers::site_of(ClientId client) const {
  const auto owner = owners_.find(client);
  if (owner == owners_.end()) return {};
  const auto site = sites_.find(site_in(owner->second));
  return site == sites_.end() ? std::string() : site->second.name;
}

}  // namespace tandem::transport::nats
