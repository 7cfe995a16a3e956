#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <tl/expected.hpp>

// X11's headers make these common words macros, by which nothing below could be read.
#if defined(Status) || defined(None)
#error "Xlib.h defines Status and None as macros: include Quoin before it, or #undef them first"
#endif

namespace quoin {

enum class ErrorCode : std::uint8_t {
  InvalidArgument,  ///< The caller asked for something that cannot be (a size of 0, an unknown option value).
  CannotRead,       ///< The operating system refused to open or read.
  CannotWrite,      ///< The operating system refused to create, write or rename; a full disk.
  BadFormat,        ///< The bytes contradict the format.
  Unsupported,      ///< A valid file or request that Quoin cannot serve.
  LimitExceeded,    ///< More types, models, bytes or depth than can be represented.
  Cancelled,        ///< A progress callback asked to stop.
  DeviceLost,       ///< The graphics device stopped working; what was made on it has to be made anew.
};

/// What went wrong with data from outside: one line for a person, with the place where there is one.
struct Error {
  ErrorCode code = ErrorCode::BadFormat;
  std::string message;                       ///< One line, no full stop, no path.
  std::string path;                          ///< The file, or empty.
  std::optional<std::uint64_t> byte_offset;  ///< Where in the file, counted from 0.
};

/// "castle.vox: byte 1204: chunk SIZE claims 4294967295 x 40 x 40 voxels"; parts that are absent are left out.
[[nodiscard]] std::string to_string(const Error& error);

/// A value, or why there is none: a tl::expected to which an Error converts implicitly, so callers propagate one with
/// `return loaded.error();`. Used for outside data only; a programmer's mistake asserts.
template <class T>
class [[nodiscard]] Result : public tl::expected<T, Error> {
 public:
  using tl::expected<T, Error>::expected;
  Result(const Error& error) : tl::expected<T, Error>(tl::unexpect, error) {}
  Result(Error&& error) : tl::expected<T, Error>(tl::unexpect, std::move(error)) {}
};

/// Success, or what went wrong.
using Status = Result<void>;

/// An Error in one call: `return make_error(ErrorCode::BadFormat, "no voxels", path);`.
[[nodiscard]] inline Error make_error(ErrorCode code, std::string message, std::string path = {},
                                      std::optional<std::uint64_t> byte_offset = std::nullopt) {
  return Error{code, std::move(message), std::move(path), byte_offset};
}

}  // namespace quoin
