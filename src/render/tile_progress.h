#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include <quoin/core/progress.h>

namespace quoin {

/// Counts what is done of a picture's tiles and tells the listener, one call at a time: after each sample of a tile, or
/// after some of them, since a tile of many samples can take minutes.
class TileProgress {
 public:
  /// `samples`: of all tiles together.
  TileProgress(const Progress& listener, std::size_t samples) : listener_(&listener), samples_(samples) {}

  [[nodiscard]] bool is_cancelled() const { return is_cancelled_; }
  /// Returns whether to go on.
  bool add_samples(std::size_t samples = 1) {
    const std::lock_guard lock(mutex_);
    done_ += samples;
    if (is_cancelled_ || !*listener_) return !is_cancelled_;
    if (!(*listener_)(static_cast<double>(done_) / static_cast<double>(samples_))) is_cancelled_ = true;
    return !is_cancelled_;
  }
  void add_counts(std::int64_t rays, std::int64_t pixels_hit) {
    const std::lock_guard lock(mutex_);
    rays_ += rays;
    pixels_hit_ += pixels_hit;
  }
  // Once all is done.
  [[nodiscard]] std::int64_t rays() const { return rays_; }
  [[nodiscard]] std::int64_t pixels_hit() const { return pixels_hit_; }

 private:
  const Progress* listener_;
  std::size_t samples_;
  std::size_t done_ = 0;
  std::int64_t rays_ = 0;
  std::int64_t pixels_hit_ = 0;
  std::mutex mutex_;
  std::atomic<bool> is_cancelled_{false};
};

}  // namespace quoin
