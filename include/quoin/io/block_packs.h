#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/chunk_source.h>

namespace [[gnu::visibility("default")]] quoin {

/// The name of Quoin's own pack in BlockPacks::open and LoadOptions::packs. It has shapes and textures for every block
/// name, also of mods, except for types with textures or shapes. docs/formats/block_pack.md describes it. A folder of
/// this name is "./builtin".
inline constexpr const char* kBuiltinPack = "builtin";

/// The name that stands for no pack where a user names packs for images (packs_for_images).
inline constexpr const char* kNoPack = "none";

/// Returns the packs that images use if a user names `named`: these with kBuiltinPack below them. None for kNoPack
/// alone.
[[nodiscard]] std::vector<std::filesystem::path> packs_for_images(std::vector<std::filesystem::path> named);

/// Returns a hash of a pack's content: 16 hexadecimal digits of a hash over the names, sizes and CRC-32 of the files
/// below `assets`, in the order of their names. A zip file and the folder with its files have the same hash. For a
/// Luanti folder, the files are the tiles that BlockPacks uses, by their names without folders. Files that are never
/// used do not count: those above 64 MiB, and those behind links out of the folder.
/// Cost: reads only the directory of a zip file after opening it, and all files of a folder.
/// Errors: those of BlockPacks::open; CannotRead for a link to a folder that contains it; LimitExceeded for a folder
///         with more than 1,048,576 files and folders (100,000 for Luanti) or 2 GiB.
[[nodiscard]] Result<std::string> hash_of_pack(const std::filesystem::path& path);

/// Returns a part of kBuiltinPack as a zip file in the published format, for other programs or as the base of a pack:
/// the block states of these blocks, and the models and textures that these name.
///
///   const std::vector<std::string> blocks = {"oak_stairs", "minecraft:glass", "some_mod:marble_wall"};
///   write_file(*write_builtin_pack(blocks), "my_pack.zip");
///
/// Errors: InvalidArgument if a name is not one of a block; LimitExceeded above 65,535 files; Unsupported in builds
///         without worlds of games. The bytes are the same every time.
[[nodiscard]] Result<std::vector<std::byte>> write_builtin_pack(std::span<const std::string> blocks);

/// The counts of BlockPacks::apply, over all calls.
struct BlockPackReport {
  std::size_t types = 0;           ///< Minecraft blocks and Luanti nodes
  std::size_t without_look = 0;    ///< of them, blocks without a usable block state or model, which stay as they are
  std::size_t replaced_looks = 0;  ///< blocks with the look of kBuiltinPack, since that of another pack cannot be used
  std::size_t missing_textures = 0;  ///< distinct textures that the packs lack or that cannot be read
  std::size_t missing_models = 0;    ///< distinct models, of the same kind
  std::size_t without_choices = 0;   ///< blocks whose choices among models have too many parts: one is shown
  std::vector<std::string> names{};  ///< the first 8 of these blocks, textures and models, with the reason
};

/// Returns one line for a warning; empty if nothing is missing.
[[nodiscard]] std::string to_string(const BlockPackReport& report);

/// Resource packs of Minecraft (Java): the shapes and textures of blocks. Later packs override earlier ones file by
/// file, so name the client's .jar first. A folder of a Luanti game or mod gives textures to Luanti nodes.
///
///   const std::vector<std::filesystem::path> files = {"client.jar", "my_pack.zip"};
///   auto packs = BlockPacks::open(files);
///   (*packs)->apply(loaded.scene.types);
///
/// Types:    those of worlds, schematics and structures (io/formats.h), also after conversion to .quoin. Each gets
///           `faces`, `orientations` and `shapes` by its block's states, and the mean of its textures as colour.
/// Limits:   docs/formats/packs.md lists them, with the features that are not supported.
/// Memory:   the bytes of zipped packs, and the models and PNG images that types use. Texels are decoded when they are
///           first read (Texture::deferred).
/// Threads:  any number may call `apply` at once.
class BlockPacks {
 public:
  /// Opens packs: folders, zip files or .jar files; folders of Luanti games, mods or texture packs. kBuiltinPack, at
  /// any place, gives a look to the blocks and nodes that the other packs do not have. Errors: CannotRead, BadFormat;
  /// InvalidArgument if a pack has no folder `assets`; Unsupported in builds without worlds of games; LimitExceeded
  /// above 2 GiB.
  [[nodiscard]] static Result<std::shared_ptr<BlockPacks>> open(std::span<const std::filesystem::path> paths);
  /// As above, from the bytes of zip files.
  [[nodiscard]] static Result<std::shared_ptr<BlockPacks>> open(std::vector<std::vector<std::byte>> zips);
  /// As above: the packs `zips` override the packs `paths`.
  [[nodiscard]] static Result<std::shared_ptr<BlockPacks>> open(std::span<const std::filesystem::path> paths,
                                                                std::vector<std::vector<std::byte>> zips);
  /// Returns opened packs as one stack, the lowest first. They share the files in memory with `packs`, so that these
  /// can be parts of many stacks. kBuiltinPack counts as above.
  [[nodiscard]] static std::shared_ptr<BlockPacks> stacked(std::span<const std::shared_ptr<BlockPacks>> packs);
  ~BlockPacks();
  BlockPacks(const BlockPacks&) = delete;
  BlockPacks& operator=(const BlockPacks&) = delete;

  /// Gives the Minecraft blocks and Luanti nodes of a registry the looks of the packs. Other types, and blocks that the
  /// packs do not have, stay as they are. Cost: reads each texture and model once, textures on several threads.
  void apply(VoxelRegistry& types, Threads threads = {});
  /// Returns the properties of a type with the looks of the packs.
  [[nodiscard]] VoxelProperties applied(const VoxelProperties& type);
  /// Decodes the textures of the types from `first` on several threads, so that `applied` finds them. `apply` does so.
  /// The looks are the same without it.
  void prepare(const VoxelRegistry& types, std::size_t first = 1, Threads threads = {});
  [[nodiscard]] BlockPackReport report() const;
  /// Returns a text that differs between packs of different content: it counts the names, sizes and checksums of files
  /// in zip files, but only the paths of folders.
  [[nodiscard]] std::string identity() const;

 private:
  struct [[gnu::visibility("hidden")]] Content;
  explicit BlockPacks(std::unique_ptr<Content> content);
  std::unique_ptr<Content> content_;
};

/// Returns the state of an imported voxel after a rotation or mirror: of Minecraft blocks by their properties (facing,
/// halves, sides, hinges, corners of stairs, rails and others), of Luanti nodes by the turns of param2. Returns nullopt
/// for other types, and for states without a counterpart: a door upside down, stairs on their side. For copies:
///
///   CopyOptions options{.types = &scene.types};
///   options.turn_state = [](const VoxelProperties& type, std::uint32_t state, const AxisOrientation& turn) {
///     return turned_block_state(type, state, turn).value_or(state);
///   };
///
/// Cost: microseconds.
[[nodiscard]] std::optional<std::uint32_t> turned_block_state(const VoxelProperties& type, std::uint32_t state,
                                                              const AxisOrientation& turn);

/// Returns a source whose types have the looks of packs. It is otherwise equal.
[[nodiscard]] std::unique_ptr<ChunkSource> with_packs(std::unique_ptr<ChunkSource> source,
                                                      std::shared_ptr<BlockPacks> packs);

}  // namespace quoin
