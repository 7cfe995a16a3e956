#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/render/path_tracer.h>

namespace quoin {

/// Lets the picture of a view go on across edits: what an edit did not change stays as free of noise as it was.
///
/// A view converges by pictures of ever more samples, perhaps after smaller ones. Paths are chosen by pixel and sample,
/// not by scene: where an edit changed nothing, a picture of few samples is, noise and all, what it was before it. So
///
///   shown = new(n) + share * (before(best) - before(n))
///
/// takes the noise of n samples away again where it is known. The share is found around each pixel: 1 where nothing
/// changed, 0 where nothing of before is left. With as many samples as the best picture before the edit had, what is
/// shown is the new picture and nothing else. Until then it leans towards what was: light that few samples find, and
/// that an edit took away, goes over the first of them and not at once (docs/decisions/119).
///
///   PathHistory history;
///   for (const int samples : {1, 4, 16, 64}) {
///     options.samples = samples;
///     Result<PathPicture> picture = tracer.render(camera, options);
///     history.refine(*picture, samples);          // and show it
///   }
///   grid.set({1, 2, 3}, kAir);
///   tracer.update();
///   history.note_edit();                          // and from the first sample on again
///
/// Source: control variates with common random numbers, as A. Owen, "Monte Carlo theory, methods and examples" (2013),
///         8.9 and 8.6, has them; the share is their coefficient for pictures of equal noise.
class PathHistory {
 public:
  /// Another view, size, light or seed: nothing that was taken says anything of it.
  void clear();

  /// The scene was edited since the last picture: those that follow are of another one. Of earlier scenes the best
  /// picture is kept, with those that led to it.
  void note_edit();

  /// Whether pictures would be made better: one of an earlier scene has more pixels or samples than any since.
  [[nodiscard]] bool has_earlier() const { return !earlier_.empty(); }
  /// Whether that was led to by a picture of this size and so many samples. Only such ones are made better.
  [[nodiscard]] bool knows(int width, int height, int samples) const {
    return find_earlier(width, height, samples) != nullptr;
  }

  /// Remembers the light of a picture, and makes it what is to be shown: of the best earlier picture's size, with light
  /// as above. Layers, rays and counts stay those of the picture; layers that are of another size are left out.
  ///
  /// Requires: picture.radiance, scene and alpha have a value for each pixel; all pictures since `clear` show the same
  ///           view under the same options but for size and samples.
  void refine(PathPicture& picture, int samples, Threads threads = {});

  /// Of what it remembers: 4 a pixel of each picture since the edit, and of each that led to the best one before it.
  [[nodiscard]] std::size_t bytes() const;

 private:
  /// The light of a picture: see PackedLight.
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
                      PathPicture& picture);

  std::vector<Taken> earlier_;  // ever finer; of one scene
  std::vector<Taken> now_;      // likewise
};

}  // namespace quoin
