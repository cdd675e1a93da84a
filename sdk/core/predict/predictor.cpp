#include "sdk/core/predict/predictor.hpp"

#include <string>

#include "sdk/core/predict/ballistic/ballistic.hpp"
#include "sdk/core/predict/contact/contact.hpp"

namespace tandem {

Result<std::unique_ptr<Predictor>> make_predictor(std::string_view name, std::uint32_t capacity,
                                                  std::span<const std::int32_t> constants) {
  if (name == "contact" || name == "field") {
    if (capacity == 0 || capacity > kMaxCapacity) {
      return fail(ErrorCode::kInvalidArgument,
                  "predictor '" + std::string(name) + "': capacity out of range");
    }
    const auto tier = name == "field" ? Contact::Tier::kField : Contact::Tier::kContact;
    return read_contact_constants(constants).map([&](ContactConstants&& read) {
      return std::unique_ptr<Predictor>(std::make_unique<Contact>(capacity, std::move(read), tier));
    });
  }
  if (name != "ballistic") {
    return fail(ErrorCode::kUnsupported,
                "unknown predictor '" + std::string(name) + "' (known: ballistic, field, contact)");
  }
  if (!constants.empty()) return fail(ErrorCode::kMalformed, "predictor 'ballistic' takes no constants");
  return std::make_unique<Ballistic>();
}

}  // namespace tandem
