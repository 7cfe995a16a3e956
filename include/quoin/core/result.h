#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <tl/expected.hpp>

// The X11 headers define these common words as macros, which would break the declarations below.
#if defined(Status) || defined(None)
#error "Xlib.h defines Status and None as macros: include Quoin before it, or #undef them first"
#endif

namespace [[gnu::visibility("default")]] quoin {

enum class ErrorCode : std::uint8_t {
  InvalidArgument,  ///< The caller passed an invalid argument (a size of 0, an unknown option value).
  CannotRead,       ///< The operating system refused to open or read.
  CannotWrite,      ///< The operating system refused to create, write or rename, or the disk is full.
  BadFormat,        ///< The bytes contradict the format.
  Unsupported,      ///< The file or request is valid, but Quoin does not support it.
  LimitExceeded,    ///< More types, models, bytes or depth than can be represented.
  Cancelled,        ///< A progress callback returned false.
  DeviceLost,       ///< The graphics device was lost. Create it and all its resources again.
};

/// An error caused by outside data: a one-line message for people, and the place in the file if known.
struct Error {
  ErrorCode code = ErrorCode::BadFormat;
  std::string message;                       ///< One line, no full stop, no path.
  std::string path;                          ///< The file, or empty.
  std::optional<std::uint64_t> byte_offset;  ///< Position in the file, counted from 0.
};

/// Formats an error, for example "castle.vox: byte 1204: chunk SIZE claims 4294967295 x 40 x 40 voxels". A missing path
/// or byte offset is left out.
[[nodiscard]] std::string to_string(const Error& error);

/// A value or an Error: a tl::expected that converts implicitly from Error. Callers propagate an error with
/// `return loaded.error();`. Used only for failures caused by outside data or the system. Broken preconditions assert
/// instead (QUOIN_ASSERT).
template <class T>
class [[nodiscard]] Result : public tl::expected<T, Error> {
 public:
  using tl::expected<T, Error>::expected;
  Result(const Error& error) : tl::expected<T, Error>(tl::unexpect, error) {}
  Result(Error&& error) : tl::expected<T, Error>(tl::unexpect, std::move(error)) {}
};

/// Success or an Error.
using Status = Result<void>;

/// Creates an Error: `return make_error(ErrorCode::BadFormat, "no voxels", path);`.
[[nodiscard]] inline Error make_error(ErrorCode code, std::string message, std::string path = {},
                                      std::optional<std::uint64_t> byte_offset = std::nullopt) {
  return Error{code, std::move(message), std::move(path), byte_offset};
}

}  // namespace quoin
