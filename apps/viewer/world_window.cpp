#include "world_window.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include <glm/geometric.hpp>
#include <quoin/core/memory.h>

namespace quoin::viewer {

namespace {

constexpr double kUpdateSeconds = 0.004;
constexpr double kUsualDistance = 640.0;
constexpr double kFov = 1.0;
// Upper bound for a chunk of a small world with all derived data, to estimate whether the world fits.
constexpr std::size_t kBytesOfChunk = 96 * 1024;
// Planning more chunks is slow. Most of them are air, which also takes some bytes.
constexpr double kMostPlanned = 1 << 17;
constexpr double kBytesOfAir = 300.0;
constexpr double kAround = 2.0 * kChunkEdge;
// Voxels below the feet.
constexpr double kGround = 8.0;

std::size_t quarter_of_memory() {
  constexpr std::size_t kLeast = std::size_t{256} << 20;
  const auto left = available_memory();
  return left ? std::max(kLeast, static_cast<std::size_t>(*left / 4)) : 4 * kLeast;
}

DVec3 middle_of(const DBox& box) {
  return 0.5 * box.min + 0.5 * box.max;
}

double smallest_voxel(const Scene& scene) {
  double smallest = 1.0;
  bool is_first = true;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (!has_valid_transform(instance)) continue;
    smallest = std::exchange(is_first, false) ? instance.voxel_size : std::min(smallest, instance.voxel_size);
  }
  return smallest;
}

/// Returns a camera above the middle of a box that looks into the distance.
Camera above(const DBox& box, DVec3 place) {
  const DVec3 position{place.x, box.max.y + 0.05 * (box.max.y - box.min.y), place.z};
  const auto camera = look_along(position, {1.0, -0.45, -1.0}, kFov);
  return camera ? *camera : Camera{};
}

}  // namespace

WorldWindow::WorldWindow(StreamedWorld world, const WorldOptions& options, std::shared_ptr<std::size_t> other_bytes)
    : world_(std::move(world)), options_(options), other_bytes_(std::move(other_bytes)) {}

Result<WorldWindow> WorldWindow::open(const std::filesystem::path& path, const WorldOptions& options) {
  return_freed_memory();
  const auto other_bytes = std::make_shared<std::size_t>(0);
  StreamOptions stream;
  stream.budget_bytes = options.memory_bytes == 0 ? quarter_of_memory() : options.memory_bytes;
  stream.other_bytes = [other_bytes] { return *other_bytes; };
  stream.update_seconds = kUpdateSeconds;
  std::string why_not_written = options.may_write ? "" : "it was opened for a screenshot";
  auto opened = StreamedWorld::open(path, options.may_write ? WorldAccess::Write : WorldAccess::Read, stream);
  if (!opened && options.may_write && opened.error().code == ErrorCode::CannotWrite) {
    why_not_written = opened.error().message;
    opened = StreamedWorld::open(path, WorldAccess::Read, stream);
  }
  if (!opened) return opened.error();
  WorldWindow window(std::move(*opened), options, other_bytes);
  window.why_not_written_ = std::move(why_not_written);
  if (!(options.distance > 0.0)) window.options_.distance = kUsualDistance * smallest_voxel(window.scene());
  const auto extent = window.world_.extent();
  if (!extent) return extent.error();
  window.extent_ = *extent;
  const DBox& stored = extent->stored;
  const double half = stored.empty() ? 0.0 : 0.5 * glm::length(stored.max - stored.min);
  const Viewer all{middle_of(stored), DVec3(0.0), half + kAround};
  const double planned = window.chunks_around(all.radius);
  const double bytes = static_cast<double>(extent->stored_chunks * kBytesOfChunk) + planned * kBytesOfAir;
  const bool fits = planned <= kMostPlanned && bytes <= static_cast<double>(stream.budget_bytes);
  if (!stored.empty() && extent->generated.empty() && fits) window.all_ = all;
  return window;
}

// Returns the number of chunks within a ball, over all grids that are loaded by chunks.
double WorldWindow::chunks_around(double radius) const {
  constexpr double kBall = 4.19;
  double sum = 0.0;
  for (const InstanceHandle handle : scene().instances().handles()) {
    const Instance& instance = scene().instances()[handle];
    const SceneGrid* const grid = scene().grids().find(instance.grid);
    if (grid == nullptr || !grid->grid.is_partial() || !has_valid_transform(instance)) continue;
    const double chunks = radius / (instance.voxel_size * kChunkEdge) + 1.0;
    sum += kBall * chunks * chunks * chunks;
  }
  return sum;
}

Camera WorldWindow::first_camera(double aspect) const {
  if (opened().camera) return *opened().camera;
  if (all_) return frame_view(extent_.stored, View::Iso, aspect);
  const DBox& land = extent_.generated.empty() ? extent_.stored : extent_.generated;
  if (land.empty()) return frame_view({DVec3(-kAround), DVec3(kAround)}, View::Iso, aspect);
  // An endless landscape begins around the origin.
  return above(land, extent_.generated.empty() ? middle_of(land) : DVec3(0.5));
}

DBox WorldWindow::bounds(DVec3 from) const {
  if (all_) return extent_.stored;
  const DVec3 around(0.25 * options_.distance);
  DBox bounds{from - around, from + around};
  const DBox& land = extent_.generated.empty() ? extent_.stored : extent_.generated;
  if (!land.empty()) {
    bounds.min.y = land.min.y;
    bounds.max.y = land.max.y;
  }
  return bounds;
}

std::vector<Viewer> WorldWindow::viewers(const Camera& camera) const {
  if (all_) return {*all_};
  return {Viewer{camera.position, camera.forward, options_.distance}};
}

Status WorldWindow::plan(const Camera& camera) {
  Status outcome = world_.plan(viewers(camera));
  stats_ = world_.stats();
  return outcome;
}

Status WorldWindow::move(const Camera& camera) {
  Status outcome = world_.update(viewers(camera));
  stats_ = world_.stats();
  return outcome;
}

bool WorldWindow::is_complete() const {
  return stats_.is_complete && !has_chunks_to_move();
}

// Damaged chunks never arrive and are not waited for.
bool WorldWindow::is_loaded_at(DVec3 point) const {
  if (is_complete()) return true;
  const Scene& scene = world_.scene();
  return std::ranges::all_of(scene.instances().handles(), [&](InstanceHandle handle) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid* const grid = scene.grids().find(instance.grid);
    if (grid == nullptr || !grid->grid.is_partial() || !has_valid_transform(instance)) return true;
    const DVec3 at = grid_from_world(instance, *grid, point);
    if (!(glm::length(at) < 1e9)) return true;
    const DVec3 below = at - DVec3(0.0, kGround, 0.0);
    const auto is_there = [&](DVec3 voxel) { return grid->grid.is_loaded(chunk_of(IVec3(glm::floor(voxel)))); };
    return is_there(at) && is_there(below);
  });
}

Result<WorldCopy> WorldWindow::copy_to(const std::filesystem::path& path, const Progress& progress) {
  if (why_not_written_.empty()) {
    if (Status saved = flush(); !saved) return saved.error();
  }
  return copy_world(world_.store().path(), path, progress);
}

std::string WorldWindow::text() const {
  std::array<char, 128> text{};
  const double megabytes = static_cast<double>(stats_.loaded_bytes + stats_.other_bytes) / 1e6;
  if (stats_.is_complete) {
    std::snprintf(text.data(), text.size(), "%zu chunks, %.0f MB", stats_.loaded_chunks, megabytes);
  } else {
    std::snprintf(text.data(), text.size(), "%zu of %zu chunks, %.0f MB", stats_.wanted_chunks - stats_.missing_chunks,
                  stats_.wanted_chunks, megabytes);
  }
  return text.data();
}

}  // namespace quoin::viewer
