#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "sdk/transport/nats/nats_wire.hpp"
#include "sdk/wire/units.hpp"
#include "services/tool/doctor/nats_doctor.hpp"

namespace tandem::doctor {
namespace {

/// Below this, each message is many packets.
constexpr std::size_t kTooSmallBytes = 4096;
/// A far site hears its own inputs act after this and two frames.
constexpr std::int64_t kSlowNs = kSecond / 4;

bool has(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

Check judge_connection(const NatsFacts& facts) {
  Check check{"nats", Verdict::kGood, facts.url + " answers", ""};
  if (!facts.fault.empty())
    return {"nats", Verdict::kFailure, facts.fault, "correct the address or the file"};
  if (facts.reached) return check;
  check.verdict = Verdict::kFailure;
  check.detail = facts.trouble.empty() ? facts.url + " cannot be reached" : facts.trouble;
  if (has(check.detail, "uthoriz") || has(check.detail, "uthentic")) {
    check.advice =
        "give the name and the password of users.conf (nats://NAME:PASSWORD@HOST), or --nats-credentials";
  } else if (has(check.detail, "ecure") || has(check.detail, "SSL") || has(check.detail, "ertificate")) {
    check.advice =
        "tls:// is for a server with a certificate, nats:// for one without; --nats-ca names who is trusted";
  } else {
    check.advice = "start nats-server there, and let TCP to its port through";
  }
  return check;
}

Check judge_following(const NatsFacts& facts) {
  Check check{"may follow", Verdict::kGood, "as site " + facts.site, ""};
  if (facts.refused_to_follow.empty()) return check;
  check.detail =
      fmt::format("as site {} it may not {}", facts.site, fmt::join(facts.refused_to_follow, ", "));
  if (facts.refused_to_publish.empty()) {
    // The relay beside the server follows nobody on NATS.
    check.verdict = Verdict::kWarning;
    check.advice = "that is right for the relay beside the server, and for nobody else";
  } else {
    check.verdict = Verdict::kFailure;
    check.advice = "--site has to be the user's name, with the permissions of a site in users.conf";
  }
  return check;
}

Check judge_publishing(const NatsFacts& facts) {
  if (facts.refused_to_publish.empty()) {
    Check check{"may publish", Verdict::kGood, "sessions, as the relay beside the server does", ""};
    if (facts.refused_to_follow.empty()) {
      check.verdict = Verdict::kWarning;
      check.detail = "sessions: whoever has this user can forge them";
      check.advice = "give sites users that may not publish on delta, as users.conf does";
    }
    return check;
  }
  return {"may publish", Verdict::kGood, "no session, as is right for a site", ""};
}

Check judge_payload(const NatsFacts& facts) {
  Check check{"max_payload", Verdict::kGood, fmt::format("{} bytes", facts.most_bytes), ""};
  if (facts.most_bytes >= transport::nats::kPacketBytes) return check;
  check.verdict = facts.most_bytes < kTooSmallBytes ? Verdict::kFailure : Verdict::kWarning;
  check.detail += ": large messages are cut into many, and one that is lost loses all of them";
  check.advice = "max_payload: 64KB in the NATS server's configuration";
  return check;
}

Check judge_latency(const NatsFacts& facts) {
  std::vector<std::int64_t> all = facts.round_trips_ns;
  if (all.empty())
    return {"latency", Verdict::kFailure, "the server does not answer a ping",
            "look at its load and at the link"};
  std::ranges::sort(all);
  const auto ms = [](std::int64_t ns) { return static_cast<double>(ns) / 1e6; };
  Check check{"latency", Verdict::kGood,
              fmt::format("{:.1f} to {:.1f} ms to the server and back", ms(all.front()), ms(all.back())), ""};
  if (all.front() > kSlowNs) {
    check.verdict = Verdict::kWarning;
    check.advice = "inputs of this site act so much later";
  }
  return check;
}

std::vector<Check> judge_sessions(const NatsFacts& facts) {
  std::vector<Check> checks;
  if (facts.foreign_version != 0)
    checks.push_back({"version", Verdict::kFailure,
                      fmt::format("a relay speaks version {} of the relay protocol, this program version {}",
                                  facts.foreign_version, transport::nats::kRelayVersion),
                      "install the same version everywhere"});
  for (const auto& [name, heard] : facts.sessions) {
    std::set<Epoch> epochs;
    for (const auto& [sender, relay] : heard.relays) epochs.insert(relay.epoch);
    Check check{"session", Verdict::kGood, "", ""};
    if (epochs.size() > 1) {
      check.verdict = Verdict::kFailure;
      check.detail = fmt::format("'{}' is published by relays of {} servers", name, epochs.size());
      check.advice = "give each server's session a name of its own";
    } else if (!heard.have) {
      check.verdict = Verdict::kWarning;
      check.detail = fmt::format("'{}' is announced, and its relay does not answer this site", name);
      check.advice = "see the permissions above, and the relay's log";
    } else {
      check.detail =
          fmt::format("'{}', epoch {}, {} bodies at {:g} Hz, {} streams, {} relays", heard.session.session,
                      *epochs.begin(), heard.session.capacity, heard.session.frame_rate_hz,
                      heard.session.streams.size(), heard.relays.size());
    }
    checks.push_back(std::move(check));
  }
  if (facts.sessions.empty())
    checks.push_back({"session", facts.session.empty() ? Verdict::kWarning : Verdict::kFailure,
                      facts.session.empty() ? "no relay announces one"
                                            : fmt::format("no relay announces '{}'", facts.session),
                      "start tandem-relay --to nats://... beside the server, or look at its /readyz"});
  return checks;
}

}  // namespace

std::vector<Check> judge(const NatsFacts& facts) {
  std::vector<Check> checks{judge_connection(facts)};
  if (!facts.reached) return checks;
  checks.push_back(judge_payload(facts));
  checks.push_back(judge_latency(facts));
  checks.push_back(judge_following(facts));
  checks.push_back(judge_publishing(facts));
  for (Check& check : judge_sessions(facts)) checks.push_back(std::move(check));
  return checks;
}

}  // namespace tandem::doctor
