// Writes one header, then the samples: i runs along x, j along z, k along y.

#include "io/volume/write.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/matrix.hpp>

#include "core/progress_steps.h"
#include "io/byte_writer.h"
#include "io/placed/placed_grids.h"
#include "io/volume/header.h"

namespace quoin {

namespace {

constexpr models::FormatHolds kHolds = {.extension = ".nii", .colours = false, .place_in_units = true};
constexpr int kMaxEdge = 32'767;
constexpr std::int64_t kMaxSamples = std::int64_t{1} << 30;
constexpr std::int16_t kUInt8 = 2;
constexpr std::int16_t kUInt16 = 512;
constexpr std::int16_t kFloat32 = 16;
constexpr std::int16_t kIntentLabel = 1002;
constexpr std::int16_t kScanner = 1;
constexpr std::size_t kLongestName = 15;

/// The content of the file except its samples.
struct Header {
  IBox box{};  ///< box of the samples, in the grid
  glm::dmat4 world_from_grid{1.0};
  std::int16_t datatype = kUInt8;
  int bytes = 1;  ///< bytes per sample
  std::int16_t intent = 0;
  std::string_view description{};
  std::string name{};
};

Status check_size(const IBox& box) {
  const IVec3 size = box.size();
  if (std::max({size.x, size.y, size.z}) <= kMaxEdge &&
      std::int64_t{size.x} * size.y <= kMaxSamples / std::max(size.z, 1))
    return {};
  return make_error(ErrorCode::LimitExceeded, "more than 32,767 samples per side, or 2^30 in total");
}

void write_header(const Header& header, ByteWriter& out) {
  constexpr std::size_t kHeaderBytes = 348;
  constexpr std::size_t kExtenderBytes = 4;
  const IVec3 size = header.box.size();
  // Maps (i, j, k) to samples of the grid, whose axes are (i, k, j).
  glm::dmat4 grid_from_file(0.0);
  grid_from_file[0][0] = grid_from_file[1][2] = grid_from_file[2][1] = 1.0;
  grid_from_file[3] = glm::dvec4(DVec3(header.box.min), 1.0);
  const glm::dmat4 affine =
      glm::inverse(glm::dmat4(quoin_from_space(VolumeSpace::RightFrontHead))) * header.world_from_grid * grid_from_file;
  const auto pad_to = [&](std::size_t at) { out.leave(at - out.size()); };
  const auto small = [&](std::int16_t value) { out.u16(static_cast<std::uint16_t>(value)); };
  const auto text = [&](std::string_view value, std::size_t room) {
    value = value.substr(0, room - 1);
    out.text(value);
    out.leave(room - value.size());
  };
  out.u32(kHeaderBytes);
  pad_to(40);
  for (const int extent : {3, size.x, size.z, size.y, 1, 1, 1, 1}) small(static_cast<std::int16_t>(extent));
  pad_to(68);
  small(header.intent);
  small(header.datatype);
  small(static_cast<std::int16_t>(8 * header.bytes));
  pad_to(76);
  out.f32(glm::determinant(glm::dmat3(affine)) < 0.0 ? -1.0F : 1.0F);
  for (int axis = 0; axis < 3; ++axis) out.f32(static_cast<float>(glm::length(DVec3(affine[axis]))));
  pad_to(108);
  out.f32(static_cast<float>(kHeaderBytes + kExtenderBytes));
  out.f32(1.0F);  // values are not scaled
  pad_to(148);
  text(header.description, 80);
  pad_to(252);
  small(0);
  small(kScanner);
  pad_to(280);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) out.f32(static_cast<float>(affine[column][row]));
  }
  text(header.name, 16);
  out.text({"n+1\0", 4});
  out.leave(kExtenderBytes);
}

/// Calls `row(first)` for each row of the samples, in the file's order.
template <class Row>
Status for_each_row(const IBox& box, const Progress& progress, Row row) {
  ProgressSteps steps(progress, static_cast<std::size_t>(box.size().y));
  for (int y = box.min.y; y < box.max.y; ++y) {
    for (int z = box.min.z; z < box.max.z; ++z) row(IVec3(box.min.x, y, z));
    steps.step();
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return {};
}

Result<models::ModelBytes> write_labels(const Scene& scene, const Progress& progress) {
  auto merged = models::merge_grids(scene, kHolds);
  if (!merged) return merged.error();
  if (merged->box.empty())
    return make_error(ErrorCode::Unsupported, "the scene has no voxels, and .nii needs at least one");
  if (auto sound = check_size(merged->box); !sound) return sound.error();
  const std::vector<VoxelType> types = merged->voxels.types();
  const bool is_wide = !types.empty() && *std::ranges::max_element(types) > 0xFF;
  Header header{merged->box};
  const double size = merged->voxel_size;
  for (int axis = 0; axis < 3; ++axis) header.world_from_grid[axis][axis] = size;
  header.world_from_grid[3] = glm::dvec4(DVec3(0.5 * size), 1.0);  // samples are at voxel centres
  header.datatype = is_wide ? kUInt16 : kUInt8;
  header.bytes = is_wide ? 2 : 1;
  header.intent = kIntentLabel;
  header.description = "Quoin: the numbers of voxels' types";
  header.name = models::cut_name(merged->name, kLongestName, merged->warnings);
  ByteWriter out;
  write_header(header, out);
  std::vector<VoxelType> row(static_cast<std::size_t>(merged->box.size().x));
  auto done = for_each_row(merged->box, progress, [&](IVec3 first) {
    models::read_voxels(merged->voxels, first, row);
    for (const VoxelType type : row) {
      if (is_wide) {
        out.u16(type);
      } else {
        out.u8(static_cast<std::uint8_t>(type));
      }
    }
  });
  if (!done) return done.error();
  return models::ModelBytes{out.take(), std::move(merged->warnings)};
}

Result<models::ModelBytes> write_densities(const Instance& instance, const SceneGrid& grid, const Progress& progress) {
  IBox box = grid.field.bounds();
  if (box.empty()) return make_error(ErrorCode::Unsupported, "the field is empty, and .nii needs samples");
  const IVec3 around(static_cast<int>(std::ceil(grid.field.band())));
  box = {box.min - around, box.max + around};
  if (auto sound = check_size(box); !sound) return sound.error();
  Header header{box, world_from_grid(instance, grid)};
  header.datatype = kFloat32;
  header.bytes = 4;
  header.description = "Quoin: densities, solid above 0";
  models::ModelBytes file;
  header.name = models::cut_name(instance.name.empty() ? grid.name : instance.name, kLongestName, file.warnings);
  ByteWriter out;
  write_header(header, out);
  auto done = for_each_row(box, progress, [&](IVec3 first) {
    for (; first.x < box.max.x; ++first.x) out.f32(-grid.field.density(first));
  });
  if (!done) return done.error();
  file.bytes = out.take();
  file.warnings.emplace_back("materials, colours, hidden instances and lamps left out, not supported by .nii");
  file.warnings.push_back("values are densities within " + std::to_string(around.x) +
                          " samples of the surface, without a unit, not the values of the input file");
  return file;
}

}  // namespace

Result<models::ModelBytes> write_nifti(const Scene& scene, const Progress& progress) {
  std::int64_t fields = 0;
  std::int64_t others = 0;
  const Instance* shown = nullptr;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const SceneGrid* const grid = scene.grids().find(instance.grid);
    if (grid == nullptr || !has_valid_transform(instance) || !is_shown(scene, instance)) return;
    const bool is_field = grid->field.chunk_count() != 0;
    if (is_field) shown = &instance;
    fields += is_field ? 1 : 0;
    others += grid->grid.chunk_count() != 0 ? 1 : 0;
  });
  if (fields == 0) return write_labels(scene, progress);
  if (fields > 1 || others > 0) {
    return make_error(ErrorCode::Unsupported,
                      "several density fields, or a density field and voxels: .nii stores one volume");
  }
  return write_densities(*shown, scene.grids()[shown->grid], progress);
}

}  // namespace quoin
