#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/render/path_tracer.h>

namespace [[gnu::visibility("default")]] quoin {

/// Keeps a progressive path-traced view converged across edits: regions that an edit did not change stay as free of
/// noise as they were.
///
/// A view converges through images of increasing sample count, perhaps after smaller images. Random numbers depend on
/// pixel and sample, not on the scene. Where an edit changed nothing, an image of few samples is therefore identical,
/// noise included, to the image of as many samples before the edit. The shown image is
///
///   shown = new(n) + share * (before(best) - before(n))
///
/// This removes the known noise of n samples. The share is estimated around each pixel: 1 in unchanged regions, 0 where
/// the old image no longer correlates. Once the new image has as many samples as the best image before the edit, the
/// history shows the new image alone. Until then the result is biased towards the old image: light that only few
/// samples find, and that an edit removed, fades over the first samples instead of disappearing at once
/// (docs/decisions/archive/119).
///
///   PathHistory history;
///   for (const int samples : {1, 4, 16, 64}) {
///     options.samples = samples;
///     Result<PathImage> image = tracer.render(camera, options);
///     history.refine(*image, samples);          // and show it
///   }
///   grid.set({1, 2, 3}, kAir);
///   tracer.update();
///   history.note_edit();                          // then start again from the first sample
///
/// Source: control variates with common random numbers, A. Owen, "Monte Carlo theory, methods and examples" (2013), 8.9
///         and 8.6; the share is the control variate coefficient for images of equal noise.
class PathHistory {
 public:
  /// Forgets all images. Call it when the view, size, light or seed changes, because earlier images no longer apply.
  void clear();

  /// Records that the scene was edited since the last image. Keeps the best image of the earlier scenes and the coarser
  /// images that led to it.
  void note_edit();

  /// Returns true if the history can improve images: an image of an earlier scene has more pixels or samples than any
  /// image since the edit.
  [[nodiscard]] bool has_earlier() const { return !earlier_.empty(); }
  /// Returns true if the earlier images include one of this size and sample count. Only such images are improved.
  [[nodiscard]] bool knows(int width, int height, int samples) const {
    return find_earlier(width, height, samples) != nullptr;
  }

  /// Stores the light of an image and replaces it with the light to show: at the best earlier image's size, combined as
  /// above. Keeps the image's layers, rays and counts, but drops layers of another size.
  ///
  /// Requires: image.radiance, scene and alpha have one value per pixel; all images since `clear` show the same view
  ///           with the same options except size and samples.
  void refine(PathImage& image, int samples, Threads threads = {});

  /// Returns the bytes held: 4 per pixel of each image since the edit, and of each image that led to the best image
  /// before the edit.
  [[nodiscard]] std::size_t bytes() const;

 private:
  /// The light of an image: see PackedLight.
  struct Taken {
    int width = 0;
    int height = 0;
    int samples = 0;
    std::vector<std::uint32_t> light;
  };

  [[nodiscard]] const Taken* find_earlier(int width, int height, int samples) const;
  [[nodiscard]] static bool is_finer(const Taken& a, const Taken& b);
  [[nodiscard]] static std::vector<float> shares(const Taken& now, const Taken& before, const Taken& best,
                                                 Threads threads);
  static void combine(const Taken& before, const Taken& best, const std::vector<float>& shares, Threads threads,
                      PathImage& image);

  std::vector<Taken> earlier_;  // in order of increasing quality; of one scene
  std::vector<Taken> now_;      // in order of increasing quality; of the current scene
};

}  // namespace quoin
