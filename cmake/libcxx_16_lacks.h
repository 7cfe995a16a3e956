#pragma once

// C++20 features used by the sources but missing from libc++ 16, for the preset "clang", which uses that library:
// std::jthread (added in libc++ 18) and std::from_chars of floating-point numbers (libc++ 20).

#include <version>

#if defined(_LIBCPP_VERSION) && __cplusplus >= 202002L

#include <cerrno>
#include <charconv>
#include <clocale>
#include <concepts>
#include <cstdlib>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>

namespace std {

#ifndef __cpp_lib_jthread
class jthread {
 public:
  jthread() = default;
  template <class Function, class... Arguments>
    requires(!same_as<remove_cvref_t<Function>, jthread>)
  explicit jthread(Function&& function, Arguments&&... arguments)
      : thread_(std::forward<Function>(function), std::forward<Arguments>(arguments)...) {}
  jthread(jthread&&) = default;
  jthread& operator=(jthread&& other) noexcept {
    if (joinable()) join();
    thread_ = std::move(other.thread_);
    return *this;
  }
  ~jthread() {
    if (joinable()) join();
  }
  [[nodiscard]] bool joinable() const { return thread_.joinable(); }
  void join() { thread_.join(); }

 private:
  thread thread_;
};
#endif

/// Same as the standard's for chars_format::general: no leading space, "+" or "0x", and no locale.
template <floating_point Number>
from_chars_result from_chars(const char* first, const char* last, Number& value) {
  string text(first, last);
  const size_t sign = text.starts_with('-') ? 1 : 0;
  const bool begins_well = text.size() > sign && string_view(" \t\n\v\f\r+-").find(text[sign]) == string_view::npos;
  if (!begins_well) return {first, errc::invalid_argument};
  if (text.compare(sign, 2, "0x") == 0 || text.compare(sign, 2, "0X") == 0) text.resize(sign + 1);
  static const locale_t plain = newlocale(LC_ALL_MASK, "C", nullptr);
  char* end = nullptr;
  errno = 0;
  Number read = 0;
  if constexpr (same_as<Number, float>) {
    read = strtof_l(text.c_str(), &end, plain);
  } else {
    read = strtod_l(text.c_str(), &end, plain);
  }
  if (end == text.c_str()) return {first, errc::invalid_argument};
  const char* stop = first + (end - text.c_str());
  if (errno == ERANGE) return {stop, errc::result_out_of_range};
  value = read;
  return {stop, errc{}};
}

}  // namespace std

#endif
