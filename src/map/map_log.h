#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::map {

/// The place of a tile: at zoom `z`, tiles have twice the edge in voxels that they have at zoom z + 1.
struct TilePlace {
  int z = 0;
  int x = 0;
  int y = 0;
  auto operator<=>(const TilePlace&) const = default;
  [[nodiscard]] TilePlace parent() const { return {z - 1, x >> 1, y >> 1}; }
  /// Returns one of the four tiles that this one is made of: upper left, upper right, lower left, lower right.
  [[nodiscard]] TilePlace child(int i) const { return {z + 1, 2 * x + (i & 1), 2 * y + (i >> 1)}; }
};

/// A tile as it was drawn last.
struct TileRecord {
  std::uint64_t stamp = 0;  ///< of everything that it depends on
  bool has_file = false;    ///< false: all of it is transparent
  std::string signs{};      ///< text for markers.js: of the signs in a tile of the last zoom; may be empty
  bool operator==(const TileRecord&) const = default;
};

/// The state of a map: a record per tile, in a file that grows by a record with each tile that is drawn, so that an
/// interrupted run continues. A record that was cut off or damaged is ignored with all after it.
///
/// Format:  a line of text, "quoin map 1" and the map's identity; then records: uint32 bytes after it, int32 z, x, y,
///          uint64 stamp, uint8 flags (1: has a file; 2: the tile is gone), signs, uint64 hash of all these bytes.
///          Numbers are little-endian.
/// Threads: `find`, `put` and `remove` from any number; everything else from one, and not meanwhile.
class MapLog {
 public:
  /// Opens the log of a map, or begins one, and locks it until the object is destroyed.
  /// Errors: CannotRead, CannotWrite; InvalidArgument if another process draws this map, or the log is of another map:
  ///         another world, other options, or an unknown version.
  [[nodiscard]] static Result<MapLog> open(const std::filesystem::path& path, const std::string& identity);
  MapLog(MapLog&& other) noexcept;
  MapLog& operator=(MapLog&&) = delete;
  ~MapLog();

  [[nodiscard]] const std::map<TilePlace, TileRecord>& tiles() const { return tiles_; }
  /// Returns the record of a tile, or nullopt. Threads: any number.
  [[nodiscard]] std::optional<TileRecord> find(TilePlace place);
  /// Appends a tile. Errors: CannotWrite.
  [[nodiscard]] Status put(TilePlace place, TileRecord record);
  /// Appends that a tile is gone. Errors: CannotWrite.
  [[nodiscard]] Status remove(TilePlace place);
  /// Writes a new log if later records replace most of its records. Errors: CannotWrite.
  [[nodiscard]] Status compact();

 private:
  explicit MapLog(std::filesystem::path path) : path_(std::move(path)) {}
  [[nodiscard]] Status append(const std::vector<std::byte>& record);
  [[nodiscard]] std::size_t read(std::span<const std::byte> bytes);

  std::filesystem::path path_;
  std::string identity_;
  int descriptor_ = -1;
  std::mutex mutex_;
  std::map<TilePlace, TileRecord> tiles_;
  std::size_t records_ = 0;  // in the file
  std::uint64_t size_ = 0;   // of the file, without a record that could not be written
};

}  // namespace quoin::map
