#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/result.h>

// Resource packs of Minecraft (Java) as sets of files: a folder, a zip (a client's .jar is one), files in memory, and a
// stack of packs. Files are read when they are first needed.

namespace quoin::packs {

/// Maximum size of a file of a pack. Larger ones are refused, before they are expanded.
inline constexpr std::size_t kMaxJsonBytes = std::size_t{8} << 20;
inline constexpr std::size_t kMaxImageBytes = std::size_t{64} << 20;

/// Returns true for a relative path of plain names, such as "assets/minecraft/models/block/stone.json": names of
/// letters, digits, '.', '_' and '-', separated by '/', none of them empty, "." or "..", at most 512 bytes.
[[nodiscard]] bool is_pack_path(std::string_view path);

/// A name in a pack: "minecraft:block/stone".
struct ResourceName {
  std::string space = "minecraft";
  std::string path;

  bool operator==(const ResourceName&) const = default;
};

/// Splits "block/stone" or "minecraft:block/stone" at its first colon.
[[nodiscard]] ResourceName split_resource_name(std::string_view text);
/// As split_resource_name. Returns nullopt for names that are no pack paths.
[[nodiscard]] std::optional<ResourceName> resource_name(std::string_view text);
/// "minecraft:block/stone".
[[nodiscard]] std::string to_string(const ResourceName& name);

/// The files of a resource pack. Threads: `read` can be called from any thread, also at once.
class PackFiles {
 public:
  PackFiles() = default;
  PackFiles(const PackFiles&) = delete;
  PackFiles& operator=(const PackFiles&) = delete;
  virtual ~PackFiles() = default;

  /// Reads a file, for example "assets/minecraft/blockstates/stone.json". Returns nullopt if the pack does not have it,
  /// or if `path` is no pack path (is_pack_path).
  /// Errors: CannotRead, BadFormat, Unsupported; LimitExceeded if the file is larger than `max_bytes`.
  [[nodiscard]] virtual Result<std::optional<std::vector<std::byte>>> read(std::string_view path,
                                                                           std::size_t max_bytes) const = 0;
  /// Returns true if the pack has a file, also if it cannot be read. The default reads it.
  [[nodiscard]] virtual bool has(std::string_view path) const;
  /// Returns true if the files are tiles of Luanti nodes (node_pack.h), or some of them.
  [[nodiscard]] virtual bool has_tiles() const { return false; }
  /// Returns a text that differs between packs of different content, as far as it is known without reading all files.
  [[nodiscard]] virtual std::string identity() const = 0;
};

/// Opens a pack: a folder that has the folder `assets`, or a zip file or .jar. In a zip, all files may also lie in one
/// folder. A folder of a Luanti game or mod is a pack of its textures (node_pack.h). Files that links lead to outside
/// the folder are errors (CannotRead).
/// Cost: reads a zip file whole (0.05 s for 30 MB) and expands nothing.
/// Errors: CannotRead, BadFormat; InvalidArgument if there is no folder `assets`; LimitExceeded above 2 GiB. They name
///         the path.
[[nodiscard]] Result<std::shared_ptr<const PackFiles>> open_pack(const std::filesystem::path& path);

/// Opens the bytes of a zip file as a pack. Errors: as open_pack.
[[nodiscard]] Result<std::shared_ptr<const PackFiles>> open_pack(std::vector<std::byte> zip);

/// Returns an error unless a file is inside a folder, without following links out of it. Requires: `folder` is absolute
/// and has no links. Errors: CannotRead, naming the file.
[[nodiscard]] Status check_inside(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Returns a hash over the names, sizes and CRC-32 of a pack's files (hash_of_pack). Errors: as hash_of_pack.
[[nodiscard]] Result<std::uint64_t> hash_of_files(const std::filesystem::path& path);

/// Files in memory, by path.
class MemoryPack final : public PackFiles {
 public:
  MemoryPack() = default;
  explicit MemoryPack(std::map<std::string, std::string, std::less<>> files) : files_(std::move(files)) {}

  /// Adds or replaces a file. Requires: is_pack_path(path); no other thread reads.
  void put(std::string_view path, std::string content);
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> read(std::string_view path,
                                                                   std::size_t max_bytes) const override;
  [[nodiscard]] bool has(std::string_view path) const override { return files_.contains(path) && is_pack_path(path); }
  [[nodiscard]] std::string identity() const override;

 private:
  std::map<std::string, std::string, std::less<>> files_;
};

/// A list of packs: later ones override earlier ones, file by file. Textures of blocks are found in the folders
/// textures/block and textures/blocks, by either name, since 1.13 renamed it. A tile of Luanti that no pack has is the
/// one without its end (tile_without_end).
class PackStack final : public PackFiles {
 public:
  PackStack() = default;
  explicit PackStack(std::vector<std::shared_ptr<const PackFiles>> packs) : packs_(std::move(packs)) {}

  /// Opens packs, the lowest first; those of bytes are above those of paths. Errors: as open_pack.
  [[nodiscard]] static Result<std::shared_ptr<const PackStack>> open(std::span<const std::filesystem::path> paths,
                                                                     std::vector<std::vector<std::byte>> zips);
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> read(std::string_view path,
                                                                   std::size_t max_bytes) const override;
  [[nodiscard]] bool has(std::string_view path) const override;
  [[nodiscard]] bool has_tiles() const override;
  [[nodiscard]] std::string identity() const override;
  /// Returns the packs, the lowest first.
  [[nodiscard]] std::span<const std::shared_ptr<const PackFiles>> packs() const { return packs_; }

 private:
  /// Reads a file of exactly this name.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> read_exact(std::string_view path,
                                                                         std::size_t max_bytes) const;
  [[nodiscard]] bool has_exact(std::string_view path) const;
  /// Returns the tile that stands for one that no pack has; empty for other files.
  [[nodiscard]] std::string substitute_of(std::string_view path) const;

  std::vector<std::shared_ptr<const PackFiles>> packs_;
};

}  // namespace quoin::packs
