#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/io/file.h>
#include <quoin/io/file_format.h>
#include <quoin/io/heights.h>
#include <quoin/io/volume.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/scene.h>
#include <quoin/voxelize/voxelize.h>

namespace [[gnu::visibility("default")]] quoin {

/// The content of a .vox file that a Scene cannot hold, kept for saving: see write_vox.
struct [[gnu::visibility("hidden")]] VoxSource;

/// A numbered camera of a file.
struct FileCamera {
  std::int32_t number = 0;
  Camera camera;
  double focus_distance = 0.0;  ///< world units along the forward axis to the point in focus; 0: not stored
};

/// The settings that a file stores for path-traced images. They are not the scene's environment, which all renderers
/// read: MagicaVoxel chooses their brightness for its own tone curve.
struct FileRenderSettings {
  Environment environment;  ///< with Sky::image_file, but without the image and the ground's height
  Lens lens;
  int max_bounces = 8;                 ///< PathOptions::max_bounces
  int max_scatterings = 64;            ///< PathOptions::max_scatterings
  bool is_transparent = false;         ///< renders without a background
  std::vector<std::string> not_drawn;  ///< names and values of settings that Quoin does not render
};

/// The result of reading a file.
struct LoadedScene {
  Scene scene;
  std::string format;                                 ///< "vox", ...
  std::vector<std::string> warnings;                  ///< one line per skipped item, with the reason
  std::optional<Camera> camera;                       ///< the initial camera, if the file stores one
  std::vector<FileCamera> cameras;                    ///< all cameras, in file order
  std::optional<FileRenderSettings> render_settings;  ///< if the file stores them (.vox)
  std::int64_t last_frame = 0;                        ///< of the animation; LoadOptions::frame selects the loaded frame
  std::vector<std::filesystem::path> named_files;     ///< other files that models come from; saving merges them
  std::shared_ptr<const VoxSource> source = nullptr;  ///< for a .vox file, with LoadOptions::keep_source
  std::string dimension{};                            ///< Minecraft: the dimension that was read
  std::vector<std::string> dimensions{};              ///< Minecraft: all dimensions; LoadOptions::dimension selects one
  std::vector<std::string> unused_packs{};  ///< resource packs of a scene file that are missing or changed, not used
};

/// Options for converting triangles to voxels.
struct MeshLoadOptions {
  std::optional<int> size = std::nullopt;           ///< voxels along the longest side; default: kDefaultMeshSize
  std::optional<double> voxel_size = std::nullopt;  ///< in the file's unit; overrides `size`
  SurfaceVoxels surface = SurfaceVoxels::Separating6;
  SolidVoxels solid = SolidVoxels::Winding;
  bool as_field = false;                                ///< makes a distance field of the solid instead of voxels
  float band = 8.0F;                                    ///< band of the field, in samples
  std::optional<std::size_t> max_types = std::nullopt;  ///< maximum number of colours
  std::optional<UpAxis> up = std::nullopt;              ///< default: Z for PLY, STL and 3MF, Y for all others
};
inline constexpr int kDefaultMeshSize = 128;

struct LoadOptions {
  bool show_hidden = false;  ///< shows hidden instances, groups and layers
  int frame = 0;             ///< the animation frame to load
  /// Sets LoadedScene::source, so that saving a .vox file keeps content that scenes cannot hold. Uses memory for the
  /// file's size and for the original state of chunks that are edited later.
  bool keep_source = true;
  /// Threshold of a volume, or of the fog of a .vdb: values above are solid. Default: a threshold between the two
  /// groups of values (surface_value).
  std::optional<float> iso = std::nullopt;
  /// For worlds read by chunks (ChunkSource): the distance around the spawn, in chunks of 64 voxels to each side. Must
  /// not be negative.
  int radius = 4;
  /// The dimension of a Minecraft world: "overworld", "nether", "end" or NAMESPACE:NAME. Empty: the overworld, or the
  /// first dimension if there is none. Other formats ignore it.
  std::string dimension{};
  /// Resource packs of Minecraft for the looks of its blocks, the lowest first (BlockPacks). A warning counts the
  /// blocks and textures that they lack. Types of other formats stay as they are.
  std::vector<std::filesystem::path> packs{};
  /// The bytes of more resource packs (zip files), above `packs`.
  std::vector<std::vector<std::byte>> pack_zips{};
  /// Gives the files of a scene file the packs that it names for them, below `packs`. If false, they are not read.
  bool scene_packs = true;
  /// If set, reads the file as raw values: a volume of this size and type.
  std::optional<RawVolume> raw = std::nullopt;
  /// If set, reads the file as a height map. This cannot be detected for images. A .hgt file is recognised by its name
  /// and size; for it, these are only the conversion options.
  std::optional<HeightOptions> heights = std::nullopt;
  MeshLoadOptions mesh{};  ///< for triangle files
  /// Reads the sky image that a scene file or world names (Sky::image). Only path tracing needs it. Programs that link
  /// only quoin::core get a warning instead.
  bool sky_image = true;
  /// The files that the input may name: buffers, images, materials, values, models of a scene file, sky images.
  SidecarFiles sidecar_files = SidecarFiles::WithinFolder;
};

/// The result of saving a scene.
struct SavedScene {
  std::uint64_t bytes = 0;            ///< file size
  std::vector<std::string> warnings;  ///< one line per kind of content that the format does not support
};

}  // namespace quoin
