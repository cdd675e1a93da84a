#pragma once
// JSON text for the JavaScript side.

#include <cstdint>
#include <string>
#include <string_view>

namespace tandem::web {

/// Writes one value, object or list into a text, in the order of the calls. Numbers that are not finite are
/// null; texts are taken as UTF-8, what is not becomes U+FFFD.
class JsonWriter {
 public:
  explicit JsonWriter(std::string& out) : out_(out) {}

  JsonWriter& begin_object() { return open('{'); }
  JsonWriter& end_object() { return close('}'); }
  JsonWriter& begin_list() { return open('['); }
  JsonWriter& end_list() { return close(']'); }
  /// Writes a name of letters, digits and underscores in JavaScript's spelling: `frame_ms_p50` becomes
  /// `frameMsP50`.
  JsonWriter& name(const char* name);

  JsonWriter& value(std::string_view text);
  JsonWriter& value(const char* text);
  JsonWriter& value(double number);
  JsonWriter& value(std::uint64_t number);
  JsonWriter& value(std::uint32_t number) { return value(std::uint64_t{number}); }
  JsonWriter& value(bool truth);
  JsonWriter& null();

  /// A member of an object.
  template <class T>
  JsonWriter& member(const char* member_name, const T& content) {
    return name(member_name).value(content);
  }

 private:
  JsonWriter& open(char bracket);
  JsonWriter& close(char bracket);
  void separate();

  std::string& out_;
  bool first_ = true;  ///< of the object or list that is open
};

}  // namespace tandem::web
