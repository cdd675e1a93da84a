// Sends gravity, a push and application bytes to session "default", and prints the outcome of each.
#include <array>
#include <cstddef>
#include <cstdio>
#include <set>
#include <tandem/client.hpp>

int main() {
  auto client = tandem::Client::connect({});
  if (!client || !client->wait_until_playing(10)) return std::puts("no session to join"), 1;
  std::set<std::uint64_t> unanswered;
  const auto sent = [&](const char* what, const tandem::Result<std::uint64_t>& number) {
    if (!number) return std::printf("%s: %s\n", what, number.error().message.c_str()), void();
    std::printf("%s is input %llu\n", what, static_cast<unsigned long long>(*number));
    unanswered.insert(*number);
  };
  constexpr std::array kSpell{std::byte{'b'}, std::byte{'o'}, std::byte{'o'}};
  sent("gravity", client->send_gravity({2, -9, 0}));
  sent("a push", client->send_push({0, 1, 0}, 2, {0, 3, 0}));
  sent("a spell", client->send_bytes(kSpell));  // a simulation that knows no bytes refuses it
  for (int i = 0; i < 100 && !unanswered.empty(); ++i) {
    client->run_for(0.05);
    while (const auto event = client->next_event()) {
      const auto number = static_cast<unsigned long long>(event->number);
      if (event->kind == TANDEM_EVENT_INPUT_ACTED) {
        std::printf("input %llu acted on frame %llu\n", number,
                    static_cast<unsigned long long>(event->frame));
      } else if (event->kind == TANDEM_EVENT_INPUT_REFUSED) {
        std::printf("input %llu was refused: %s\n", number, event->text);
      } else if (event->kind == TANDEM_EVENT_INPUT_UNKNOWN) {
        std::printf("nobody knows what became of input %llu\n", number);
      }
      unanswered.erase(event->number);
    }
  }
  return unanswered.empty() ? 0 : 1;
}
