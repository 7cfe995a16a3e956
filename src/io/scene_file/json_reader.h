#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

// Reads a scene file key by key; reports faults with their position.

namespace quoin::scene_json {

using Json = nlohmann::json;

/// A position in the file: a key or an index below another position; the file itself has neither. The text is only made
/// for errors.
struct Place {
  const Place* parent = nullptr;
  std::string_view key;
  std::optional<std::size_t> index;
};

/// The first fault found, with its position. Reading continues after it, but its result is discarded.
class Faults {
 public:
  void add(const Place& place, const std::string& what, ErrorCode code = ErrorCode::BadFormat);
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  std::optional<Error> error_;
};

/// Returns a piece of the file for a message.
[[nodiscard]] std::string excerpt(std::string_view text);

/// An object of the file that is read key by key. Missing keys leave the output of `read` unchanged.
class Object {
 public:
  /// `keys`: all keys that the object can have.
  Object(const Json& json, const Place& place, std::span<const std::string_view> keys, Faults& faults);
  Object(const Json& json, const Place& place, std::initializer_list<std::string_view> keys, Faults& faults)
      : Object(json, place, std::span(keys.begin(), keys.size()), faults) {}

  [[nodiscard]] const Json* find(std::string_view key) const;
  [[nodiscard]] const Json* need(std::string_view key) const;
  /// Requires: this object outlives the returned one.
  [[nodiscard]] Place place_of(std::string_view key) const { return {&place_, key, std::nullopt}; }

  void read(std::string_view key, std::string& out) const;
  /// Reads text of any bytes: a string, or {"base64": "..."} if it is not UTF-8.
  void read_text(std::string_view key, std::string& out) const;
  void read(std::string_view key, bool& out) const;
  void read(std::string_view key, double& out) const;
  void read(std::string_view key, float& out) const;
  void read(std::string_view key, DVec3& out) const;

  [[nodiscard]] std::string text(const Json& json, const Place& place) const;
  [[nodiscard]] std::vector<double> numbers(const Json& json, const Place& place, std::size_t count) const;
  /// Reads whole numbers from `least` to `most`.
  [[nodiscard]] std::vector<int> whole_numbers(const Json& json, const Place& place, std::size_t count, int least,
                                               int most) const;
  Faults& faults() const { return faults_; }

 private:
  [[nodiscard]] double number(const Json& json, const Place& place) const;

  const Json& json_;
  const Place& place_;
  Faults& faults_;
};

/// Normalises a vector unless it is unit up to rounding; reports a fault if it is all 0.
[[nodiscard]] std::vector<double> unit(std::vector<double> v, const Place& place, Faults& faults);

/// Reads a whole number from 0 to `most`; missing: returns `usual`.
[[nodiscard]] std::size_t small_number(const Object& object, std::string_view key, std::size_t most, std::size_t usual);

/// Reads a number of 32 bits; missing: returns nullopt.
[[nodiscard]] std::optional<std::uint32_t> bits_in(const Object& object, std::string_view key);

/// Returns the name of a value. Requires: it has one.
template <class T, std::size_t kCount>
const char* name_of(const std::array<std::pair<const char*, T>, kCount>& names, T value) {
  const char* found = nullptr;
  for (const auto& [name, each] : names) {
    if (each == value) found = name;
  }
  QUOIN_ASSERT(found != nullptr, "a value with a name");
  return found;
}

/// Reads the name of a value; missing: keeps `out`.
template <class T, std::size_t kCount>
void read_name(const Object& object, std::string_view key, const std::array<std::pair<const char*, T>, kCount>& names,
               T& out) {
  std::string name = name_of(names, out);
  object.read(key, name);
  std::string all;
  for (const auto& [each, value] : names) {
    if (name == each) {
      out = value;
      return;
    }
    all += (all.empty() ? "" : ", ") + std::string(each);
  }
  object.faults().add(object.place_of(key), "must be one of " + all);
}

/// Returns the list of that key, with at most so many entries; null if there is none.
[[nodiscard]] const Json* find_list(const Object& object, std::string_view key, std::size_t most);

/// Calls `read(element, place)` for each element of a list.
template <class Read>
void read_list(const Object& object, std::string_view key, std::size_t most, Read read) {
  const Json* list = find_list(object, key, most);
  const Place place = object.place_of(key);
  for (std::size_t i = 0; list != nullptr && i < list->size() && !object.faults().error(); ++i) {
    read((*list)[i], Place{&place, {}, i});
  }
}

}  // namespace quoin::scene_json
