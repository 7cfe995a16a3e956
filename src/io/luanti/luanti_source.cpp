// A Luanti world: a database with one row per block of 16^3 nodes, by position. Its axes are left-handed: z is
// mirrored, so that block z becomes -1 - z in Quoin. A part is up to eight Quoin chunks on top of each other.

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <system_error>
#include <tuple>
#include <unordered_set>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "core/bytes/text.h"
#include "core/database/connection.h"
#include "core/rows/packed_row.h"
#include "io/column_scan.h"
#include "io/luanti/luanti.h"

namespace quoin {

namespace luanti {

namespace {

namespace fs = std::filesystem;

constexpr int kBlocksOfChunk = kChunkEdge / kBlockEdge;  // along an edge
constexpr int kLowestBlock = -2048;
constexpr int kHighestBlock = 2048;  // the first invalid coordinate
constexpr int kChunksOfPart = 8;
/// Size limit of a row. Luanti's rows have a few kilobytes; a larger zlib stream could expand to gigabytes.
constexpr std::size_t kMaxRow = std::size_t{16} << 20;

/// The table's form of block positions: one number, or three columns since version 5.12.
enum class Places : std::uint8_t { Number, Three };

std::int64_t number_of(IVec3 block) {
  return (std::int64_t{block.z} << 24) + (std::int64_t{block.y} << 12) + block.x;
}

std::optional<IVec3> block_of(std::int64_t number) {
  constexpr std::int64_t kOffset = 0x800800800;
  constexpr std::int64_t kEnd = std::int64_t{1} << 36;
  if (number < -kOffset || number >= kEnd - kOffset) return std::nullopt;
  const std::int64_t shifted = number + kOffset;
  const auto part = [&](int shift) { return static_cast<int>(shifted >> shift & 0xFFF) + kLowestBlock; };
  return IVec3{part(0), part(12), part(24)};
}

bool is_block(std::int64_t coordinate) {
  return coordinate >= kLowestBlock && coordinate < kHighestBlock;
}

std::string to_string(IVec3 place) {
  return "(" + std::to_string(place.x) + ", " + std::to_string(place.y) + ", " + std::to_string(place.z) + ")";
}

/// Returns an error of the map's database with its file. A missing table or column is damage too.
Error database_error(Error error, const fs::path& path) {
  if (error.code == ErrorCode::BadFormat) error.message = kDamagedDatabase;
  error.path = path.string();
  return error;
}

/// A connection, and the objects that read a row with it.
struct Reader {
  Connection connection;
  Statement row;
  MapBlockReader blocks{};
  MapBlock block{};
};

/// Readers of a database, each used by one thread at a time. A database in memory has one reader.
class Readers {
 public:
  Readers(fs::path path, std::vector<std::byte> bytes) : path_(std::move(path)), bytes_(std::move(bytes)) {}

  [[nodiscard]] const fs::path& path() const { return path_; }
  [[nodiscard]] Places places() const { return places_; }

  Result<Connection> connect() const {
    if (!path_.empty()) return open_file();
    return Connection::open(bytes_);
  }

  /// Detects the form of block positions.
  Status choose(Connection& connection) {
    if (const auto by_number = connection.prepare("SELECT pos, data FROM blocks LIMIT 1")) {
      places_ = Places::Number;
      return {};
    }
    const auto by_three = connection.prepare("SELECT x, y, z, data FROM blocks LIMIT 1");
    if (!by_three) {
      return make_error(ErrorCode::BadFormat, "not a Luanti map: the table of blocks is missing", path_.string());
    }
    places_ = Places::Three;
    return {};
  }

  /// Runs `use(Reader&)` with a reader that no other thread uses.
  template <class Use>
  auto with_reader(Use use) -> decltype(use(std::declval<Reader&>())) {
    auto reader = take();
    if (!reader) return reader.error();
    try {
      auto result = use(**reader);
      give_back(std::move(*reader));
      return result;
    } catch (...) {
      give_back(nullptr);
      throw;
    }
  }

 private:
  Result<Connection> open_file() const {
    auto connection = Connection::open(path_.string(), Connection::Mode::Read);
    // A read-only folder cannot hold the files that readers of a log share.
    if (!connection || connection->prepare("SELECT data FROM blocks LIMIT 1")) return connection;
    auto alone = Connection::open(path_.string(), Connection::Mode::ReadImmutable);
    if (alone && alone->prepare("SELECT data FROM blocks LIMIT 1")) return alone;
    return connection;
  }

  Result<std::unique_ptr<Reader>> take() {
    std::unique_lock lock(mutex_);
    const bool is_alone = path_.empty();
    given_back_.wait(lock, [&] { return !is_alone || used_ == 0; });
    ++used_;
    if (!free_.empty()) {
      auto reader = std::move(free_.back());
      free_.pop_back();
      return reader;
    }
    lock.unlock();
    auto fresh = open();
    if (!fresh) give_back(nullptr);
    return fresh;
  }

  Result<std::unique_ptr<Reader>> open() const {
    auto connection = connect();
    if (!connection) return database_error(connection.error(), path_);
    auto row =
        connection->prepare(places_ == Places::Number ? "SELECT data FROM blocks WHERE pos = ?"
                                                      : "SELECT data FROM blocks WHERE x = ? AND y = ? AND z = ?");
    if (!row) return database_error(row.error(), path_);
    return std::unique_ptr<Reader>(new Reader{std::move(*connection), std::move(*row)});
  }

  void give_back(std::unique_ptr<Reader> reader) {
    const std::scoped_lock lock(mutex_);
    QUOIN_ASSERT(used_ > 0, "a reader that was taken");
    --used_;
    if (reader != nullptr) free_.push_back(std::move(reader));
    given_back_.notify_one();
  }

  fs::path path_;  // empty: bytes_ are the database
  std::vector<std::byte> bytes_;
  Places places_ = Places::Number;
  std::mutex mutex_;
  std::condition_variable given_back_;
  std::vector<std::unique_ptr<Reader>> free_;
  int used_ = 0;
};

/// The types of the nodes found so far. Threads: all functions may run concurrently.
class NodeTypes {
 public:
  /// Returns kAir for names without a node. Errors: LimitExceeded.
  Result<VoxelType> find(const std::string& name) {
    {
      const std::shared_lock lock(mutex_);
      if (const auto known = numbers_.find(name); known != numbers_.end()) return known->second;
    }
    auto properties = models::node_properties(name);
    const std::unique_lock lock(mutex_);
    VoxelType type = kAir;
    if (properties) {
      const auto added = types_.find_or_add(*properties);
      if (!added) return added.error();
      type = *added;
    }
    numbers_.emplace(name, type);
    return type;
  }
  VoxelRegistry types() const {
    const std::shared_lock lock(mutex_);
    return types_;
  }

 private:
  mutable std::shared_mutex mutex_;
  VoxelRegistry types_;
  std::map<std::string, VoxelType, std::less<>> numbers_;
};

/// Builds a Quoin chunk from blocks.
class ChunkBuilder {
 public:
  explicit ChunkBuilder(NodeTypes& types) : types_(types), voxels_(kChunkVoxels) {}

  void begin() {
    std::ranges::fill(voxels_, kAir);
    states_.clear();
  }
  /// `corner`: of the block within the chunk. Errors: LimitExceeded, of types.
  Status put(const MapBlock& block, IVec3 corner) {
    QUOIN_ASSERT(((corner.x | corner.y | corner.z) & ~(kChunkEdge - kBlockEdge)) == 0, "a block of the chunk");
    types_of_.clear();
    for (const std::string& name : block.names) {
      const auto type = types_.find(name);
      if (!type) return type.error();
      types_of_.push_back(*type);
    }
    for (std::size_t i = 0; i < kBlockNodes; ++i) {
      QUOIN_ASSERT(block.nodes[i] < types_of_.size(), "a node with a name");
      const VoxelType type = types_of_[block.nodes[i]];
      if (type == kAir) continue;
      const auto node = static_cast<int>(i);
      const IVec3 at = corner + IVec3{node & 15, node >> 4 & 15, kBlockEdge - 1 - (node >> 8)};
      voxels_[static_cast<std::size_t>((at.z * kChunkEdge + at.y) * kChunkEdge + at.x)] = type;
      const std::uint32_t state = models::node_state(block.names[block.nodes[i]], block.param2[i]);
      if (state != 0) states_.emplace_back(at, state);
    }
    return {};
  }
  Chunk take() {
    Chunk chunk = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(voxels_));
    for (const auto& [at, state] : states_) chunk.set_data(at, {.state = state});
    return chunk;
  }

 private:
  NodeTypes& types_;
  std::vector<VoxelType> voxels_;
  std::vector<std::pair<IVec3, std::uint32_t>> states_;
  std::vector<VoxelType> types_of_;  // by index in a block's names
};

class LuantiSource final : public ChunkSource {
 public:
  LuantiSource(ChunkSourceInfo info, std::vector<IBox> parts, std::unique_ptr<Readers> readers)
      : ChunkSource(std::move(info), std::move(parts)), readers_(std::move(readers)) {}

  VoxelRegistry types() const override { return types_.types(); }

  Result<SourcePart> read_part(std::size_t part) const override {
    QUOIN_ASSERT(part < parts().size(), "a part of the source");
    const IBox box = parts()[part];
    return readers_->with_reader([&](Reader& reader) -> Result<SourcePart> {
      SourcePart result;
      ChunkBuilder builder(types_);
      for (IVec3 place = box.min; place.y < box.max.y; ++place.y) {
        auto chunk = read_chunk(reader, place, builder, result.broken);
        if (!chunk) return chunk.error();
        if (chunk->uniform() != kAir) result.chunks.push_back({place, std::move(*chunk)});
      }
      return result;
    });
  }

  Result<VisitedColumns> visit_columns(std::size_t part, int top,
                                       FunctionRef<bool(IVec3 voxel, VoxelType type)> visit) const override {
    QUOIN_ASSERT(part < parts().size(), "a part of the source");
    const IBox box = parts()[part];
    return readers_->with_reader([&](Reader& reader) -> Result<VisitedColumns> {
      VisitedColumns result;
      ChunkBuilder builder(types_);
      ColumnScan scan(top);
      for (IVec3 place = box.max - 1; place.y >= box.min.y && !scan.is_done(); --place.y) {
        if (std::int64_t{place.y} * kChunkEdge > top) continue;
        const auto chunk = read_chunk(reader, place, builder, result.broken);
        if (!chunk) return chunk.error();
        scan.visit(place, *chunk, visit);
        ++result.chunks;
      }
      return result;
    });
  }

  Result<std::uint64_t> part_stamp(std::size_t part) const override {
    QUOIN_ASSERT(part < parts().size(), "a part of the source");
    const IBox box = parts()[part];
    return readers_->with_reader([&](Reader& reader) -> Result<std::uint64_t> {
      std::uint64_t stamp = kHashSeed;
      for (IVec3 place = box.min; place.y < box.max.y; ++place.y) {
        for (int i = 0; i < kBlocksOfChunk * kBlocksOfChunk * kBlocksOfChunk; ++i) {
          const IVec3 ours = place * kBlocksOfChunk + IVec3(i & 3, i >> 2 & 3, i >> 4);
          const StatementScope scope(reader.row);
          bind(reader.row, {ours.x, ours.y, -1 - ours.z});
          const auto found = reader.row.step();
          // A row that cannot be read is part of the content.
          const std::span<const std::byte> row = found && *found ? reader.row.bytes(0) : std::span<const std::byte>();
          stamp = mixed_with(mixed_with(stamp, static_cast<std::uint64_t>(i)), row.size());
          stamp = hash_of_bytes(stamp, row);
        }
      }
      return stamp == 0 ? 1 : stamp;
    });
  }

 private:
  Result<Chunk> read_chunk(Reader& reader, IVec3 chunk, ChunkBuilder& builder, std::vector<Error>& broken) const {
    builder.begin();
    for (int i = 0; i < kBlocksOfChunk * kBlocksOfChunk * kBlocksOfChunk; ++i) {
      const IVec3 inside{i & 3, i >> 2 & 3, i >> 4};
      if (auto read = put_block(reader, chunk, inside, builder, broken); !read) return read.error();
    }
    return builder.take();
  }

  /// Binds the position of a block to the statement that reads its row.
  void bind(Statement& row, IVec3 place) const {
    if (readers_->places() == Places::Number) {
      row.bind(0, number_of(place));
    } else {
      for (int axis = 0; axis < 3; ++axis) row.bind(axis, std::int64_t{place[axis]});
    }
  }

  /// Adds one block of a chunk; `inside` is its position there. Appends errors to `broken`.
  Status put_block(Reader& reader, IVec3 chunk, IVec3 inside, ChunkBuilder& builder, std::vector<Error>& broken) const {
    const IVec3 ours = chunk * kBlocksOfChunk + inside;
    const IVec3 place{ours.x, ours.y, -1 - ours.z};
    const StatementScope scope(reader.row);
    bind(reader.row, place);
    const auto report = [&](const Error& error) {
      std::string what = "block " + to_string(place) + ": ";
      if (error.byte_offset) what += "byte " + std::to_string(*error.byte_offset) + " of its row: ";
      broken.push_back(make_error(error.code, what + error.message, readers_->path().string()));
    };
    const auto found = reader.row.step();
    if (!found && found.error().code == ErrorCode::BadFormat) {
      report(database_error(found.error(), {}));
      return {};
    }
    if (!found && found.error().code == ErrorCode::LimitExceeded) {
      report(found.error());
      return {};
    }
    if (!found) return database_error(found.error(), readers_->path());
    if (!*found) return {};
    const std::span<const std::byte> row = reader.row.bytes(0);
    if (!reader.row.is_bytes(0) || row.size() > kMaxRow) {
      report(
          make_error(ErrorCode::BadFormat, reader.row.is_bytes(0) ? "the row exceeds 16 MiB" : "the row has no data"));
      return {};
    }
    if (const auto read = reader.blocks.read(row, reader.block); !read) {
      report(read.error());
      return {};
    }
    return builder.put(reader.block, inside * kBlockEdge);
  }

  std::unique_ptr<Readers> readers_;
  mutable NodeTypes types_;
};

/// The extent of the table's blocks, in Quoin chunks.
struct Extent {
  std::unordered_set<std::uint64_t> chunks;
  std::int64_t stray = 0;  // rows with impossible positions

  void add(std::optional<IVec3> block) {
    if (!block) {
      ++stray;
      return;
    }
    const IVec3 chunk{block->x >> 2, block->y >> 2, (-1 - block->z) >> 2};
    const auto part = [](int coordinate) { return static_cast<std::uint64_t>(coordinate + 512); };
    chunks.insert(part(chunk.z) << 20 | part(chunk.x) << 10 | part(chunk.y));
  }

  [[nodiscard]] std::vector<IBox> parts() const {
    std::vector<std::uint64_t> sorted(chunks.begin(), chunks.end());
    std::ranges::sort(sorted);
    std::vector<IBox> result;
    for (const std::uint64_t each : sorted) {
      const auto part = [&](int shift) { return static_cast<int>(each >> shift & 0x3FFU) - 512; };
      const IVec3 chunk{part(10), part(0), part(20)};
      const bool goes_on = !result.empty() && result.back().max == IVec3{chunk.x + 1, chunk.y, chunk.z + 1} &&
                           result.back().size().y < kChunksOfPart;
      if (goes_on) {
        ++result.back().max.y;
      } else {
        result.push_back({chunk, chunk + 1});
      }
    }
    return result;
  }
};

Result<Extent> find_extent(Readers& readers) {
  auto connection = readers.connect();
  if (!connection) return database_error(connection.error(), readers.path());
  if (auto chosen = readers.choose(*connection); !chosen) return chosen.error();
  const bool is_number = readers.places() == Places::Number;
  auto rows = connection->prepare(is_number ? "SELECT pos FROM blocks" : "SELECT x, y, z FROM blocks");
  if (!rows) return database_error(rows.error(), readers.path());
  Extent extent;
  for (;;) {
    const auto row = rows->step();
    if (!row) return database_error(row.error(), readers.path());
    if (!*row) return extent;
    if (is_number) {
      extent.add(rows->is_integer(0) ? block_of(rows->integer(0)) : std::nullopt);
      continue;
    }
    IVec3 block{0};
    bool is_sound = true;
    for (int axis = 0; axis < 3; ++axis) {
      is_sound &= rows->is_integer(axis) && is_block(rows->integer(axis));
      if (is_sound) block[axis] = static_cast<int>(rows->integer(axis));
    }
    extent.add(is_sound ? std::optional(block) : std::nullopt);
  }
}

Result<std::unique_ptr<ChunkSource>> open(std::unique_ptr<Readers> readers, std::string name) {
  auto extent = find_extent(*readers);
  if (!extent) return extent.error();
  ChunkSourceInfo info;
  info.format = "luanti_map";
  info.name = std::move(name);
  if (extent->stray > 0) {
    info.broken.push_back(make_error(ErrorCode::BadFormat,
                                     std::to_string(extent->stray) + " rows with invalid block positions",
                                     readers->path().string()));
  }
  std::vector<IBox> parts = extent->parts();
  for (const IBox& part : parts) info.chunks = unite(info.chunks, part);
  // The map does not store the spawn position; the game searches around the middle of the world.
  const bool has_middle =
      std::ranges::any_of(parts, [](const IBox& part) { return part.min.x == 0 && part.min.z == -1; });
  if (has_middle) info.spawn = DVec3(0.0, 0.0, -0.5);
  return std::unique_ptr<ChunkSource>(new LuantiSource(std::move(info), std::move(parts), std::move(readers)));
}

/// Returns the value of a key in world.mt; empty if missing.
std::string value_of(const std::string& text, std::string_view key) {
  constexpr std::string_view kBlank = " \t\r";
  const auto trimmed = [&](std::string_view part) {
    const std::size_t first = part.find_first_not_of(kBlank);
    if (first == std::string_view::npos) return std::string_view();
    return part.substr(first, part.find_last_not_of(kBlank) + 1 - first);
  };
  std::string_view rest = text;
  std::string found;
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    const std::size_t equals = line.find('=');
    if (equals != std::string_view::npos && trimmed(line.substr(0, equals)) == key) {
      found = trimmed(line.substr(equals + 1));
    }
  }
  return found;
}

}  // namespace

}  // namespace luanti

Result<std::unique_ptr<ChunkSource>> open_luanti(const std::filesystem::path& path) {
  using namespace luanti;
  std::error_code error;
  if (!fs::is_directory(path, error)) return open(std::make_unique<Readers>(path, std::vector<std::byte>()), {});
  constexpr std::size_t kMaxSettings = std::size_t{1} << 20;
  const auto settings = read_file_beginning(path / "world.mt", kMaxSettings);
  if (!settings) return settings.error();
  const std::string text(reinterpret_cast<const char*>(settings->data()), settings->size());
  const std::string backend = value_of(text, "backend");
  if (!backend.empty() && backend != "sqlite3") {
    return make_error(ErrorCode::Unsupported,
                      "cannot read a Luanti world with backend " + printable(backend) +
                          ": only sqlite3 is supported (luanti --migrate sqlite3 converts it)",
                      (path / "world.mt").string());
  }
  const fs::path map = path / "map.sqlite";
  if (!fs::is_regular_file(map, error)) {
    return make_error(ErrorCode::BadFormat, "the Luanti world has no map.sqlite", path.string());
  }
  std::string name = value_of(text, "world_name");
  if (name.empty()) name = fs::absolute(path, error).lexically_normal().filename().string();
  return open(std::make_unique<Readers>(map, std::vector<std::byte>()), printable(name));
}

Result<std::unique_ptr<ChunkSource>> open_luanti(std::span<const std::byte> database) {
  using namespace luanti;
  return open(std::make_unique<Readers>(fs::path(), std::vector<std::byte>(database.begin(), database.end())), {});
}

}  // namespace quoin
