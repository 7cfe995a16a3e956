#include "io/vox/source.h"

#include <map>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/text.h"

namespace quoin {

namespace {

/// Returns a display name for chunks without a place in a scene; "" for chunks that a scene represents.
std::string kept_as(std::string_view id) {
  if (id == "rCAM") return "cameras";
  if (id == "rOBJ") return "render settings";
  if (id == "NOTE") return "notes";
  // IMAP is stored as the order of the types, META as the frame range.
  if (id == "IMAP" || id == "META" || id == "MATL" || id == "MATT") return {};
  return "chunks " + printable(id);
}

}  // namespace

std::vector<std::string> source_only_features(const VoxSource& source) {
  std::vector<std::string> lines;
  if (vox::is_animated(source.document)) {
    lines.push_back("animation: frames 0 to " + std::to_string(vox::last_frame(source.document)));
  }
  std::map<std::string, int> counts;
  for (const vox::ChunkSpan& place : source.document.chunks) {
    if (place.kind != vox::ChunkKind::Other) continue;
    QUOIN_ASSERT(place.begin + vox::kChunkHeaderBytes <= source.bytes.size(), "a chunk of the file");
    const std::string_view id(reinterpret_cast<const char*>(source.bytes.data()) + place.begin, 4);
    std::string kept = kept_as(id);
    if (!kept.empty()) ++counts[std::move(kept)];
  }
  for (const auto& [kept, count] : counts) lines.push_back(kept + ": " + std::to_string(count));
  return lines;
}

}  // namespace quoin
