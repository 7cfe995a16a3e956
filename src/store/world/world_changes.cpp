#include "store/world/world_changes.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>

#include "grid/chunk/chunk_storage.h"
#include "io/scene_file/scene_parts.h"
#include "store/chunk/density_section.h"
#include "store/chunk/voxel_sections.h"
#include "store/world/part_text.h"

namespace quoin::store {

namespace {

std::string text_of_part(const InstancePart& instance) {
  SceneFile::Placement named = instance.placement;
  named.instance.name = *instance.name;
  return text_of(named);
}

bool is_readable_part(const InstancePart& instance) {
  QUOIN_ASSERT(instance.name != nullptr && instance.placement.instance.name.empty(),
               "the name is next to the instance");
  return is_readable_name(*instance.name) && is_readable(instance.placement);
}

bool is_same(DVec3 a, DVec3 b) {
  return scene_json::is_same(a.x, b.x) && scene_json::is_same(a.y, b.y) && scene_json::is_same(a.z, b.z);
}

template <class T>
void erase_grid(ChunkMap<T>& chunks, std::uint32_t grid) {
  for (auto at = chunks.begin(); at != chunks.end();) at = at->first.grid == grid ? chunks.erase(at) : std::next(at);
}

}  // namespace

bool is_same(const InstancePart& a, const InstancePart& b) {
  const Instance& own = a.placement.instance;
  const Instance& other = b.placement.instance;
  const DQuat& p = own.rotation;
  const DQuat& q = other.rotation;
  const auto numbers = [](const SceneFile::Placement& of) { return std::tie(of.grid, of.group, of.layer); };
  return is_same(own.position, other.position) && is_same(DVec3(p.x, p.y, p.z), DVec3(q.x, q.y, q.z)) &&
         scene_json::is_same(p.w, q.w) && scene_json::is_same(own.voxel_size, other.voxel_size) &&
         own.mirrored == other.mirrored && own.visible == other.visible && own.categories == other.categories &&
         numbers(a.placement) == numbers(b.placement) && (a.name == b.name || *a.name == *b.name);
}

// Does not compile if the number of members changes.
Instance without_name(const Instance& instance) {
  const auto& [name, grid, position, rotation, voxel_size, mirrored, visible, group, layer, categories, saved] =
      instance;
  return {{}, grid, position, rotation, voxel_size, mirrored, visible, group, layer, categories, saved};
}

std::span<const std::byte> bytes_of(const PartContent& content, PartBody& made) {
  if (const auto* const body = std::get_if<PartBody>(&content)) return *body;
  const auto* const instance = std::get_if<InstancePart>(&content);
  made = body_of(instance != nullptr ? text_of_part(*instance) : text_of(std::get<SceneFile::Group>(content)));
  return made;
}

PartBody body_of(PartContent content) {
  if (auto* const body = std::get_if<PartBody>(&content)) return std::move(*body);
  PartBody made;
  static_cast<void>(bytes_of(content, made));
  return made;
}

namespace {

// Replaces `known` by the union of two sorted lists. `united` is only used for its memory.
template <class T>
void unite(std::vector<Handle<T>>& known, const std::vector<Handle<T>>& more, std::vector<Handle<T>>& united) {
  QUOIN_ASSERT(std::is_sorted(more.begin(), more.end()), "sorted changes");
  if (std::includes(known.begin(), known.end(), more.begin(), more.end())) return;
  united.clear();
  std::set_union(known.begin(), known.end(), more.begin(), more.end(), std::back_inserter(united));
  std::swap(known, united);
}

}  // namespace

void ChangedObjects::add(const SceneChanges& changes, std::size_t most) {
  if (changes.all) return add_all();
  if (changes_.all) return;
  unite(changes_.grids, changes.grids, united_.grids);
  unite(changes_.instances, changes.instances, united_.instances);
  unite(changes_.groups, changes.groups, united_.groups);
  unite(changes_.layers, changes.layers, united_.layers);
  const std::size_t size =
      changes_.grids.size() + changes_.instances.size() + changes_.groups.size() + changes_.layers.size();
  if (size > most) add_all();
}

void ChangedObjects::add_all() {
  changes_ = {};
  changes_.all = true;
}

void SaveInSteps::put_chunk(std::uint32_t number, const Grid& voxels, const DensityGrid& field, IVec3 chunk) {
  if (!voxels.is_loaded(chunk) || !field.is_loaded(chunk)) return;
  StoredChunk stored;
  if (const Chunk* const found = voxels.find_chunk(chunk)) stored.voxels = *found;
  if (const DensityChunk* const found = field.find_chunk(chunk)) stored.densities = *found;
  changes.put_chunk({number, 0, chunk}, std::move(stored));
}

bool SaveInSteps::copy_chunks(StepTime& time) {
  for (; next_grid < grids.size(); ++next_grid, next_chunk = 0) {
    const OfGrid& of = grids[next_grid];
    for (; next_chunk < of.chunks.size(); ++next_chunk) {
      if (time.is_over()) return false;
      put_chunk(of.number, of.voxels, of.field, of.chunks[next_chunk]);
    }
  }
  return true;
}

void ChangeSet::remove_grid(std::uint32_t number) {
  erase_grid(chunks, number);
  parts.insert_or_assign({part::kGrid, std::int64_t{number}}, std::nullopt);
  removed_grids.insert(number);
}

void ChangeSet::add(ChangeSet&& later) {
  make_room(chunks, later.chunks.size());
  // No allocation from here on: chunks have room, and existing nodes move one by one.
  for (const std::uint32_t grid : later.removed_grids) erase_grid(chunks, grid);
  removed_grids.merge(later.removed_grids);
  for (auto at = later.chunks.begin(); at != later.chunks.end(); ++at) {
    chunks.insert_or_assign(at->first, std::move(at.value()));
  }
  later.chunks.clear();
  while (!later.parts.empty()) {
    auto node = later.parts.extract(later.parts.begin());
    parts.erase(node.key());
    parts.insert(std::move(node));
  }
  later.removed_grids.clear();
}

namespace {

constexpr std::size_t kMaxValueBytes = std::size_t{64} << 20;

// Adds types up to a number, with placeholders for lost types in between.
Status fill_types(VoxelRegistry& types, std::int64_t number, std::vector<std::string>& damage) {
  while (static_cast<std::int64_t>(types.size()) < number) {
    const auto missing = static_cast<std::int64_t>(types.size());
    damage.push_back(name_of({part::kType, missing}) + " is lost");
    if (const auto added = types.add(lost_type(missing)); !added) return added.error();
  }
  return {};
}

Status put_type(VoxelRegistry& types, std::int64_t number, const VoxelProperties& properties) {
  QUOIN_ASSERT(number >= 1 && number <= static_cast<std::int64_t>(types.size()), "a known type, or the next one");
  if (number == static_cast<std::int64_t>(types.size())) {
    const auto added = types.add(properties);
    return added ? Status() : Status(added.error());
  }
  types.replace(static_cast<VoxelType>(number), properties);
  return {};
}

Status check_data(const Chunk& chunk, const VoxelRegistry& types) {
  if (chunk.data_count() == 0) return {};
  std::string fault;
  std::size_t bytes = 0;
  chunk.for_each_data([&](IVec3 local, const VoxelData& data) {
    const std::uint8_t bits = types[chunk.get(local)].state_bits;
    const bool fits = bits == kMaxStateBits || data.state >> bits == 0;
    if (!fits && fault.empty()) fault = "a state has more bits than its type allows";
    bytes += data.bytes.size();
  });
  if (bytes > kMaxChunkDataBytes) fault = "its voxel data exceeds 64 MiB";
  if (!fault.empty()) return make_error(ErrorCode::InvalidArgument, fault);
  return {};
}

// Returns a type of the chunk that is not registered, if there is one. Allocates nothing at up to 8 bits per voxel.
std::optional<VoxelType> undefined_type(const Chunk& chunk, const VoxelRegistry& types) {
  const auto is_undefined = [&](VoxelType type) { return type >= types.size(); };
  if (const auto uniform = chunk.uniform()) return is_undefined(*uniform) ? uniform : std::nullopt;
  const ChunkStorage& m = *ChunkStorage::of(chunk);
  if (m.direct()) {
    const std::vector<VoxelType> used = chunk.types();
    const auto found = std::ranges::find_if(used, is_undefined);
    return found == used.end() ? std::nullopt : std::optional(*found);
  }
  for (std::size_t i = 0; i < m.palette.size(); ++i) {
    if (m.counts[i] != 0 && is_undefined(m.palette[i])) return m.palette[i];
  }
  return std::nullopt;
}

Status check_types(const Chunk& chunk, const VoxelRegistry& types) {
  const auto type = undefined_type(chunk, types);
  if (!type) return {};
  return make_error(ErrorCode::InvalidArgument,
                    "it has voxels of type " + std::to_string(*type) + ", which is not defined");
}

// Checks everything except densities: those of saved grids are valid.
Status check_content(const StoredChunk& chunk, const VoxelRegistry& types) {
  if (auto done = check_types(chunk.voxels, types); !done) return done;
  if (auto done = check_data(chunk.voxels, types); !done) return done;
  return chunk.densities ? check_types(chunk.densities->materials(), types) : Status();
}

}  // namespace

VoxelProperties lost_type(std::int64_t number) {
  VoxelProperties properties;
  properties.name = "lost type " + std::to_string(number);
  properties.colour = {255, 0, 255, 255};
  properties.state_bits = kMaxStateBits;  // accepts any state of its voxels
  return properties;
}

std::string about(const ChunkAddress& place) {
  std::string text = "chunk (";
  for (int axis = 0; axis < 3; ++axis) text += std::to_string(place.chunk[axis]) + (axis < 2 ? ", " : ") of grid ");
  return text + std::to_string(place.grid);
}

bool WorldRules::concern(const ChangeSet& changes) {
  for (const auto& [key, body] : changes.parts) {
    if (key.kind == part::kType || key.kind == part::kGrid) return true;
  }
  return false;
}

Result<WorldRules> WorldRules::after(const ChangeSet& changes) const {
  WorldRules rules = *this;
  for (const auto& [key, body] : changes.parts) {
    const auto* const number = std::get_if<std::int64_t>(&key.id);
    if (key.kind == part::kType && body && number != nullptr) {
      const auto type = part_from<VoxelProperties>(std::get<PartBody>(*body), name_of(key));
      if (!type) return make_error(ErrorCode::InvalidArgument, type.error().message);
      if (*number < 1) return make_error(ErrorCode::InvalidArgument, name_of(key) + ": number out of range");
      if (*number > static_cast<std::int64_t>(rules.types.size())) {
        return make_error(ErrorCode::InvalidArgument, name_of(key) + " must not be put before lower numbers");
      }
      if (*number < static_cast<std::int64_t>(rules.types.size()) &&
          type->state_bits < rules.types[static_cast<VoxelType>(*number)].state_bits) {
        return make_error(ErrorCode::InvalidArgument, name_of(key) + " must not have fewer state bits than before");
      }
      if (auto done = put_type(rules.types, *number, *type); !done) return done.error();
    }
    if (key.kind == part::kGrid && number != nullptr) {
      if (*number < 0 || *number > kMaxGridNumber)
        return make_error(ErrorCode::InvalidArgument, name_of(key) + ": number out of range");
      const auto grid_number = static_cast<std::uint32_t>(*number);
      if (!body) {
        rules.grids.erase(grid_number);
        continue;
      }
      const auto grid = part_from<WorldGrid>(std::get<PartBody>(*body), name_of(key));
      if (!grid) return make_error(ErrorCode::InvalidArgument, grid.error().message);
      rules.grids.insert_or_assign(grid_number, *grid);
    }
  }
  return rules;
}

Result<WorldRules> read_rules(WorldReader& reader) {
  WorldRules rules;
  Status fault;
  const auto keep = [&](Status outcome) {
    if (!outcome && fault) fault = std::move(outcome);
  };
  const Status types = reader.each_part(part::kType, [&](const Part& part, bool is_sound) {
    const auto* const number = std::get_if<std::int64_t>(&part.key.id);
    if (number == nullptr || *number < 1 || *number > static_cast<std::int64_t>(kMaxVoxelTypes)) {
      rules.damage.push_back(name_of(part.key) + " has an invalid number");
      return;
    }
    keep(fill_types(rules.types, *number, rules.damage));
    auto type = is_sound ? part_from<VoxelProperties>(part.body, name_of(part.key))
                         : Result<VoxelProperties>(make_error(ErrorCode::BadFormat, name_of(part.key) + " is damaged"));
    if (!type) rules.damage.push_back(type.error().message);
    if (fault) keep(put_type(rules.types, *number, type ? *type : lost_type(*number)));
  });
  if (!types) return types.error();
  const Status grids = reader.each_part(part::kGrid, [&](const Part& part, bool is_sound) {
    const auto* const number = std::get_if<std::int64_t>(&part.key.id);
    if (number == nullptr || *number < 0 || *number > kMaxGridNumber) {
      rules.damage.push_back(name_of(part.key) + " has an invalid number");
      return;
    }
    const auto grid = is_sound ? part_from<WorldGrid>(part.body, name_of(part.key))
                               : Result<WorldGrid>(make_error(ErrorCode::BadFormat, name_of(part.key) + " is damaged"));
    if (!grid) rules.damage.push_back(grid.error().message);
    rules.grids.emplace(static_cast<std::uint32_t>(*number), grid.value_or(WorldGrid{}));
  });
  if (!grids) return grids.error();
  if (!fault) return fault.error();
  return rules;
}

Status check_address(const ChunkAddress& place) {
  if (place.grid > kMaxGridNumber) {
    return make_error(ErrorCode::InvalidArgument, about(place) + ": the grid's number is out of range");
  }
  if (!kAllChunks.contains(place.chunk)) {
    return make_error(ErrorCode::InvalidArgument, about(place) + " lies more than 2^26 chunks from the origin");
  }
  return {};
}

Status check_changes(const ChangeSet& changes, const WorldRules& rules) {
  for (const auto& [place, chunk] : changes.chunks) {
    if (!chunk) continue;
    if (auto done = check_address(place); !done) return done;
    const auto grid = rules.grids.find(place.grid);
    if (grid == rules.grids.end()) {
      return make_error(ErrorCode::InvalidArgument, about(place) + ": the grid is not defined");
    }
    if (const auto done = check_content(*chunk, rules.types); !done) {
      return make_error(done.error().code, about(place) + ": " + done.error().message);
    }
  }
  for (const auto& [key, content] : changes.parts) {
    if (!content) continue;
    const auto* const body = std::get_if<PartBody>(&*content);
    if (body == nullptr) {  // readable, as checked when it was put
      if (auto done = check_number(key); !done) return done;
      continue;
    }
    if (body->size() > kMaxValueBytes) {
      return make_error(ErrorCode::InvalidArgument, name_of(key) + " exceeds 64 MiB");
    }
    // Types and grids were read by `after`.
    if (key.kind == part::kType || key.kind == part::kGrid) continue;
    if (auto done = check_part(key, *body); !done) return done;
  }
  return {};
}

}  // namespace quoin::store

namespace quoin {

Status validate_chunk(const StoredChunk& chunk, const VoxelRegistry& types, float band) {
  if (auto done = store::check_content(chunk, types); !done) return done;
  if (!chunk.densities || store::has_stored_densities(*chunk.densities, band)) return {};
  return make_error(ErrorCode::InvalidArgument,
                    "it has a density that is not a number, beyond the band, -0 or too close to 0");
}

WorldChanges::WorldChanges() : content_(std::make_unique<store::ChangeSet>()) {}
WorldChanges::WorldChanges(WorldChanges&&) noexcept = default;
WorldChanges& WorldChanges::operator=(WorldChanges&&) noexcept = default;
WorldChanges::~WorldChanges() = default;

void WorldChanges::put_chunk(const ChunkAddress& address, StoredChunk chunk) {
  content_->chunks.insert_or_assign(address, std::move(chunk));
}

void WorldChanges::remove_chunk(const ChunkAddress& address) {
  content_->chunks.insert_or_assign(address, std::nullopt);
}

void WorldChanges::put_types(const VoxelRegistry& types, VoxelType first) {
  for (std::size_t type = std::max<VoxelType>(first, 1); type < types.size(); ++type) {
    put_type(static_cast<VoxelType>(type), types[static_cast<VoxelType>(type)]);
  }
}

void WorldChanges::put_type(VoxelType type, const VoxelProperties& properties) {
  QUOIN_ASSERT(type != kAir, "a type other than air");
  WorldParts::put(*this, store::part::kType, type, store::text_of(properties));
}

void WorldChanges::put_grid(std::uint32_t number, const WorldGrid& grid) {
  WorldParts::put(*this, store::part::kGrid, number, store::text_of(grid));
}

void WorldChanges::remove_grid(std::uint32_t number) {
  content_->remove_grid(number);
}

void WorldChanges::put_value(std::string name, std::vector<std::byte> bytes) {
  WorldParts::put(*this, {store::part::kValue, std::move(name)}, std::move(bytes));
}

void WorldChanges::remove_value(std::string name) {
  WorldParts::put(*this, {store::part::kValue, std::move(name)}, std::nullopt);
}

void WorldChanges::put_thumbnail(std::vector<std::byte> png) {
  WorldParts::put(*this, {store::part::kThumbnail, std::int64_t{0}}, std::move(png));
}

void WorldChanges::remove_thumbnail() {
  WorldParts::put(*this, {store::part::kThumbnail, std::int64_t{0}}, std::nullopt);
}

bool WorldChanges::empty() const {
  return content_->empty();
}

std::size_t WorldChanges::chunk_count() const {
  return content_->chunks.size();
}

void WorldParts::put(WorldChanges& changes, store::PartKey key, std::optional<PartBody> body) {
  changes.content().parts.insert_or_assign(std::move(key), std::move(body));
}

void WorldParts::put(WorldChanges& changes, std::int64_t id, store::InstancePart instance) {
  const char* const kind = store::part::kInstance;
  if (!store::is_readable_part(instance)) return put(changes, kind, id, store::text_of_part(instance));
  changes.content().parts.insert_or_assign({kind, id}, std::move(instance));
}

void WorldParts::put(WorldChanges& changes, std::int64_t id, SceneFile::Placement instance) {
  auto name = std::make_shared<const std::string>(std::exchange(instance.instance.name, {}));
  put(changes, id, store::InstancePart{std::move(instance), std::move(name)});
}

void WorldParts::put(WorldChanges& changes, std::int64_t id, SceneFile::Group group) {
  const char* const kind = store::part::kGroup;
  if (!store::is_readable(group)) return put(changes, kind, id, store::text_of(group));
  changes.content().parts.insert_or_assign({kind, id}, std::move(group));
}

void WorldParts::put(WorldChanges& changes, const char* kind, std::int64_t id, std::string_view text) {
  put(changes, {kind, id}, store::body_of(text));
}

void WorldParts::remove(WorldChanges& changes, const char* kind, std::int64_t id) {
  put(changes, {kind, id}, std::nullopt);
}

}  // namespace quoin
