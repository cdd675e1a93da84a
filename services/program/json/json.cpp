#include "services/program/json/json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <type_traits>

namespace tandem {
namespace {

using Printed = nlohmann::ordered_json;

Json from(const Printed& value) {
  switch (value.type()) {
    case Printed::value_t::boolean:
      return value.get<bool>();
    case Printed::value_t::number_unsigned:
      return value.get<std::uint64_t>();
    case Printed::value_t::number_integer:
      return value.get<std::int64_t>();
    case Printed::value_t::number_float:
      return value.get<double>();
    case Printed::value_t::string:
      return value.get<std::string>();
    case Printed::value_t::array: {
      Json list = Json::array();
      for (const Printed& entry : value) list.push_back(from(entry));
      return list;
    }
    case Printed::value_t::object: {
      Json object = Json::object();
      for (const auto& [name, member] : value.items()) object[name] = from(member);
      return object;
    }
    default:
      return nullptr;
  }
}

}  // namespace

Json::Json(std::initializer_list<Member> members) : Json(Members(members)) {}
Json::Json(Members members) : value_(std::move(members)) {}
Json::Json(List list) : value_(std::move(list)) {}

Json& Json::operator[](std::string_view name) {
  if (is_null()) value_ = Members{};
  auto& members = std::get<Members>(value_);
  const auto found = std::ranges::find(members, name, &Member::first);
  return found != members.end() ? found->second : members.emplace_back(std::string(name), Json()).second;
}

const Json& Json::operator[](std::string_view name) const {
  static const Json none;
  const auto found = std::ranges::find(members(), name, &Member::first);
  return found != members().end() ? found->second : none;
}

Json& Json::push_back(Json value) {
  if (is_null()) value_ = List{};
  return std::get<List>(value_).emplace_back(std::move(value));
}

double Json::number() const {
  return std::visit(
      [](const auto& value) {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) return static_cast<double>(value);
        return 0.0;
      },
      value_);
}

const std::string& Json::text() const {
  static const std::string none;
  return is_text() ? std::get<std::string>(value_) : none;
}

const Json::Members& Json::members() const {
  static const Members none;
  const auto* members = std::get_if<Members>(&value_);
  return members != nullptr ? *members : none;
}

std::string Json::dump() const { return printed().dump(-1, ' ', false, Printed::error_handler_t::replace); }

nlohmann::ordered_json Json::printed() const {
  return std::visit(
      [](const auto& value) {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<T, List>) {
          Printed list = Printed::array();
          for (const Json& entry : value) list.push_back(entry.printed());
          return list;
        } else if constexpr (std::is_same_v<T, Members>) {
          Printed object = Printed::object();
          for (const auto& [name, member] : value) object.emplace(name, member.printed());
          return object;
        } else {
          return Printed(value);
        }
      },
      value_);
}

std::optional<Json> Json::parse(const std::string& text) {
  const Printed value = Printed::parse(text, nullptr, false);
  if (value.is_discarded()) return std::nullopt;
  return from(value);
}

}  // namespace tandem
