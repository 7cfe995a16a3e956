#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include <quoin/render/impostor.h>
#include <quoin/scene/scene.h>

#include "render/impostor/impostor_screen.h"
#include "render/shared/image_detail.h"
#include "render/vulkan/device/device_memory.h"
#include "render/vulkan/trees/shader_data.h"

namespace quoin::vulkan {

class DeviceShapes;
struct Placement;

/// Impostors in device memory, sent when an image first shows them and kept for later images.
///
/// Without waiting, each image sends at most `kFacesPerImage` faces, a fraction of a millisecond. Until a new impostor
/// is complete, the previous one is drawn; instances without any are traced.
class DeviceImpostors {
 public:
  static constexpr std::size_t kFacesPerImage = std::size_t{1} << 16;

  explicit DeviceImpostors(DeviceMemory& memory) : memory_(&memory) {}

  /// Begins an image: sends impostors, and returns the far instances whose impostor is complete; the others must be
  /// traced. `waits`: sends all. `shapes`: receives the models of their shapes; if it is cleared, this must be, too.
  /// Errors: LimitExceeded when a memory is full. It must then be cleared.
  [[nodiscard]] Result<std::vector<FarInstance>> send(const Scene& scene, const FarImpostors& far, bool waits,
                                                      DeviceShapes& shapes);

  /// Prepares an image of `width` by `height` pixels to draw instances from their impostors: camera rays skip them,
  /// and Placement::far has their visible faces. Memory as DeviceDetail::place.
  ///
  /// Requires: `send` returned them. Errors: LimitExceeded if they have more than 2^32 faces. It must then be cleared.
  [[nodiscard]] Status draw(const Scene& scene, std::span<const FarInstance> sent, const ImpostorScreen& screen,
                            int width, int height, Placement& placement) const;
  /// Drops the least recently used impostors not used by the last image, until at most `max_bytes` are held.
  void drop_unused(std::uint64_t max_bytes);

  /// Drops the impostors of removed or replaced grids.
  void follow(const Scene& scene);
  void clear();

  /// Returns the device memory in use.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // The rectangles of levels and unseen faces, the cells of these, and faces.
  static constexpr std::size_t kParts = 2 * (ImpostorFaces::kLevels + 1) + 1;

  // An impostor in device memory, as far as it has been sent.
  struct Sent {
    std::shared_ptr<const Impostor> impostor;  // null: none
    Place place;
    std::array<ShaderFarLevel, ImpostorFaces::kLevels + 1> levels{};  // last: faces that no view saw
    std::uint64_t faces = 0;                                          // address
    std::vector<std::uint32_t> sides;                                 // of pieces of shapes (far.glsl), until sent
    std::size_t part = 0;                                             // part to send next; kParts: complete
    std::size_t at = 0;                                               // position in that part
  };
  struct Entry {
    Sent whole;
    Sent next;
    ChangeCursor grid;
    ChangeCursor field;
    std::uint64_t last_use = 0;
  };
  void release(Entry& entry);
  Status begin(const std::shared_ptr<const Impostor>& impostor, DeviceShapes& shapes, Sent& sent);
  Status send_some(Sent& sent, std::size_t& faces_left);
  Status put(const std::shared_ptr<const Impostor>& impostor, DeviceShapes& shapes, Entry& entry,
             std::size_t& faces_left);
  [[nodiscard]] static ShaderFar shader_far(const Sent& sent, const DrawnImpostor& drawn);

  DeviceMemory* memory_;
  std::map<GridHandle, Entry> entries_;
  std::uint64_t image_ = 0;
};

/// The impostors visible in each tile of an image.
struct FarTiles {
  struct Range {
    std::uint32_t first = 0;  ///< in `parts`
    std::uint32_t count = 0;
    std::uint32_t groups = 0;  ///< that draw them
  };
  std::vector<ShaderFarPart> parts;
  std::vector<Range> ranges;  ///< of each tile, row by row
};

/// Assigns impostors to tiles. `edge`: of the tiles, in pixels. Cost: O(impostors + tiles that they touch).
[[nodiscard]] FarTiles far_tiles(const std::vector<ShaderFar>& far, int edge, int width, int height);

}  // namespace quoin::vulkan
