#pragma once

#include <functional>

namespace quoin {

/// Told how far a long piece of work has come (0 to 1, never falling). Returns whether to go on: false cancels the
/// work. What returns a Result then gives ErrorCode::Cancelled. Edits of a Grid or a DensityGrid return how much they
/// had changed by then, which stays.
///
/// May be called from any thread, never from two at once, and never after the work has returned. An empty function
/// means nobody listens.
using Progress = std::function<bool(double fraction)>;

/// A listener for one of the stretches of a longer piece of work: what its fractions 0 to 1 are there is `begin` to
/// `end` of the whole.
///
///   mesh_scene(scene, {}, {}, part_of(progress, 0.0, 0.5));
///   write_mesh(*meshes, path, {}, part_of(progress, 0.5, 1.0));
///
/// Lifetime: `whole` must outlive it.
[[nodiscard]] inline Progress part_of(const Progress& whole, double begin, double end) {
  if (!whole) return {};
  return [&whole, begin, end](double fraction) { return whole(begin + fraction * (end - begin)); };
}
Progress part_of(const Progress&& whole, double begin, double end) = delete;  // it would be gone

}  // namespace quoin
