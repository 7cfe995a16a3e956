#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <quoin/io/vox.h>

#include "io/vox/chunks.h"
#include "io/vox/write/vox_parts.h"

/// Shared by the tests and the fuzz target of .vox.
namespace quoin::vox_test {

using Entries = std::vector<std::pair<std::string, std::string>>;
/// x, y, z, colour index, in MagicaVoxel's axes.
using FileVoxel = std::array<std::uint8_t, 4>;

/// Builds .vox files chunk by chunk, right or wrong.
class FileBuilder {
 public:
  FileBuilder& chunk(std::string_view id, std::span<const std::byte> content) {
    const std::size_t begin = out_.begin_chunk(id);
    out_.raw(content);
    out_.end_chunk(begin);
    return *this;
  }
  FileBuilder& size(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return with("SIZE", [&](auto& out) {
      for (const std::uint32_t edge : {x, y, z}) out.u32(edge);
    });
  }
  FileBuilder& voxels(const std::vector<FileVoxel>& voxels) {
    return with("XYZI", [&](auto& out) {
      out.u32(static_cast<std::uint32_t>(voxels.size()));
      out.raw(std::as_bytes(std::span(voxels)));
    });
  }
  FileBuilder& model(std::uint32_t x, std::uint32_t y, std::uint32_t z, const std::vector<FileVoxel>& filled) {
    return size(x, y, z).voxels(filled);
  }
  FileBuilder& transform(std::int32_t id, std::int32_t child, const std::vector<Entries>& frames,
                         const Entries& attributes = {}, std::int32_t layer = 0) {
    return with("nTRN", [&](auto& out) {
      out.i32(id);
      out.dict(attributes);
      out.i32(child);
      out.i32(-1);
      out.i32(layer);
      out.u32(static_cast<std::uint32_t>(frames.size()));
      for (const Entries& frame : frames) out.dict(frame);
    });
  }
  FileBuilder& group(std::int32_t id, const std::vector<std::int32_t>& children) {
    return with("nGRP", [&](auto& out) {
      out.i32(id);
      out.dict({});
      out.u32(static_cast<std::uint32_t>(children.size()));
      for (const std::int32_t child : children) out.i32(child);
    });
  }
  FileBuilder& shape(std::int32_t id, std::uint32_t model) { return shape(id, {{model, {}}}); }
  FileBuilder& shape(std::int32_t id, const std::vector<std::pair<std::uint32_t, Entries>>& models,
                     const Entries& attributes = {}) {
    return with("nSHP", [&](auto& out) {
      out.i32(id);
      out.dict(attributes);
      out.u32(static_cast<std::uint32_t>(models.size()));
      for (const auto& [model, frame] : models) {
        out.u32(model);
        out.dict(frame);
      }
    });
  }
  FileBuilder& layer(std::int32_t id, const Entries& attributes) {
    return with("LAYR", [&](auto& out) {
      out.i32(id);
      out.dict(attributes);
      out.i32(-1);
    });
  }
  FileBuilder& material(std::int32_t id, const Entries& entries) {
    return with("MATL", [&](auto& out) {
      out.i32(id);
      out.dict(entries);
    });
  }
  /// Calls `fill(ChunkWriter&)` for the content.
  template <class Fill>
  FileBuilder& with(std::string_view id, Fill fill) {
    const std::size_t begin = out_.begin_chunk(id);
    fill(out_);
    out_.end_chunk(begin);
    return *this;
  }

  /// The whole file.
  std::vector<std::byte> file(std::uint32_t version = 150) {
    const std::vector<std::byte> chunks = out_.take();
    vox::ChunkWriter whole;
    whole.text("VOX ");
    whole.u32(version);
    const std::size_t main = whole.begin_chunk("MAIN");
    whole.end_chunk(main, chunks.size());
    whole.raw(chunks);
    return whole.take();
  }

 private:
  vox::ChunkWriter out_;
};

using VoxelList = std::vector<std::tuple<int, int, int, VoxelType>>;

inline VoxelList voxels_of(const Grid& grid) {
  VoxelList list;
  visit_voxels(grid, [&](IVec3 v, VoxelType type) { list.emplace_back(v.x, v.y, v.z, type); });
  return list;
}

/// Returns the first difference between two grids, or "".
inline std::string grid_difference(const SceneGrid& a, const SceneGrid& b) {
  if (a.name != b.name) return "name \"" + a.name + "\" and \"" + b.name + "\"";
  if (!(a.canvas == b.canvas)) return "canvas";
  if (a.pivot != b.pivot) return "pivot";
  if (voxels_of(a.grid) != voxels_of(b.grid)) return "voxels";
  return {};
}

inline std::string instance_difference(const Instance& a, const Instance& b) {
  if (a.name != b.name) return "name \"" + a.name + "\" and \"" + b.name + "\"";
  if (a.position != b.position) return "position";
  if (a.rotation != b.rotation || a.mirrored != b.mirrored) return "rotation";
  if (a.voxel_size != b.voxel_size) return "voxel size";
  if (a.visible != b.visible) return "visibility";
  return {};
}

inline std::string type_difference(const Scene& a, const Scene& b) {
  if (a.types.size() != b.types.size()) return "number of types";
  for (std::size_t i = 0; i < a.types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    if (!(a.types[type] == b.types[type])) return "type " + std::to_string(i);
  }
  return {};
}

/// Returns the first difference between two scenes, or "": types, grids and instances, in order, and the grid of each
/// instance.
inline std::string difference(const Scene& a, const Scene& b) {
  const auto grids_a = a.grids().handles();
  const auto grids_b = b.grids().handles();
  const auto instances_a = a.instances().handles();
  const auto instances_b = b.instances().handles();
  if (grids_a.size() != grids_b.size()) return "number of grids";
  if (instances_a.size() != instances_b.size()) return "number of instances";
  if (std::string found = type_difference(a, b); !found.empty()) return found;
  std::map<GridHandle, GridHandle> partner;
  for (std::size_t i = 0; i < grids_a.size(); ++i) {
    partner[grids_a[i]] = grids_b[i];
    const std::string found = grid_difference(a.grids()[grids_a[i]], b.grids()[grids_b[i]]);
    if (!found.empty()) return "grid " + std::to_string(i) + ": " + found;
  }
  for (std::size_t i = 0; i < instances_a.size(); ++i) {
    const Instance& x = a.instances()[instances_a[i]];
    const Instance& y = b.instances()[instances_b[i]];
    if (partner[x.grid] != y.grid) return "instance " + std::to_string(i) + ": grid";
    const std::string found = instance_difference(x, y);
    if (!found.empty()) return "instance " + std::to_string(i) + ": " + found;
  }
  return {};
}

/// Writes the scene and reads it again. Returns a difference or an error; "" if the scenes are equal.
inline std::string difference_after_round_trip(const Scene& scene) {
  const Result<VoxBytes> written = write_vox(scene);
  if (!written) return "cannot write: " + to_string(written.error());
  const Result<LoadedScene> again = read_vox(written->bytes);
  if (!again) return "cannot read: " + to_string(again.error());
  return difference(scene, again->scene);
}

/// Reads arbitrary bytes. Readable files must survive writing and reading again, unless they exceed the limits of the
/// format; errors must be one line. Returns a fault, or "".
inline std::string wrong_with(std::span<const std::byte> bytes, const LoadOptions& options = {}) {
  const Result<LoadedScene> loaded = read_vox(bytes, options);
  if (!loaded) {
    const std::string text = to_string(loaded.error());
    return text.empty() || text.find('\n') != std::string::npos ? "the error is not one line: " + text : "";
  }
  const Result<VoxBytes> written = write_vox(loaded->scene);
  if (!written) {
    return written.error().code == ErrorCode::LimitExceeded ? "" : "cannot write: " + to_string(written.error());
  }
  const Result<LoadedScene> again = read_vox(written->bytes, {.show_hidden = false, .frame = 0});
  if (!again) return "cannot read the written file: " + to_string(again.error());
  return difference(loaded->scene, again->scene);
}

/// Returns the bytes of all grids in a scene.
inline std::size_t grid_bytes(const Scene& scene) {
  std::size_t bytes = 0;
  for (const GridHandle grid : scene.grids().handles()) bytes += scene.grids()[grid].grid.bytes();
  return bytes;
}

}  // namespace quoin::vox_test
