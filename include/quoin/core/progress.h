#pragma once

#include <atomic>
#include <functional>

namespace [[gnu::visibility("default")]] quoin {

/// A progress callback. Called with a non-decreasing fraction in [0, 1]. Return false to cancel.
///
/// A cancelled function that returns a Result fails with ErrorCode::Cancelled. A cancelled edit of a Grid or a
/// DensityGrid keeps the changes made so far and returns their number.
/// Threads: may be called from any thread, but never from two threads at once, and never after the work has returned.
/// An empty function reports no progress and never cancels.
using Progress = std::function<bool(double fraction)>;

/// Maps the progress of one step onto [begin, end] of the whole.
///
///   mesh_scene(scene, {}, {}, part_of(progress, 0.0, 0.5));
///   write_mesh(*meshes, path, {}, part_of(progress, 0.5, 1.0));
///
/// Lifetime: `whole` must outlive the result.
[[nodiscard]] inline Progress part_of(const Progress& whole, double begin, double end) {
  if (!whole) return {};
  return [&whole, begin, end](double fraction) { return whole(begin + fraction * (end - begin)); };
}
Progress part_of(const Progress&& whole, double begin, double end) = delete;  // would dangle

/// A request to end a call early, because its result is no longer needed. The call checks it between its steps:
///
///   if (cancelled.is_requested()) return make_error(ErrorCode::Cancelled, "cancelled");
///   generate_terrain(options, types, {1}, [&](double) { return !cancelled.is_requested(); });  // as a Progress
///
/// Threads:  any. A request is never withdrawn.
/// Lifetime: valid during the call that receives it.
class Cancellation {
 public:
  /// Never requested.
  Cancellation() = default;
  /// Requested as soon as `flag` is true. Lifetime: `flag` must outlive the object.
  explicit Cancellation(const std::atomic<bool>& flag) : flag_(&flag) {}

  [[nodiscard]] bool is_requested() const { return flag_ != nullptr && flag_->load(std::memory_order_relaxed); }

 private:
  const std::atomic<bool>* flag_ = nullptr;
};

}  // namespace quoin
