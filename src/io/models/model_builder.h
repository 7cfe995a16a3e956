#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>

#include "grid/colour_table.h"

namespace quoin::models {

/// Longer edges of models in files are refused, in voxels.
inline constexpr int kMaxEdge = 1 << 14;

/// The properties of a model in a file, except its voxels.
struct Model {
  std::string name{};
  DVec3 pivot{0.0};         ///< voxels: SceneGrid::pivot
  DVec3 position{0.0};      ///< of the pivot, in the world
  double voxel_size = 1.0;  ///< world units
  IBox canvas{};
  bool visible = true;
};

/// Collects coloured voxels of any number of models and makes a scene of them, with a type for each colour and
/// material.
/// Memory: 24 bytes per voxel or run of voxels.
class ModelBuilder {
 public:
  /// Starts a model; the following voxels belong to it. Requires: sizes are finite and positive.
  void begin(Model model);
  /// Adds the voxel properties other than colour and transparency. Returns the material's number; 0 is the default
  /// material.
  [[nodiscard]] std::uint32_t add_material(VoxelProperties material);
  /// Sets the material of the following voxels. Requires: it was added.
  void use_material(std::uint32_t material);
  /// Adds `count` voxels from `voxel` along an axis. Alpha below 255 makes a type transparent; alpha 0 adds no voxel.
  /// Errors: LimitExceeded beyond 2^25 such calls.
  [[nodiscard]] Status put(IVec3 voxel, Rgba8 colour, int count = 1, int axis = 1);
  void warn(std::string line);

  /// Returns the scene. If there are more colours than possible types, their lowest bits are rounded, with a warning.
  [[nodiscard]] Result<LoadedScene> take(std::string format);

 private:
  struct Run {
    IVec3 voxel;
    std::uint32_t colour;  ///< index in `colours_`
    std::int32_t count;
    std::int32_t axis;
  };
  struct Part {
    Model model;
    std::size_t first = 0;  // run
  };

  std::vector<Part> parts_;
  std::vector<Run> runs_;
  ColourTable colours_;
  std::vector<VoxelProperties> materials_{VoxelProperties{}};
  std::uint32_t material_ = 0;
  std::vector<std::string> warnings_;
};

}  // namespace quoin::models
