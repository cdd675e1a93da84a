#pragma once
// JSON that programs print, and read from each other. Hides nlohmann-json, which costs every file that
// includes it seconds of compiling.

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace tandem {

/// A value of JSON. Members of an object keep the order they came in.
class Json {
 public:
  using Member = std::pair<std::string, Json>;
  using List = std::vector<Json>;
  using Members = std::vector<Member>;

  Json() = default;  ///< null
  Json(std::nullptr_t) {}
  template <std::same_as<bool> T>
  Json(T truth) : value_(truth) {}
  template <std::unsigned_integral T>
  requires(!std::same_as<T, bool>) Json(T number) : value_(std::uint64_t{number}) {}
  template <std::signed_integral T>
  Json(T number) : value_(std::int64_t{number}) {}
  template <std::floating_point T>
  Json(T number) : value_(double{number}) {}
  Json(std::string text) : value_(std::move(text)) {}
  Json(std::string_view text) : value_(std::string(text)) {}
  Json(const char* text) : value_(std::string(text)) {}
  /// null if there is none.
  template <class T>
  Json(const std::optional<T>& value) : Json(value ? Json(*value) : Json()) {}
  template <class T>
  Json(const std::map<std::string, T>& members) : value_(Members{}) {
    for (const auto& [name, value] : members) (*this)[name] = value;
  }
  /// An object: {{"name", value}, ...}.
  Json(std::initializer_list<Member> members);
  static Json object() { return Json(Members{}); }
  static Json array(std::initializer_list<Json> values = {}) { return Json(List(values)); }

  /// The member of an object, made if it is not there; null becomes an object.
  Json& operator[](std::string_view name);
  /// null if there is none.
  const Json& operator[](std::string_view name) const;
  /// Appends to a list; null becomes a list. Returns the new place.
  Json& push_back(Json value);

  [[nodiscard]] bool is_null() const { return std::holds_alternative<std::nullptr_t>(value_); }
  [[nodiscard]] bool is_text() const { return std::holds_alternative<std::string>(value_); }
  [[nodiscard]] bool is_real() const { return std::holds_alternative<double>(value_); }  ///< no whole number
  /// 0, an empty text or no members if the value has another type.
  [[nodiscard]] double number() const;
  [[nodiscard]] const std::string& text() const;
  [[nodiscard]] const Members& members() const;

  /// The text in one line. Numbers that are not finite become null; bytes that are not UTF-8 become U+FFFD.
  [[nodiscard]] std::string dump() const;
  /// Reads one JSON value; empty if `text` is not one.
  [[nodiscard]] static std::optional<Json> parse(const std::string& text);

 private:
  explicit Json(Members members);
  explicit Json(List list);
  [[nodiscard]] nlohmann::ordered_json printed() const;

  std::variant<std::nullptr_t, bool, std::uint64_t, std::int64_t, double, std::string, List, Members> value_;
};

}  // namespace tandem
