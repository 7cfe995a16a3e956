#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/io/heights.h>
#include <quoin/io/sidecar_file.h>
#include <quoin/io/volume.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/look.h>
#include <quoin/scene/scene.h>
#include <quoin/voxelize/voxelize.h>

namespace quoin {

/// A .vox file as it was read, with all that a scene has no place for: see write_vox.
struct VoxSource;

/// A camera that a file has beside others, under a number.
struct FileCamera {
  std::int32_t number = 0;
  Camera camera;
  double focus_distance = 0.0;  ///< world units along its forward axis, of what it looks at; 0: not said
};

/// What reading a file gave.
struct LoadedScene {
  Scene scene;
  std::string format;                                 ///< "vox", ...
  std::vector<std::string> warnings;                  ///< one line each: what was skipped, and why
  std::optional<DVec3> sun;                           ///< from the surface towards the sun, where the file says it
  std::optional<Camera> camera;                       ///< to look through at first, where the file has such a one
  std::vector<FileCamera> cameras;                    ///< all of the file, in its order
  std::optional<FileLook> look;                       ///< how the file wants to be drawn, where it says it
  std::int64_t last_frame = 0;                        ///< of its animation; LoadOptions::frame says which one this is
  std::vector<std::filesystem::path> named_files;     ///< other files that models are from; saving puts these into one
  std::shared_ptr<const VoxSource> source = nullptr;  ///< of a .vox file, with LoadOptions::keep_source
  std::string dimension{};                            ///< of a world of Minecraft's: the one that was read
  std::vector<std::string> dimensions{};  ///< of a world of Minecraft's: all; LoadOptions::dimension chooses
};

/// Which axis of a file points up. glTF knows +Y alone; programs that read other formats differ.
enum class UpAxis : std::uint8_t { Y, Z };

/// How a file of triangles becomes voxels.
struct MeshLoadOptions {
  std::optional<int> size = std::nullopt;           ///< voxels along the longest side; nothing: kDefaultMeshSize
  std::optional<double> voxel_size = std::nullopt;  ///< in the file's unit; where it is given, `size` is not used
  SurfaceVoxels surface = SurfaceVoxels::Separating6;
  SolidVoxels solid = SolidVoxels::Winding;
  bool as_field = false;                                ///< a field of distances instead, of what is solid
  float band = 8.0F;                                    ///< of the field, in samples
  std::optional<std::size_t> max_types = std::nullopt;  ///< colours that are told apart, at most
  std::optional<UpAxis> up = std::nullopt;              ///< without: Z of STL and PLY, Y of all others
};
inline constexpr int kDefaultMeshSize = 128;

struct LoadOptions {
  bool show_hidden = false;  ///< what is hidden (instances, groups, layers) becomes visible
  int frame = 0;             ///< which animation frame to show
  /// Whether LoadedScene::source is set, so that writing a .vox file again keeps what scenes cannot hold. It takes the
  /// file's size, and of chunks that are edited later what they were.
  bool keep_source = true;
  /// Of a volume of values, or the fog of a .vdb: what is above is solid; without, a value between its two groups
  /// (volume_threshold).
  std::optional<float> iso = std::nullopt;
  /// Of a world that is read by chunks (ChunkSource): how far around its spawn, in chunks of 64 voxels to each side.
  int radius = 4;
  /// The dimension of a Minecraft world: "overworld", "nether", "end" or NAMESPACE:NAME; empty: the overworld, or the
  /// first that the world has. Other formats ignore it.
  std::string dimension{};
  /// The file holds values alone, as many as this says: a volume.
  std::optional<RawVolume> raw = std::nullopt;
  /// The file holds the heights of a landscape. Nothing tells such a picture from another, so it has to be said; of
  /// .hgt files, which say it by their name and size, it only says how they become voxels.
  std::optional<HeightOptions> heights = std::nullopt;
  MeshLoadOptions mesh{};  ///< of files of triangles
  /// The files that the input may name: buffers, images, materials, values, models of a scene file.
  SidecarFiles sidecar_files = SidecarFiles::WithinFolder;
};

/// What saving a scene gave.
struct SavedScene {
  std::uint64_t bytes = 0;            ///< of the file
  std::vector<std::string> warnings;  ///< one line each: what the format does not hold
};

}  // namespace quoin
