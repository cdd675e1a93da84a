// What a stranger shows a gateway as a token, what somebody with a key has signed, and files of keys. The
// first byte says which.

#include <cstdlib>
#include <string>
#include <vector>

#include "services/credentials/tokens/base64url.hpp"
#include "services/credentials/tokens/keys.hpp"
#include "services/credentials/tokens/secret_file.hpp"
#include "services/credentials/tokens/token.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace {

using namespace tandem::tokens;

constexpr std::int64_t kNow = 1'764'000'000;
constexpr std::string_view kHeader = "eyJhbGciOiJFZERTQSIsInR5cCI6IkpXVCJ9.";

void expect(bool condition) {
  if (!condition) std::abort();
}

// Nothing was signed by the key, so nothing is let in, nor told more than that it is wrong.
void show(std::string_view text, const std::vector<PublicKey>& keys) {
  const auto checked = check(text, keys, "arena", kNow);
  expect(!checked && checked.error() == Denial::kWrong);
  if (const auto bytes = from_base64url(text)) expect(to_base64url(*bytes) == text);
}

void sign_and_show(std::span<const std::uint8_t> payload, const SecretKey& key,
                   const std::vector<PublicKey>& keys) {
  std::string token(kHeader);
  token += to_base64url(payload);
  token += '.' + to_base64url(key.sign(token));
  const auto checked = check(token, keys, "arena", kNow);
  if (!checked) return;
  const Claims& claims = checked->claims;
  expect(token.size() <= kMaxTokenBytes && claims.name.size() <= kMaxNameBytes);
  expect(kNow < claims.expires_s + kClockToleranceS && kNow >= claims.not_before_s - kClockToleranceS);
  expect(claims.session.empty() || claims.session == "arena");
  expect(checked->key == keys.front().id());
}

const tandem::fuzz::ScratchFolder& folder() {
  static const tandem::fuzz::ScratchFolder made;
  return made;
}

/// A secret key's file, changed at the places and to the values that the bytes say by turns.
std::vector<std::uint8_t> changed_key(std::span<const std::uint8_t> changes, const SecretKey& key) {
  static const std::vector<std::uint8_t> whole = [&key] {
    const std::string path = folder().put("none", {}) + ".pem";
    expect(key.write(path).has_value());
    const std::string text = *read_file(path, Others::kNorTheirGroup);
    return std::vector<std::uint8_t>(text.begin(), text.end());
  }();
  std::vector<std::uint8_t> content = whole;
  for (std::size_t i = 0; i + 1 < changes.size(); i += 2)
    content[changes[i] % content.size()] = changes[i + 1];
  return content;
}

// Whatever is in a file, an error names it in one line, and a key is one.
void read_keys(std::span<const std::uint8_t> content) {
  const std::string path = folder().put("any.pem", content);
  const auto one_line = [](const std::string& message) {
    return message.find("any.pem") != std::string::npos && message.find('\n') == std::string::npos;
  };
  const auto secret = SecretKey::read(path);
  const auto open = PublicKey::read(path);
  expect(!(secret && open));
  expect(secret || one_line(secret.error().message));
  expect(open || one_line(open.error().message));
  if (secret) expect(secret->public_key().fits(secret->sign("text"), "text"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const SecretKey key = *SecretKey::make();
  static const std::vector<PublicKey> keys{key.public_key()};
  if (size == 0) return 0;
  const std::span<const std::uint8_t> rest(data + 1, size - 1);
  const char which = static_cast<char>(data[0]);
  if (which == 's') {
    sign_and_show(rest, key, keys);
  } else if (which == 'c') {
    read_keys(changed_key(rest, key));
  } else if (which == 'k') {
    read_keys(rest);
  } else {
    show({reinterpret_cast<const char*>(rest.data()), rest.size()}, keys);
  }
  return 0;
}
