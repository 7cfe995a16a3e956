#include <algorithm>
#include <memory>

#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/packet.h>

#include "bench/ray_workload.h"
#include "counted.h"

namespace quoin::counts {
namespace {

using workloads::RayQuery;

constexpr std::size_t kRays = 8'192;

// Takes evenly spaced tiles of sixteen rays, so that the whole image is covered.
std::vector<RayQuery> some_of(const std::vector<RayQuery>& rays) {
  std::vector<RayQuery> some;
  const std::size_t step = std::max<std::size_t>(rays.size() / kRays, 1) * 16;
  for (std::size_t first = 0; first + 16 <= rays.size(); first += step) {
    for (std::size_t i = 0; i < 16; ++i) some.push_back(rays[first + i]);
  }
  return some;
}

Counted single(const std::string& name, const std::vector<RayQuery>& all, bool is_first) {
  const auto rays = std::make_shared<std::vector<RayQuery>>(some_of(all));
  return {name, [=] {
            const OccupancyTree& tree = workloads::ray_workload().tree;
            for (const RayQuery& query : *rays) {
              if (is_first) {
                (void)first_hit(tree, query.ray, query.max_t);
              } else {
                (void)any_hit(tree, query.ray, query.max_t);
              }
            }
          }};
}

Counted packets(const std::string& name, const std::vector<RayQuery>& all, bool is_first) {
  const auto rays = std::make_shared<std::vector<RayPacket>>();
  const std::vector<RayQuery> some = some_of(all);
  for (std::size_t first = 0; first + 16 <= some.size(); first += 16) {
    RayPacket packet;
    for (int i = 0; i < 16; ++i) {
      const RayQuery& query = some[first + static_cast<std::size_t>(i)];
      packet.set(i, query.ray, query.max_t);
    }
    rays->push_back(packet);
  }
  return {name, [=] {
            const OccupancyTree& tree = workloads::ray_workload().tree;
            PacketHits hits;
            for (const RayPacket& packet : *rays) {
              if (is_first) {
                first_hits(tree, packet, hits);
              } else {
                (void)any_hits(tree, packet);
              }
            }
          }};
}

}  // namespace

std::vector<Counted> ray_work() {
  const workloads::RayWorkload& all = workloads::ray_workload();
  return {single("rays/primary/single", all.primary, true),
          single("rays/shadow/single", all.shadow, false),
          single("rays/ao/single", all.occlusion, false),
          packets("rays/primary/packet", all.primary, true),
          packets("rays/shadow/packet", all.shadow, false),
          packets("rays/ao/packet", all.occlusion, false),
          {"rays/build",
           [] { (void)OccupancyTree::build(workloads::ray_workload().grid, workloads::ray_workload().types); }}};
}

}  // namespace quoin::counts
