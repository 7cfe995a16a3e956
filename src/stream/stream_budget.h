#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace quoin::stream {

/// How much of a budget of bytes is taken by chunks, and will be by what is made of them, and how many more fit.
///
///   | fixed | chunks | what is made of these: ratio * chunks | on its way to the disk | room |
///
/// What is made of chunks (meshes, trees) comes later than they do, so it is expected before it is there: at first by a
/// guess, then as it turned out.
class StreamBudget {
 public:
  using Clock = std::chrono::steady_clock;

  /// `has_others`: whether anything is ever made of chunks.
  StreamBudget(std::size_t bytes, bool has_others);

  void add_chunk(std::size_t bytes) {
    ++chunks_;
    chunk_bytes_ += bytes;
  }
  void remove_chunk(std::size_t bytes) {
    --chunks_;
    chunk_bytes_ -= bytes;
  }
  void resize_chunk(std::size_t before, std::size_t now) { chunk_bytes_ = chunk_bytes_ - before + now; }
  /// Chunks that were read and not put in place yet.
  void set_arrived(std::size_t bytes) { arrived_bytes_ = bytes; }
  /// What else there is. `is_quiet`: no chunk came or went for some time, so that all is made that will be.
  void set_others(std::size_t reported, std::size_t pending, bool is_quiet, Clock::time_point now);

  [[nodiscard]] std::size_t loaded_chunks() const { return chunks_; }
  [[nodiscard]] std::size_t loaded_bytes() const { return chunk_bytes_; }
  [[nodiscard]] std::size_t reported_bytes() const { return reported_; }
  /// What is there is more than the budget.
  [[nodiscard]] bool is_over() const { return used() > static_cast<double>(budget_); }
  /// Bytes of chunks that may still be read, while workers are at so many; negative: too much is expected already.
  [[nodiscard]] std::int64_t room(std::size_t begun) const;
  /// Bytes of a chunk that is not known yet.
  [[nodiscard]] std::int64_t guess() const;
  /// How many chunks the budget suffices for. `planned`: as many were wanted last; `is_cut`: and more were asked for;
  /// `missing`: the share of them that is not there yet.
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
  std::size_t fixed_ = 0;  // of what is reported: what has nothing to do with chunks
  double ratio_ = 0.0;     // of what is made of chunks to their own bytes
  bool is_told_ = false;
  Clock::time_point told_{};
};

}  // namespace quoin::stream
