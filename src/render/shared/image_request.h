#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/render/cpu_renderer.h>

#include "core/work/progress_steps.h"

namespace quoin {

/// Returns InvalidArgument for sizes and cameras that every renderer rejects.
[[nodiscard]] Status check_image(const Camera& camera, int width, int height);

/// Returns the argument errors of CpuRenderer::render, which all renderers share.
[[nodiscard]] Status check(const Camera& camera, const RenderOptions& options);

/// Returns the options of an image with the environment set: their own, or that of the scene.
template <class Options>
[[nodiscard]] Options with_environment(Options options, const Environment& of_scene) {
  if (!options.environment) options.environment = of_scene;
  return options;
}

/// Returns an image of the requested size, with depths if requested.
[[nodiscard]] RenderedImage empty_image(const RenderOptions& options);

/// Draws an image in squares of Tile::kEdge pixels. `Tile(context, column, row)`, given the upper left pixel, draws its
/// samples and writes them to the image. Reports one or several samples of a tile at a time, because a tile with many
/// samples can take minutes. Errors: Cancelled.
template <class Tile, class Context, class Options, class Drawn>
[[nodiscard]] Status draw_tiles(const Context& context, const Options& options, Threads threads,
                                const Progress& progress, Drawn& image) {
  const auto across = static_cast<std::size_t>((options.width + Tile::kEdge - 1) / Tile::kEdge);
  const auto down = static_cast<std::size_t>((options.height + Tile::kEdge - 1) / Tile::kEdge);
  ProgressSteps done(progress, across * down * static_cast<std::size_t>(options.samples));
  std::atomic<std::int64_t> rays{0};
  std::atomic<std::int64_t> pixels_hit{0};
  parallel_for(across * down, threads, [&](std::size_t i) {
    if (done.cancelled()) return;
    Tile tile(context, static_cast<int>(i % across) * Tile::kEdge, static_cast<int>(i / across) * Tile::kEdge);
    if (!tile.render([&](std::size_t samples) { return done.add(static_cast<double>(samples)); })) return;
    tile.write_to(image);
    rays += tile.rays();
    pixels_hit += tile.pixels_hit();
  });
  if (done.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  image.rays = rays;
  image.pixels_hit = pixels_hit;
  return {};
}

}  // namespace quoin
