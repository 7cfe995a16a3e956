#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/vox/chunks.h"

namespace quoin::vox {

/// The content of one chunk, with the errors that name it.
class ChunkReader : public ByteReader {
 public:
  ChunkReader(std::span<const std::byte> file, std::string_view id, std::size_t offset, std::size_t begin,
              std::size_t end)
      : ByteReader(file, begin, end), id_(id), offset_(offset) {}

  [[nodiscard]] std::string_view id() const { return id_; }
  /// Returns the offset of the chunk's header.
  [[nodiscard]] std::size_t offset() const { return offset_; }

  [[nodiscard]] std::string_view string() { return text(u32()); }
  [[nodiscard]] Dict dict();

  /// Returns BadFormat at the chunk: "chunk nTRN <what>".
  [[nodiscard]] Error error(const std::string& what) const {
    return bad_at(offset_, "chunk " + printable(id_) + " " + what);
  }
  [[nodiscard]] Error too_short() const { return error("ends before its content"); }

 private:
  std::string_view id_;
  std::size_t offset_;
};

}  // namespace quoin::vox
