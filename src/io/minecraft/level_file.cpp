#include "io/minecraft/level_file.h"

#include "io/minecraft/nbt.h"
#include "io/minecraft/region/region_file.h"

namespace quoin::minecraft {

Result<LevelFile> parse_level_file(std::span<const std::byte> bytes) {
  constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
  const auto expanded = decompress_file(bytes, kMaxBytes);
  if (!expanded) return expanded.error();
  const auto document = nbt::Document::parse(*expanded);
  if (!document) return document.error();
  const nbt::Value data = document->root()["Data"];
  if (!data) return make_error(ErrorCode::BadFormat, "level.dat has no compound Data");
  LevelFile level;
  level.name = data["LevelName"].text().value_or("");
  level.version = data["Version"]["Name"].text().value_or("");
  const nbt::Value place = data["spawn"]["pos"];
  if (place.is_integers() && place.count() == 3) {
    level.spawn = DVec3(place.integer(0), place.integer(1), place.integer(2));
    if (const auto name = data["spawn"]["dimension"].text()) level.spawn_dimension = *name;
  } else if (const auto x = data["SpawnX"].integer(), y = data["SpawnY"].integer(), z = data["SpawnZ"].integer();
             x && y && z) {
    level.spawn = DVec3(*x, *y, *z);
  }
  return level;
}

}  // namespace quoin::minecraft
