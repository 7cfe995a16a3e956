#include <algorithm>
#include <atomic>
#include <mutex>
#include <utility>

#include <quoin/io/chunk_source.h>

namespace quoin {

namespace {

// Lines of damage: of a whole world that is broken nobody reads more.
constexpr std::size_t kMaxLines = 20;

bool meet(const IBox& a, const IBox& b) {
  return !intersect(a, b).empty();
}

void add_lines(const std::vector<Error>& broken, std::vector<std::string>& warnings) {
  for (std::size_t i = 0; i < std::min(broken.size(), kMaxLines); ++i) {
    warnings.push_back("left out: " + to_string(broken[i]));
  }
  if (broken.size() > kMaxLines) warnings.push_back("and " + std::to_string(broken.size() - kMaxLines) + " more");
}

/// Reads the parts that meet a box, several at once, into what has a place for each.
struct Reading {
  const ChunkSource& source;
  std::vector<std::size_t> wanted{};
  std::vector<SourcePart> read{};
  std::mutex mutex{};
  std::size_t done = 0;
  bool is_cancelled = false;
  std::optional<Error> error{};

  void read_one(std::size_t i, const Progress& progress) {
    {
      const std::scoped_lock lock(mutex);
      if (is_cancelled || error) return;
    }
    auto part = source.read_part(wanted[i]);
    const std::scoped_lock lock(mutex);
    if (!part) {
      if (!error) error = part.error();
      return;
    }
    read[i] = std::move(*part);
    ++done;
    if (progress && !is_cancelled) {
      is_cancelled = !progress(static_cast<double>(done) / static_cast<double>(wanted.size()));
    }
  }
};

}  // namespace

Result<LoadedScene> load_source(const ChunkSource& source, const IBox& chunks, Threads threads,
                                const Progress& progress) {
  Reading reading{source};
  for (std::size_t i = 0; i < source.parts().size(); ++i) {
    if (meet(source.parts()[i], chunks)) reading.wanted.push_back(i);
  }
  reading.read.resize(reading.wanted.size());
  parallel_for(reading.wanted.size(), threads, [&](std::size_t i) { reading.read_one(i, progress); });
  if (reading.error) return *reading.error;
  if (reading.is_cancelled) return make_error(ErrorCode::Cancelled, "cancelled");
  LoadedScene loaded;
  loaded.format = source.info().format;
  SourceTypes types(source);
  SceneGrid grid;
  grid.name = source.info().name;
  std::vector<Error> broken = source.info().broken;
  for (SourcePart& part : reading.read) {
    for (SourceChunk& chunk : part.chunks) {
      if (!chunks.contains(chunk.place)) continue;
      if (auto done = types.renumber(chunk.voxels, loaded.scene.types); !done) return done.error();
      grid.grid.put_chunk(chunk.place, std::move(chunk.voxels));
    }
    std::ranges::move(part.broken, std::back_inserter(broken));
  }
  add_lines(broken, loaded.warnings);
  const std::size_t outside = source.parts().size() - reading.wanted.size();
  if (outside > 0) {
    loaded.warnings.push_back("only what lies around its spawn: " + std::to_string(reading.wanted.size()) + " of " +
                              std::to_string(source.parts().size()) +
                              " parts of the world (converted to .quoin it is all there)");
  }
  const GridHandle handle = loaded.scene.add_grid(std::move(grid));
  Instance instance;
  instance.name = source.info().name;
  instance.grid = handle;
  instance.voxel_size = source.info().spacing;
  loaded.scene.add_instance(std::move(instance));
  return loaded;
}

IBox chunks_around_spawn(const ChunkSource& source, int radius) {
  const IBox& all = source.info().chunks;
  IVec3 middle = all.min + all.size() / 2;
  if (source.info().spawn) middle = chunk_of(voxel_of(*source.info().spawn));
  return intersect(all, {{middle.x - radius, all.min.y, middle.z - radius},
                         {middle.x + radius + 1, all.max.y, middle.z + radius + 1}});
}

}  // namespace quoin
