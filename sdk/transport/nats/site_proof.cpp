#include "sdk/transport/nats/site_proof.hpp"

#include <bit>
#include <cstddef>

namespace tandem::transport::nats {
namespace {

// The state v0 to v3 and SipRound of the paper's section 2.2.
struct State {
  std::uint64_t v0, v1, v2, v3;
  void rounds(int count) {
    for (int i = 0; i < count; ++i) {
      v0 += v1;
      v1 = std::rotl(v1, 13) ^ v0;
      v0 = std::rotl(v0, 32);
      v2 += v3;
      v3 = std::rotl(v3, 16) ^ v2;
      v0 += v3;
      v3 = std::rotl(v3, 21) ^ v0;
      v2 += v1;
      v1 = std::rotl(v1, 17) ^ v2;
      v2 = std::rotl(v2, 32);
    }
  }
  void take(std::uint64_t word) {
    v3 ^= word;
    rounds(2);
    v0 ^= word;
  }
};

}  // namespace

std::uint64_t site_proof(const Secret& secret, std::string_view site) {
  State state{secret[0] ^ 0x736f6d6570736575U, secret[1] ^ 0x646f72616e646f6dU,
              secret[0] ^ 0x6c7967656e657261U, secret[1] ^ 0x7465646279746573U};
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < site.size(); ++i) {
    word |= std::uint64_t{static_cast<unsigned char>(site[i])} << (8U * (i % 8));
    if (i % 8 != 7) continue;
    state.take(word);
    word = 0;
  }
  state.take(word | std::uint64_t{site.size()} << 56U);
  state.v2 ^= 0xffU;
  state.rounds(4);
  const std::uint64_t proof = state.v0 ^ state.v1 ^ state.v2 ^ state.v3;
  return proof == 0 ? 1 : proof;
}

}  // namespace tandem::transport::nats
