#include "io/block_writer.h"

#include <algorithm>

namespace quoin {

void BlockWriter::put(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    if (used_ == kBlockBytes) flush();
    const std::size_t count = std::min(bytes.size(), kBlockBytes - used_);
    std::memcpy(block_.data() + used_, bytes.data(), count);
    used_ += count;
    bytes = bytes.subspan(count);
  }
}

void BlockWriter::align(char filler) {
  while (bytes() % 4 != 0) put(filler);
}

Status BlockWriter::finish() {
  flush();
  return status_;
}

void BlockWriter::flush() {
  if (status_) status_ = sink_(std::span(block_).first(used_));
  written_ += used_;
  used_ = 0;
  if (!status_ || !progress_) return;
  const double done = static_cast<double>(written_) / static_cast<double>(std::max(written_, expected_bytes_));
  if (!progress_(expected_bytes_ == 0 ? 0.0 : done)) status_ = make_error(ErrorCode::Cancelled, "cancelled");
}

}  // namespace quoin
