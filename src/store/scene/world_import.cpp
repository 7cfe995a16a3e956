#include <quoin/core/assert.h>
#include <quoin/store/world_import.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include <quoin/io/file.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>

#include "core/bytes/files.h"
#include "store/scene/world_file.h"
#include "store/world/part_text.h"
#include "store/world/world_changes.h"

namespace quoin {

using namespace store;

namespace {

using Json = nlohmann::json;

/// Name of the value that stores an unfinished import's progress; finished worlds do not have it.
constexpr const char* kProgressValue = "quoin.import";
/// Maximum number of stored damage lines; further lines are only counted.
constexpr std::size_t kMaxLines = 1'000;
/// Maximum number of pending saves.
constexpr std::size_t kMaxSaves = 2;

/// Returns an identity that differs between sources and resource packs, and changes when files of a source are added or
/// removed.
std::string identity_of(const ChunkSource& source) {
  std::uint64_t hash = 1469598103934665603U;
  for (const IBox& part : source.parts()) {
    for (const int number : {part.min.x, part.min.y, part.min.z, part.max.y}) {
      hash = (hash ^ static_cast<std::uint32_t>(number)) * 1099511628211U;
    }
  }
  const std::string& packs = source.info().packs;
  return source.info().format + ", " + std::to_string(source.parts().size()) + " parts, " + std::to_string(hash) +
         (packs.empty() ? "" : ", packs: " + packs);
}

/// The progress of an import. Saved together with the chunks that it counts.
struct Done {
  std::size_t parts = 0;
  std::uint64_t chunks = 0;
  std::uint64_t voxels = 0;
  std::uint64_t broken_count = 0;
  std::vector<std::string> broken;
  std::uint64_t lamps = 0;
  std::map<std::string, std::uint64_t> invisible;

  void add_broken(const Error& error) {
    if (broken_count++ < kMaxLines) broken.push_back(to_string(error));
  }
};

std::vector<std::byte> bytes_of(const Done& done, const std::string& identity) {
  const Json json = {{"source", identity},    {"parts", done.parts},         {"chunks", done.chunks},
                     {"voxels", done.voxels}, {"broken", done.broken_count}, {"lines", done.broken},
                     {"lamps", done.lamps},   {"invisible", done.invisible}};
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  const auto* const begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

Result<Done> parse_done(std::span<const std::byte> bytes, const std::string& identity) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const Json json = Json::parse(text, nullptr, false);
  const auto number = [&](const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_number_unsigned() ? json[key].get<std::uint64_t>()
                                                                                    : 0;
  };
  if (!json.is_object() || json.value("source", Json()) != identity) {
    return make_error(
        ErrorCode::InvalidArgument,
        "is an unfinished import of another source, of an older state of this one, or with other resource packs; "
        "remove it to start again");
  }
  Done done;
  done.parts = number("parts");
  done.chunks = number("chunks");
  done.voxels = number("voxels");
  done.broken_count = number("broken");
  for (const Json& line : json.value("lines", Json::array())) {
    if (line.is_string()) done.broken.push_back(line.get<std::string>());
  }
  done.lamps = number("lamps");
  const Json invisible = json.value("invisible", Json::object());
  for (const auto& [name, count] : invisible.items()) {
    if (count.is_number_unsigned()) done.invisible[name] = count.get<std::uint64_t>();
  }
  return done;
}

class Import {
 public:
  Import(const ChunkSource& source, std::filesystem::path path, Threads threads)
      : source_(source), path_(std::move(path)), threads_(threads), numbers_(source), identity_(identity_of(source)) {}

  Status run(const Progress& progress) {
    if (auto begun = begin(); !begun) return begun;
    resumed_ = done_.parts;
    const std::size_t at_once = std::size_t{thread_count(threads_)} * 4;
    while (done_.parts < source_.parts().size()) {
      const double fraction = static_cast<double>(done_.parts) / static_cast<double>(source_.parts().size());
      if (progress && !progress(fraction)) {
        if (auto saved = world_->flush(); !saved) return saved;
        return make_error(ErrorCode::Cancelled, "cancelled; run the same command to resume", path_.string());
      }
      const std::size_t count = std::min(at_once, source_.parts().size() - done_.parts);
      if (auto read = read_parts(count); !read) return read;
    }
    return finish();
  }

  [[nodiscard]] ImportedWorld result() && {
    ImportedWorld result;
    result.chunks = done_.chunks;
    result.voxels = done_.voxels;
    result.resumed_parts = resumed_;
    result.broken = std::move(done_.broken);
    result.skipped_blocks = std::move(done_.invisible);
    if (done_.broken_count > kMaxLines) {
      result.broken.push_back("and " + std::to_string(done_.broken_count - kMaxLines) + " more");
    }
    for (std::size_t type = 1; type < types_.size(); ++type) {
      const VoxelProperties& properties = types_[static_cast<VoxelType>(type)];
      if (has_guessed_look(properties)) result.guessed.push_back(properties.name);
    }
    std::ranges::sort(result.guessed);
    const auto same = std::ranges::unique(result.guessed);
    result.guessed.erase(same.begin(), same.end());
    return result;
  }

 private:
  Status begin() {
    std::error_code error;
    const bool is_there = std::filesystem::exists(path_, error);
    auto world = is_there ? WorldStore::open(path_, WorldAccess::Write, threads_) : WorldStore::create(path_, threads_);
    if (!world) return world.error();
    world_.emplace(std::move(*world));
    const auto known = world_->value(kProgressValue);
    if (!known) return known.error();
    if (!*known && is_there) {
      // Created but interrupted before the first save, or not an import.
      const auto grids = world_->grids();
      if (!grids) return grids.error();
      if (!grids->empty()) {
        return make_error(ErrorCode::InvalidArgument, "is not an unfinished import", path_.string());
      }
    }
    return *known ? resume(**known) : begin_anew();
  }

  Status resume(std::span<const std::byte> known) {
    auto done = parse_done(known, identity_);
    if (!done) return make_error(done.error().code, done.error().message, path_.string());
    done_ = std::move(*done);
    auto types = world_->types();
    if (!types) return types.error();
    types_ = std::move(*types);
    const auto grids = world_->grids();
    if (!grids) return grids.error();
    if (grids->size() != 1 || done_.parts > source_.parts().size()) {
      return make_error(ErrorCode::BadFormat, "is damaged; remove it to start again", path_.string());
    }
    grid_ = grids->begin()->first;
    return {};
  }

  // Starts from scratch, with a scene without voxels; chunks are added later.
  Status begin_anew() {
    Scene scene;
    SceneGrid grid;
    grid.name = source_.info().name;
    Instance instance;
    instance.name = source_.info().name;
    instance.voxel_size = source_.info().spacing;
    instance.grid = scene.add_grid(std::move(grid));
    scene.add_instance(std::move(instance));
    for (const Error& error : source_.info().broken) done_.add_broken(error);
    WorldChanges first;
    first.put_value(kProgressValue, bytes_of(done_, identity_));
    WorldSaver saver;
    const auto ticket = saver.save(*world_, scene, std::move(first));
    if (!ticket) return ticket.error();
    if (auto saved = world_->wait(*ticket); !saved) return saved;
    const auto grids = world_->grids();
    if (!grids) return grids.error();
    grid_ = grids->begin()->first;
    return {};
  }

  // Reads the next parts in parallel, numbers their types in order and saves them.
  Status read_parts(std::size_t count) {
    QUOIN_ASSERT(count <= source_.parts().size() - done_.parts, "parts of the source");
    std::vector<std::optional<Result<SourcePart>>> read(count);
    parallel_for(count, threads_, [&](std::size_t i) { read[i] = source_.read_part(done_.parts + i); });
    const std::size_t known_types = types_.size();
    WorldChanges changes;
    for (std::optional<Result<SourcePart>>& part : read) {
      if (!*part) return part->error();
      for (SourceChunk& each : (*part)->chunks) {
        if (auto numbered = numbers_.renumber(each.voxels, types_); !numbered) return numbered;
        ++done_.chunks;
        done_.voxels += static_cast<std::uint64_t>(each.voxels.non_air_count());
        StoredChunk stored;
        stored.voxels = std::move(each.voxels);
        changes.put_chunk({grid_, 0, each.chunk}, std::move(stored));
      }
      for (const Error& error : (*part)->broken) done_.add_broken(error);
      take_invisible(**part, changes);
      ++done_.parts;
    }
    if (types_.size() > known_types) changes.put_types(types_, static_cast<VoxelType>(known_types));
    changes.put_value(kProgressValue, bytes_of(done_, identity_));
    return save(std::move(changes));
  }

  void take_invisible(SourcePart& part, WorldChanges& changes) {
    for (const auto& [name, count] : part.skipped_blocks) done_.invisible[name] += count;
    for (Lamp& lamp : part.lamps) {
      lamp.position *= source_.info().spacing;
      lamp.range *= source_.info().spacing;
      WorldParts::put(changes, part::kLamp, static_cast<std::int64_t>(done_.lamps++), text_of(lamp));
    }
  }

  Status save(WorldChanges changes) {
    const auto ticket = world_->save(std::move(changes));
    if (!ticket) return ticket.error();
    tickets_.push_back(*ticket);
    if (tickets_.size() <= kMaxSaves) return {};
    const SaveTicket oldest = tickets_.front();
    tickets_.pop_front();
    return world_->wait(oldest);
  }

  Status finish() {
    WorldChanges last;
    last.remove_value(kProgressValue);
    if (auto saved = save(std::move(last)); !saved) return saved;
    auto saved = world_->flush();
    world_.reset();
    return saved;
  }

  const ChunkSource& source_;
  std::filesystem::path path_;
  Threads threads_;
  SourceTypes numbers_;
  std::string identity_;
  std::optional<WorldStore> world_;
  std::uint32_t grid_ = 0;
  VoxelRegistry types_;
  Done done_;
  std::size_t resumed_ = 0;
  std::deque<SaveTicket> tickets_;
};

}  // namespace

Result<ImportedWorld> import_world(const ChunkSource& source, const std::filesystem::path& path, Threads threads,
                                   const Progress& progress) {
  const std::filesystem::path target = follow_links(path);
  std::filesystem::path unfinished = target;
  unfinished += ".part";
  Import import(source, unfinished, threads);
  if (auto done = import.run(progress); !done) {
    return make_error(done.error().code, done.error().message,
                      done.error().path.empty() ? unfinished.string() : done.error().path, done.error().byte_offset);
  }
  if (auto put = put_world_in_place(unfinished, target); !put)
    return with_path(Result<ImportedWorld>(put.error()), path);
  ImportedWorld result = std::move(import).result();
  std::error_code error;
  result.bytes = std::filesystem::file_size(target, error);
  return result;
}

}  // namespace quoin
