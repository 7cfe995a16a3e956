#pragma once

// Scenes with random edits, and their expected surfaces.

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/voxel_field.h>
#include <quoin/live/live_meshes.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/smooth_mesh.h>

#include "core/coordinates/chunk_order.h"
#include "mesh/surface/smooth_surface.h"
#include "mesh/surface/voxel_surface.h"

namespace quoin {

inline bool operator<(const SurfaceUpdate& a, const SurfaceUpdate& b) {
  if (!(a.grid == b.grid)) return a.grid < b.grid;
  return a.content == b.content ? by_zyx(a.chunk, b.chunk) : a.content < b.content;
}

// The oracles take up to a hundred times as long under the sanitizers.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr bool kIsSlow = true;
#else
inline constexpr bool kIsSlow = false;
#endif

/// Grass, glass and stone.
inline VoxelRegistry live_types() {
  VoxelRegistry types;
  VoxelProperties properties;
  properties.colour = {200, 30, 90, 255};
  EXPECT_TRUE(types.add(properties).has_value());
  properties.colour = {0, 130, 190, 120};
  properties.visibility = Visibility::Transparent;
  EXPECT_TRUE(types.add(properties).has_value());
  properties.colour = {77, 77, 70, 255};
  properties.visibility = Visibility::Opaque;
  EXPECT_TRUE(types.add(properties).has_value());
  return types;
}

/// The surfaces that a client holds after it applies the updates.
class ShownSurfaces {
 public:
  void apply(const std::vector<SurfaceUpdate>& updates) {
    std::set<SurfaceUpdate> given;
    for (const SurfaceUpdate& update : updates) {
      EXPECT_TRUE(given.insert(update).second) << "given twice";
      const auto found = shown_.find(update);
      if (found != shown_.end()) shown_.erase(found);
      if (update.surface == nullptr) {
        EXPECT_TRUE(found != shown_.end()) << "nothing was there to take away";
        continue;
      }
      EXPECT_FALSE(update.surface->is_empty());
      shown_.insert(update);
    }
  }
  [[nodiscard]] const std::set<SurfaceUpdate>& all() const { return shown_; }
  [[nodiscard]] const ChunkSurface* find(GridHandle grid, IVec3 chunk,
                                         SurfaceContent content = SurfaceContent::Voxels) const {
    const auto found = shown_.find({grid, chunk, nullptr, content});
    return found == shown_.end() ? nullptr : found->surface.get();
  }

 private:
  std::set<SurfaceUpdate> shown_;
};

inline std::set<GridHandle> grids_of_drawn(const Scene& scene, InstanceFilter filter) {
  std::set<GridHandle> drawn;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    if (passes(filter, scene, instance)) drawn.insert(instance.grid);
  });
  return drawn;
}

/// Returns the quads, cut at multiples of `edge`, in ascending order of their bits.
inline std::vector<std::uint64_t> cut_at(const QuadBuffer& quads, int edge) {
  std::vector<std::uint64_t> parts;
  for (const Quad quad : quads) {
    const FaceFrame& frame = frame_of(quad.direction());
    const IVec3 first = quad.voxel();
    for (int u = 0; u < quad.size_u();) {
      const int end_u = std::min(quad.size_u(), ((first[frame.u] + u) / edge + 1) * edge - first[frame.u]);
      for (int v = 0; v < quad.size_v();) {
        const int end_v = std::min(quad.size_v(), ((first[frame.v] + v) / edge + 1) * edge - first[frame.v]);
        parts.push_back(quad_part(quad, u, v, end_u - u, end_v - v).bits);
        v = end_v;
      }
      u = end_u;
    }
  }
  std::sort(parts.begin(), parts.end());
  return parts;
}

inline void expect_blocky(const ShownSurfaces& shown, const Scene& scene, const LiveMeshOptions& options) {
  BlockyMesher mesher;
  std::size_t surfaces = 0;
  for (const GridHandle handle : grids_of_drawn(scene, options.instances)) {
    const Grid& grid = scene.grids()[handle].grid;
    for (const IVec3 chunk : grid.chunks()) {
      QuadBuffer quads;
      QuadOptions wanted;
      wanted.merge = options.merge;
      mesher.mesh(grid.neighbourhood(chunk), scene.types, wanted, quads);
      const auto end_of_opaque = std::stable_partition(
          quads.begin(), quads.end(), [&](Quad quad) { return !scene.types.is_transparent(quad.type()); });
      const ChunkSurface* surface = shown.find(handle, chunk);
      ASSERT_EQ(surface == nullptr, quads.empty());
      if (surface == nullptr) continue;
      ++surfaces;
      ASSERT_EQ(surface->style, SurfaceStyle::Blocky);
      if (options.region_edge == kChunkEdge) {
        ASSERT_EQ(surface->quads, quads);
      }
      ASSERT_EQ(cut_at(surface->quads, kChunkEdge), cut_at(quads, options.region_edge));
      QuadBuffer opaque;
      for (auto quad = quads.begin(); quad != end_of_opaque; ++quad) opaque.push_back(*quad);
      ASSERT_EQ(surface->opaque_quads, cut_at(opaque, options.region_edge).size());
      ASSERT_EQ(surface->triangles(), 2 * static_cast<std::int64_t>(surface->quads.size()));
    }
  }
  EXPECT_EQ(shown.all().size(), surfaces);
}

/// A corner of a triangle with all that it carries, in numbers that compare.
using SmoothCorner = std::array<float, 12>;
using SmoothTriangles = std::vector<std::array<SmoothCorner, 3>>;

inline SmoothCorner corner_of(Vec3 p, Vec3 n, float occlusion, const LinearRgba16& colour, VoxelType type) {
  return {p.x,
          p.y,
          p.z,
          n.x,
          n.y,
          n.z,
          occlusion,
          float(colour[0]),
          float(colour[1]),
          float(colour[2]),
          float(colour[3]),
          float(type)};
}

inline void sort_triangles(SmoothTriangles& triangles) {
  for (auto& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(triangles.begin(), triangles.end());
}

inline SmoothTriangles triangles_of(const ChunkSurface& surface, IVec3 chunk) {
  SmoothTriangles all;
  const SmoothChunkMesh& mesh = surface.smooth;
  const auto corner = [&](std::size_t i) {
    const std::uint32_t v = mesh.indices[i];
    const Vec3 position(DVec3(mesh.positions[v]) + DVec3(chunk) * 64.0);
    return corner_of(position, mesh.normals[v], mesh.occlusion.empty() ? 0.0F : mesh.occlusion[v], surface.albedo[v],
                     surface.types[v]);
  };
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) all.push_back({corner(i), corner(i + 1), corner(i + 2)});
  return all;
}

inline SmoothTriangles triangles_of(const SmoothMesh& mesh) {
  SmoothTriangles all;
  const auto corner = [&](std::size_t i) {
    const std::uint32_t v = mesh.indices[i];
    return corner_of(mesh.positions[v], mesh.normals[v], mesh.occlusion.empty() ? 0.0F : mesh.occlusion[v],
                     mesh.albedo[v], mesh.types[v]);
  };
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) all.push_back({corner(i), corner(i + 1), corner(i + 2)});
  return all;
}

inline void expect_glass_last(const ChunkSurface& surface, const VoxelRegistry& types) {
  const auto& indices = surface.smooth.indices;
  ASSERT_LE(surface.glass_indices, indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const bool is_glass = i >= indices.size() - surface.glass_indices;
    ASSERT_EQ(types.is_transparent(surface.types[indices[i]]), is_glass);
  }
}

inline void expect_smooth(const ShownSurfaces& shown, const Scene& scene, const LiveMeshOptions& options) {
  const std::set<GridHandle> drawn = grids_of_drawn(scene, options.instances);
  for (const SurfaceUpdate& each : shown.all()) EXPECT_TRUE(drawn.contains(each.grid));
  for (const GridHandle handle : drawn) {
    SmoothMeshOptions wanted;
    wanted.occlusion = options.occlusion;
    wanted.colours = options.colours;
    wanted.keep_thin = true;
    SmoothTriangles expected;
    const Grid& grid = scene.grids()[handle].grid;
    const DensityGrid whole = *field_from_grid(grid);
    const std::vector<std::uint32_t> bodies = smooth::bodies_of(scene.types, grid.types());
    for (const std::uint32_t body : bodies) {
      const bool is_alone = bodies.size() == 1;
      smooth::SurfaceRequest request;
      request.whole = is_alone ? nullptr : &whole;
      request.with_faces = true;
      const DensityGrid field = is_alone ? whole.snapshot() : smooth::field_of_body(whole, scene.types, body, {});
      auto surface = smooth::build_surface(field, scene.types, wanted, request, {}, {});
      ASSERT_TRUE(surface.has_value());
      smooth::finish_surface(*surface, scene.types, wanted);
      const SmoothTriangles part = triangles_of(surface->mesh);
      expected.insert(expected.end(), part.begin(), part.end());
    }
    SmoothTriangles found;
    for (const SurfaceUpdate& each : shown.all()) {
      if (each.grid != handle) continue;
      ASSERT_EQ(each.surface->style, SurfaceStyle::Smooth);
      expect_glass_last(*each.surface, scene.types);
      const SmoothTriangles part = triangles_of(*each.surface, each.chunk);
      found.insert(found.end(), part.begin(), part.end());
    }
    sort_triangles(expected);
    sort_triangles(found);
    ASSERT_EQ(found.size(), expected.size());
    ASSERT_TRUE(found == expected);
  }
}

inline void expect_surfaces(const ShownSurfaces& shown, const Scene& scene, const LiveMeshOptions& options) {
  if (options.style == SurfaceStyle::Blocky) {
    expect_blocky(shown, scene, options);
  } else {
    expect_smooth(shown, scene, options);
  }
}

/// A scene of one grid, seen once.
struct OneGrid {
  OneGrid() {
    scene.types = live_types();
    instance.grid = handle = scene.add_grid({});
    placed = scene.add_instance(instance);
  }
  Grid& grid() { return scene.edit(handle).grid; }
  DensityGrid& field() { return scene.edit(handle).field; }

  Scene scene;
  GridHandle handle;
  Instance instance;
  InstanceHandle placed;
};

/// Edits a scene in all ways that surfaces depend on.
class SceneEditor {
 public:
  explicit SceneEditor(unsigned seed) : random_(seed) {
    scene.types = live_types();
    add_grid();
  }

  int below(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

  void edit() {
    if (scene.grids().empty()) add_grid();
    switch (const int which = below(40)) {
      case 0:
        return add_grid();
      case 1:
        return change_instances();
      case 2:
        return replace_grid();
      case 3:
        scene.remove_grid(any(scene.grids().handles()));
        return;
      case 4:
        return change_types();
      case 5:
        scene.edit(any(scene.grids().handles())).grid.clear();
        return;
      default:
        return edit_voxels(scene.edit(any(scene.grids().handles())).grid, which);
    }
  }

  DVec3 eye() { return {below(200) - 100, below(200) - 100, below(200) - 100}; }

  Scene scene;

 private:
  template <class T>
  T any(const std::vector<T>& all) {
    return all[static_cast<std::size_t>(below(static_cast<int>(all.size())))];
  }

  // Returns a coordinate that is often near a chunk border.
  int place() { return below(3) != 0 ? 64 * (below(3) - 1) + below(5) - 2 : below(140) - 70; }

  Grid small_grid() {
    Grid grid;
    for (int i = 0; i < 3; ++i) edit_voxels(grid, 20);
    return grid;
  }

  void add_grid() {
    SceneGrid grid;
    grid.grid = small_grid();
    Instance instance;
    instance.grid = scene.add_grid(std::move(grid));
    instance.position = eye();
    scene.add_instance(instance);
  }

  void change_instances() {
    const std::vector<InstanceHandle> all = scene.instances().handles();
    if (all.empty() || below(3) == 0) {
      Instance instance;
      instance.grid = any(scene.grids().handles());
      instance.mirrored = below(2) == 0;
      scene.add_instance(instance);
    } else if (below(4) == 0) {
      scene.remove_instance(any(all));
    } else {
      Instance& instance = scene.edit(any(all));
      instance.visible = !instance.visible;
    }
  }

  void replace_grid() {
    Grid& grid = scene.edit(any(scene.grids().handles())).grid;
    switch (below(3)) {
      case 0:
        grid = grid.snapshot();
        return;
      case 1:
        grid = small_grid();
        return;
      default:
        std::swap(grid, scene.edit(any(scene.grids().handles())).grid);
        return;
    }
  }

  void change_types() {
    const auto type = static_cast<VoxelType>(1 + below(static_cast<int>(scene.types.size()) - 1));
    VoxelProperties properties = scene.types[type];
    if (below(2) == 0) {
      properties.visibility =
          properties.visibility == Visibility::Opaque ? Visibility::Transparent : Visibility::Opaque;
    }
    if (below(2) == 0) properties.colour.g = static_cast<std::uint8_t>(below(256));
    if (below(4) == 0) {
      EXPECT_TRUE(scene.types.add(properties).has_value());
    } else {
      scene.types.replace(type, properties);
    }
  }

  void edit_voxels(Grid& grid, int which) {
    const auto type = static_cast<VoxelType>(below(6));
    const IVec3 at{place(), place(), place()};
    if (which < 12) {
      grid.set(at, type);
    } else if (which < 18) {
      // Done and undone: the versions have risen all the same.
      const VoxelType before = grid.get(at);
      grid.set(at, type);
      grid.set(at, before);
    } else if (which < 32) {
      grid.fill_box({at, at + IVec3{below(40) + 1, below(9) + 1, below(40) + 1}}, type);
    } else if (which < 36) {
      grid.fill_sphere(at, below(12), type);
    } else {
      const IBox box{at - 10, at + 10};
      grid.edit(box,
                [&](IVec3, VoxelType current) { return current == kAir ? kAir : static_cast<VoxelType>(1 + type); });
    }
  }

  std::mt19937 random_;
};

}  // namespace quoin
