#include "render_vk/trees/device_tree.h"

#include <algorithm>
#include <span>
#include <utility>

namespace quoin::vulkan {
namespace {

constexpr std::size_t kPage = 4096;

}  // namespace

Status DeviceTree::put(DeviceMemory& memory, std::vector<ChunkNodeAt> chunks) {
  TopTree top = build_top_tree(chunks, place_.address);
  const std::size_t bytes = top.nodes.size() * sizeof(Node);
  if (bytes > place_.size) {
    memory.release(place_);
    // Half as much again, so that a growing world does not move each time.
    const auto place = memory.allocate(bytes + bytes / 2, "uploading voxels");
    if (!place) return place.error();
    place_ = *place;
    top_.nodes.clear();
    top = build_top_tree(std::move(chunks), place_.address);
  }
  // Only the pages that changed.
  constexpr std::size_t kNodes = kPage / sizeof(Node);
  const std::span<const Node> now(top.nodes);
  const std::span<const Node> before(top_.nodes);
  for (std::size_t first = 0; first < now.size(); first += kNodes) {
    const auto page = now.subspan(first, std::min(kNodes, now.size() - first));
    const bool is_same = before.size() >= first + page.size() &&
                         std::equal(page.begin(), page.end(), before.begin() + static_cast<std::ptrdiff_t>(first));
    if (is_same) continue;
    if (Status done = memory.write(place_, std::as_bytes(page), first * sizeof(Node)); !done) return done;
  }
  top_ = std::move(top);
  return {};
}

void DeviceTree::release(DeviceMemory& memory) {
  memory.release(place_);
  *this = {};
}

ShaderTree DeviceTree::shader_tree(const IBox& bounds, IVec3 origin) const {
  ShaderTree shader;
  if (empty()) return shader;
  shader.root = top_.root;
  shader.low = IVec4(bounds.min - origin, top_.root_level);
  shader.high = IVec4(bounds.max - origin, 0);
  return shader;
}

}  // namespace quoin::vulkan
