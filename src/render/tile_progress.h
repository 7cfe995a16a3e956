#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>

namespace quoin {

/// Counts the finished samples of an image's tiles and calls the progress callback, one call at a time: after one or
/// several samples of a tile, because a tile with many samples can take minutes.
class TileProgress {
 public:
  /// `samples`: of all tiles together.
  TileProgress(const Progress& listener, std::size_t samples) : listener_(&listener), samples_(samples) {}

  [[nodiscard]] bool is_cancelled() const { return is_cancelled_; }
  /// Returns false to cancel.
  bool add_samples(std::size_t samples) {
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
  // Valid when all tiles are done.
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

/// Draws an image in squares of Tile::kEdge pixels. `Tile(context, column, row)`, given the upper left pixel, draws its
/// samples and writes them to the image. Errors: Cancelled.
template <class Tile, class Context, class Options, class Drawn>
[[nodiscard]] Status draw_tiles(const Context& context, const Options& options, Threads threads,
                                const Progress& progress, Drawn& image) {
  const auto across = static_cast<std::size_t>((options.width + Tile::kEdge - 1) / Tile::kEdge);
  const auto down = static_cast<std::size_t>((options.height + Tile::kEdge - 1) / Tile::kEdge);
  TileProgress done(progress, across * down * static_cast<std::size_t>(options.samples));
  parallel_for(across * down, threads, [&](std::size_t i) {
    if (done.is_cancelled()) return;
    Tile tile(context, static_cast<int>(i % across) * Tile::kEdge, static_cast<int>(i / across) * Tile::kEdge);
    if (!tile.render([&](std::size_t samples) { return done.add_samples(samples); })) return;
    tile.write_to(image);
    done.add_counts(tile.rays(), tile.pixels_hit());
  });
  if (done.is_cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  image.rays = done.rays();
  image.pixels_hit = done.pixels_hit();
  return {};
}

}  // namespace quoin
