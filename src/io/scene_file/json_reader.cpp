#include "io/scene_file/json_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <quoin/core/assert.h>

#include "core/bytes/text.h"

namespace quoin::scene_json {
namespace {

std::string text_of(const Place& place) {
  const std::string above = place.parent != nullptr ? text_of(*place.parent) : std::string();
  if (place.index) return above + "[" + std::to_string(*place.index) + "]";
  if (above.empty()) return std::string(place.key);
  return above + "." + std::string(place.key);
}

}  // namespace

void Faults::add(const Place& place, const std::string& what, ErrorCode code) {
  if (error_) return;
  const std::string where = text_of(place);
  error_ = Error{code, where.empty() ? what : where + ": " + what, {}, std::nullopt};
}

std::string excerpt(std::string_view text) {
  constexpr std::size_t kMost = 60;
  std::string out;
  out.append(1, '"').append(text.substr(0, kMost)).append(1, '"');
  return out;
}

Object::Object(const Json& json, const Place& place, std::span<const std::string_view> keys, Faults& faults)
    : json_(json), place_(place), faults_(faults) {
  if (!json.is_object()) {
    faults.add(place, "must be an object");
    return;
  }
  for (const auto& [key, value] : json.items()) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      faults.add(place, excerpt(key) + " is unknown here");
    }
  }
}

const Json* Object::find(std::string_view key) const {
  if (!json_.is_object()) return nullptr;
  const auto found = json_.find(key);
  return found == json_.end() ? nullptr : &*found;
}

const Json* Object::need(std::string_view key) const {
  const Json* found = find(key);
  if (found == nullptr && json_.is_object()) faults_.add(place_, excerpt(key) + " is missing");
  return found;
}

void Object::read(std::string_view key, std::string& out) const {
  const Json* json = find(key);
  if (json == nullptr) return;
  if (json->is_string()) {
    out = json->get<std::string>();
  } else {
    faults_.add(place_of(key), "must be a string");
  }
}

void Object::read_text(std::string_view key, std::string& out) const {
  const Json* json = find(key);
  if (json != nullptr) out = text(*json, place_of(key));
}

std::string Object::text(const Json& json, const Place& place) const {
  if (json.is_string()) return json.get<std::string>();
  if (json.is_object() && json.size() == 1 && json.contains("base64") && json["base64"].is_string()) {
    const auto bytes = from_base64(json["base64"].get_ref<const std::string&>());
    if (bytes) return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
  }
  faults_.add(place, "must be a string, or {\"base64\": \"...\"} if it is not UTF-8");
  return {};
}

void Object::read(std::string_view key, bool& out) const {
  const Json* json = find(key);
  if (json == nullptr) return;
  if (json->is_boolean()) {
    out = json->get<bool>();
  } else {
    faults_.add(place_of(key), "must be true or false");
  }
}

void Object::read(std::string_view key, double& out) const {
  const Json* json = find(key);
  if (json != nullptr) out = number(*json, place_of(key));
}

void Object::read(std::string_view key, float& out) const {
  const Json* json = find(key);
  if (json == nullptr) return;
  out = static_cast<float>(number(*json, place_of(key)));
  if (!std::isfinite(out)) faults_.add(place_of(key), "is too large");
}

void Object::read(std::string_view key, DVec3& out) const {
  const Json* json = find(key);
  if (json == nullptr) return;
  const std::vector<double> v = numbers(*json, place_of(key), 3);
  out = {v[0], v[1], v[2]};
}

std::vector<double> Object::numbers(const Json& json, const Place& place, std::size_t count) const {
  std::vector<double> values(count, 0.0);
  if (!json.is_array() || json.size() != count) {
    faults_.add(place, std::string("must be a list of ").append(std::to_string(count)).append(" numbers"));
    return values;
  }
  for (std::size_t i = 0; i < count; ++i) values[i] = number(json[i], {&place, {}, i});
  return values;
}

std::vector<int> Object::whole_numbers(const Json& json, const Place& place, std::size_t count, int least,
                                       int most) const {
  QUOIN_ASSERT(least <= most, "least <= most");
  std::vector<int> whole;
  for (const double value : numbers(json, place, count)) {
    const bool fits = value >= least && value <= most && value == std::floor(value);
    if (!fits) {
      faults_.add(place, "must be whole numbers from " + std::to_string(least) + " to " + std::to_string(most));
    }
    whole.push_back(fits ? static_cast<int>(value) : least);
  }
  QUOIN_ASSERT(whole.size() == count, "as many numbers as wanted");
  return whole;
}

double Object::number(const Json& json, const Place& place) const {
  if (!json.is_number()) {
    faults_.add(place, "must be a number");
    return 0.0;
  }
  const auto value = json.get<double>();
  if (!std::isfinite(value)) faults_.add(place, "is too large");
  return value;
}

std::vector<double> unit(std::vector<double> v, const Place& place, Faults& faults) {
  double largest = 0.0;
  for (const double x : v) largest = std::max(largest, std::abs(x));
  if (!(largest > 0.0)) {
    faults.add(place, "must not be all 0");
    return v;
  }
  double length_squared = 0.0;
  for (const double x : v) length_squared += x * x;
  if (std::abs(length_squared - 1.0) <= 8 * std::numeric_limits<double>::epsilon()) return v;
  // Scaled first, since the square of a very small or large number is 0 or infinite.
  double squared = 0.0;
  for (double& x : v) squared += (x / largest) * (x / largest);
  for (double& x : v) x = x / largest / std::sqrt(squared);
  return v;
}

std::size_t small_number(const Object& object, std::string_view key, std::size_t most, std::size_t usual) {
  const Json* number = object.find(key);
  if (number == nullptr) return usual;
  if (number->is_number_unsigned() && *number <= most) return number->get<std::size_t>();
  object.faults().add(object.place_of(key), "must be a whole number from 0 to " + std::to_string(most));
  return usual;
}

std::optional<std::uint32_t> bits_in(const Object& object, std::string_view key) {
  const Json* json = object.find(key);
  if (json == nullptr) return std::nullopt;
  if (json->is_number_unsigned() && json->get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max()) {
    return json->get<std::uint32_t>();
  }
  object.faults().add(object.place_of(key), "must be a whole number from 0 to 4294967295");
  return std::nullopt;
}

const Json* find_list(const Object& object, std::string_view key, std::size_t most) {
  const Json* list = object.need(key);
  if (list == nullptr) return nullptr;
  if (!list->is_array()) {
    object.faults().add(object.place_of(key), "must be a list");
    return nullptr;
  }
  if (list->size() <= most) return list;
  object.faults().add(object.place_of(key), "has more than " + std::to_string(most) + " entries",
                      ErrorCode::LimitExceeded);
  return nullptr;
}

}  // namespace quoin::scene_json
