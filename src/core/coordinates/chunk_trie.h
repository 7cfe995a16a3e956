#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <new>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/ref.h>
#include <quoin/core/vec.h>

#include "core/memory/large_array.h"

namespace quoin {

/// The chunks of a grid by their coordinates, in a tree that its copies share.
///
///                root                     A node of level n covers a cube with an edge of 4^(n+1) chunks and has
///           2: [ . . x . x . ]            64 slots. A node of level 0 holds the entries themselves. Levels with a
///                  |     |                single child are omitted, so a distant chunk costs a single node.
///           0: [ e . e ] |                `prefix` contains the coordinates of a node's cube in units of its size.
///                     1: [ x . x ]
///                          |   |
///                       0: [e] [e e]
///
/// A copy shares all nodes. A change copies the shared nodes between the root and its entry, 64 slots each. Its time is
/// proportional to the levels and independent of the number of chunks.
/// Threads: as Ref; a trie may be changed while copies of it are read and destroyed on other threads.
template <class Entry>
class ChunkTrie {
 public:
  /// The entries of 4^3 neighbouring chunks.
  struct Leaf;

  [[nodiscard]] const Entry* find(int x, int y, int z) const {
    const Place at = place_of(x, y, z);
    for (const Node* node = root_.get(); node != nullptr;) {
      if (!covers(*node, at)) return nullptr;
      const unsigned slot = slot_of(at, node->level);
      if ((node->present >> slot & 1U) == 0) return nullptr;
      if (node->level == 0) return &static_cast<const Leaf*>(node)->entries[slot];
      node = static_cast<const Inner*>(node)->children[slot].get();
    }
    return nullptr;
  }

  /// Returns the entry, unshared, or null if there is none. Calls `on_copy(leaf)` if the entries around it were copied
  /// and have new addresses.
  template <class OnCopy>
  Entry* find_to_edit(IVec3 chunk, OnCopy&& on_copy) {
    return find(chunk.x, chunk.y, chunk.z) == nullptr ? nullptr : &find_or_create(chunk, on_copy);
  }

  /// Returns the entry of a chunk and creates it if missing. Requires: the chunk's voxels have int32 coordinates.
  template <class OnCopy>
  Entry& find_or_create(IVec3 chunk, OnCopy&& on_copy) {
    const Place at = place_of(chunk.x, chunk.y, chunk.z);
    QUOIN_ASSERT((at[0] | at[1] | at[2]) < 2 * kOrigin, "its voxels have int32 coordinates");
    if (root_ == nullptr) root_ = make_node<Leaf>(at);
    Ref<Node>* here = &root_;
    for (;;) {
      const bool was_shared = here->is_shared();
      if (was_shared) *here = copy_of(**here);
      Node& node = **here;
      if (was_shared && node.level == 0) on_copy(static_cast<Leaf&>(node));
      if (!covers(node, at)) {
        insert_above(*here, at);
        continue;
      }
      const unsigned slot = slot_of(at, node.level);
      const std::uint64_t bit = std::uint64_t{1} << slot;
      if (node.level == 0) {
        size_ += static_cast<std::size_t>((node.present & bit) == 0);
        node.present |= bit;
        return static_cast<Leaf&>(node).entries[slot];
      }
      here = &static_cast<Inner&>(node).children[slot];
      if (*here == nullptr) *here = make_node<Leaf>(at);
      node.present |= bit;
    }
  }

  /// Returns false if there is no entry.
  template <class OnCopy>
  bool erase(IVec3 chunk, OnCopy&& on_copy) {
    if (find_to_edit(chunk, on_copy) == nullptr) return false;
    erase_below(root_, place_of(chunk.x, chunk.y, chunk.z));
    --size_;
    QUOIN_ASSERT((size_ == 0) == (root_ == nullptr), "no nodes without entries");
    return true;
  }
  void clear() {
    root_.reset();
    size_ = 0;
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  /// Returns true if both are the same tree: copies of each other without changes since, or empty. Cost: O(1).
  [[nodiscard]] bool shares_all_with(const ChunkTrie& other) const { return root_ == other.root_; }

  /// Calls `visit(chunk, entry)` for each entry in the box of chunks. The order depends only on the coordinates.
  template <class Visit>
  void for_each_in(const IBox& chunks, Visit&& visit) const {
    if (root_ != nullptr) walk(*root_, &chunks, visit);
  }
  template <class Visit>
  void for_each(Visit&& visit) const {
    if (root_ != nullptr) walk(*root_, nullptr, visit);
  }
  /// Visits the entries of one leaf.
  template <class Visit>
  static void for_each_of(Leaf& leaf, Visit&& visit) {
    for (std::uint64_t left = leaf.present; left != 0; left &= left - 1) {
      const auto slot = static_cast<unsigned>(std::countr_zero(left));
      visit(chunk_at(leaf, slot), leaf.entries[slot]);
    }
  }

  /// Returns the size of all nodes with their entries, including nodes shared with copies.
  [[nodiscard]] std::size_t bytes() const { return root_ == nullptr ? 0 : bytes_of(*root_); }

 private:
  static constexpr int kLog = 2;  // log2 of the slots along an edge
  static constexpr unsigned kEdge = 1U << kLog;
  static constexpr int kLevels = 13;                                // for coordinates of 26 bits
  static constexpr std::uint32_t kOrigin = std::uint32_t{1} << 25;  // offset that makes coordinates not negative

  using Place = std::array<std::uint32_t, 3>;

  struct Node : RefCounted {
    Node(int node_level, Place node_prefix) : level(node_level), prefix(node_prefix) {}
    void operator delete(Node* node, std::destroying_delete_t) {
      if (node->level == 0) {
        static_cast<Leaf*>(node)->~Leaf();
        free_block(node, sizeof(Leaf));
      } else {
        static_cast<Inner*>(node)->~Inner();
        free_block(node, sizeof(Inner));
      }
    }
    int level;
    Place prefix;
    std::uint64_t present = 0;
  };

 public:
  struct Leaf : Node {
    explicit Leaf(const Place& at) : Node(0, prefix_of(at, 0)) {}
    std::array<Entry, 64> entries;
  };

 private:
  struct Inner : Node {
    Inner(int node_level, const Place& at) : Node(node_level, prefix_of(at, node_level)) {}
    std::array<Ref<Node>, 64> children;
  };

  // A leaf is a large block if its entries have more than 64 bytes.
  template <class Made, class... Arguments>
  static Ref<Node> make_node(Arguments&&... arguments) {
    void* const block = allocate_block(sizeof(Made));
    try {
      return Ref<Node>(new (block) Made(std::forward<Arguments>(arguments)...));
    } catch (...) {
      free_block(block, sizeof(Made));
      throw;
    }
  }

  static Place place_of(int x, int y, int z) {
    return {static_cast<std::uint32_t>(x) + kOrigin, static_cast<std::uint32_t>(y) + kOrigin,
            static_cast<std::uint32_t>(z) + kOrigin};
  }
  static Place prefix_of(const Place& at, int level) {
    const int shift = kLog * (level + 1);
    return {at[0] >> shift, at[1] >> shift, at[2] >> shift};
  }
  // Component by component: comparing a freshly written array as a whole waits for its writes.
  static bool covers(const Node& node, const Place& at) {
    const int shift = kLog * (node.level + 1);
    return ((at[0] >> shift ^ node.prefix[0]) | (at[1] >> shift ^ node.prefix[1]) |
            (at[2] >> shift ^ node.prefix[2])) == 0;
  }
  static unsigned slot_of(const Place& at, int level) {
    const int shift = kLog * level;
    return (at[0] >> shift & (kEdge - 1)) | (at[1] >> shift & (kEdge - 1)) << kLog |
           (at[2] >> shift & (kEdge - 1)) << (2 * kLog);
  }
  // Returns the lowest chunk of a node's slot.
  static IVec3 chunk_at(const Node& node, unsigned slot) {
    QUOIN_ASSERT(slot < 64 && (node.present >> slot & 1U) != 0, "a slot in use");
    const int shift = kLog * node.level;
    const auto along = [&](std::size_t axis, unsigned digit) {
      return static_cast<int>(((node.prefix[axis] << kLog | digit) << shift) - kOrigin);
    };
    return {along(0, slot & (kEdge - 1)), along(1, slot >> kLog & (kEdge - 1)), along(2, slot >> (2 * kLog))};
  }

  static Ref<Node> copy_of(const Node& node) {
    if (node.level == 0) return make_node<Leaf>(static_cast<const Leaf&>(node));
    return make_node<Inner>(static_cast<const Inner&>(node));
  }

  // Replaces a node that does not cover a chunk by the smallest node that covers both, with the old one as child.
  static void insert_above(Ref<Node>& here, const Place& at) {
    int level = here->level;
    Place other = here->prefix;
    do {
      ++level;
      QUOIN_ASSERT(level < kLevels, "a node of the top level covers all chunks");
      for (std::uint32_t& coordinate : other) coordinate >>= kLog;
    } while (prefix_of(at, level) != other);
    const int down = kLog * (level - 1 - here->level);
    unsigned slot = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      slot |= (here->prefix[axis] >> down & (kEdge - 1)) << (kLog * static_cast<int>(axis));
    }
    QUOIN_ASSERT(slot_of(at, level) != slot, "the smallest node that covers both");
    Ref<Node> inner = make_node<Inner>(level, at);
    static_cast<Inner&>(*inner).children[slot] = std::move(here);
    inner->present = std::uint64_t{1} << slot;
    here = std::move(inner);
  }

  // Requires: the entry exists, and no node on the path to it is shared.
  static void erase_below(Ref<Node>& here, const Place& at) {
    QUOIN_ASSERT(!here.is_shared(), "nodes are copied before they change");
    Node& node = *here;
    const unsigned slot = slot_of(at, node.level);
    const std::uint64_t bit = std::uint64_t{1} << slot;
    QUOIN_ASSERT(covers(node, at) && (node.present & bit) != 0, "the entry is there");
    if (node.level == 0) {
      static_cast<Leaf&>(node).entries[slot] = Entry();
      node.present &= ~bit;
    } else {
      auto& children = static_cast<Inner&>(node).children;
      erase_below(children[slot], at);
      if (children[slot] == nullptr) node.present &= ~bit;
      if (std::has_single_bit(node.present)) {
        Ref<Node> only = std::move(children[static_cast<std::size_t>(std::countr_zero(node.present))]);
        here = std::move(only);
        return;
      }
    }
    if (node.present == 0) here.reset();
  }

  template <class Visit>
  static void walk(const Node& node, const IBox* box, Visit&& visit) {
    for (std::uint64_t left = node.present; left != 0; left &= left - 1) {
      const auto slot = static_cast<unsigned>(std::countr_zero(left));
      const IVec3 first = chunk_at(node, slot);
      if (box != nullptr && !meets(*box, first, kLog * node.level)) continue;
      if (node.level == 0) {
        visit(first, static_cast<const Leaf&>(node).entries[slot]);
      } else {
        walk(*static_cast<const Inner&>(node).children[slot], box, visit);
      }
    }
  }

  static bool meets(const IBox& box, IVec3 first, int log_size) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t end = std::int64_t{first[axis]} + (std::int64_t{1} << log_size);
      if (box.max[axis] <= first[axis] || box.min[axis] >= end) return false;
    }
    return true;
  }

  static std::size_t bytes_of(const Node& node) {
    if (node.level == 0) return sizeof(Leaf);
    std::size_t sum = sizeof(Inner);
    for (const Ref<Node>& child : static_cast<const Inner&>(node).children) {
      if (child != nullptr) sum += bytes_of(*child);
    }
    return sum;
  }

  Ref<Node> root_;
  std::size_t size_ = 0;
};

}  // namespace quoin
