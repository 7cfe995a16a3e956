#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>

namespace quoin::stream {

/// Tracks how much of a byte budget is taken by chunks and by data derived from them, and how many chunks still fit.
///
///   | fixed | chunks | derived data: ratio * chunks | on its way to the disk | room |
///
/// Derived data (meshes, trees) appears after its chunks, so it is reserved in advance: first by a guess, then by the
/// measured ratio.
class StreamBudget {
 public:
  using Clock = std::chrono::steady_clock;

  /// `has_others`: true if data is derived from chunks.
  StreamBudget(std::size_t bytes, bool has_others);

  void add_chunk(std::size_t bytes) {
    ++chunks_;
    chunk_bytes_ += bytes;
  }
  void remove_chunk(std::size_t bytes) {
    QUOIN_ASSERT(chunks_ > 0 && chunk_bytes_ >= bytes, "a chunk that was added");
    --chunks_;
    chunk_bytes_ -= bytes;
  }
  void resize_chunk(std::size_t before, std::size_t now) {
    QUOIN_ASSERT(chunk_bytes_ >= before, "a chunk that was added");
    chunk_bytes_ = chunk_bytes_ - before + now;
  }
  /// Sets the bytes of chunks that were read but not put in place yet.
  void set_arrived(std::size_t bytes) { arrived_bytes_ = bytes; }
  /// Sets the other memory in use. `is_quiet`: no chunk came or went for some time, so all derived data is complete.
  void set_others(std::size_t reported, std::size_t pending, bool is_quiet, Clock::time_point now);

  [[nodiscard]] std::size_t loaded_chunks() const { return chunks_; }
  [[nodiscard]] std::size_t loaded_bytes() const { return chunk_bytes_; }
  [[nodiscard]] std::size_t reported_bytes() const { return reported_; }
  /// Returns true if the memory in use exceeds the budget.
  [[nodiscard]] bool is_over() const { return used() > static_cast<double>(budget_); }
  /// Returns the bytes of chunks that may still be read while workers process `begun` chunks; negative if too many
  /// bytes
  /// are already expected.
  [[nodiscard]] std::int64_t room(std::size_t begun) const;
  /// Returns the expected bytes of an unknown chunk.
  [[nodiscard]] std::int64_t guess() const;
  /// Returns the number of chunks that the budget allows. `planned`: chunks in the last plan. `is_cut`: the budget
  /// limited that plan. `missing`: share of the planned chunks that is not loaded yet.
  [[nodiscard]] std::size_t chunks(std::size_t planned, bool is_cut, double missing) const;

 private:
  [[nodiscard]] double used() const;
  [[nodiscard]] double expected() const;
  [[nodiscard]] double limit() const;

  std::size_t budget_;
  std::size_t chunks_ = 0;
  std::size_t chunk_bytes_ = 0;
  std::size_t arrived_bytes_ = 0;
  std::size_t reported_ = 0;
  std::size_t pending_ = 0;
  std::size_t fixed_ = 0;  // reported bytes that do not depend on chunks
  double ratio_ = 0.0;     // bytes of derived data per byte of chunks
  bool is_reported_ = false;
  Clock::time_point announced_{};
};

}  // namespace quoin::stream
