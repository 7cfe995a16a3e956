#pragma once

#include <zlib.h>
#include <zstd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/vec.h>

#include "core/database/connection.h"

// Luanti maps, written independently of the reader.

namespace quoin::luanti_test {

using Bytes = std::vector<std::byte>;

/// Bytes, the most significant of a number first.
class Writer {
 public:
  Bytes bytes;
  Writer& big(std::uint64_t value, int size) {
    for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::byte>(value >> (8 * i)));
    return *this;
  }
  Writer& text(std::string_view value) {
    for (const char c : value) bytes.push_back(static_cast<std::byte>(c));
    return *this;
  }
  Writer& append(std::span<const std::byte> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return *this;
  }
};

inline Bytes deflated(std::span<const std::byte> content) {
  uLongf size = compressBound(static_cast<uLong>(content.size()));
  Bytes out(size);
  EXPECT_EQ(compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(content.data()),
                      static_cast<uLong>(content.size()), 6),
            Z_OK);
  out.resize(size);
  return out;
}

inline Bytes zstd_of(std::span<const std::byte> content) {
  Bytes out(ZSTD_compressBound(content.size()));
  out.resize(ZSTD_compress(out.data(), out.size(), content.data(), content.size(), 3));
  return out;
}

/// The content of one node in a block.
struct Node {
  std::uint16_t number = 0;
  std::uint8_t param2 = 0;
};
struct Block {
  std::vector<std::pair<std::uint16_t, std::string>> names;  // by number
  std::array<Node, 4096> nodes{};                            // x fastest, then y, then z

  Node& at(int x, int y, int z) { return nodes[static_cast<std::size_t>((z * 16 + y) * 16 + x)]; }
};

/// Returns a row of any version from 25 to 29. `width`: bytes of a node's number; with 1, numbers from 2048 to 4095
/// extend into param2.
inline Bytes row_of(const Block& block, int version, int width = 2) {
  Writer names;
  names.big(0, 1).big(block.names.size(), 2);
  for (const auto& [number, name] : block.names) names.big(number, 2).big(name.size(), 2).text(name);
  Writer nodes;
  for (const Node& node : block.nodes) {
    nodes.big(width == 1 && node.number > 127 ? node.number >> 4U : node.number, width);
  }
  for (int i = 0; i < 4096; ++i) nodes.big(static_cast<unsigned>(i) & 15U, 1);  // light
  for (const Node& node : block.nodes) {
    const bool goes_on = width == 1 && node.number > 127;
    nodes.big(goes_on ? (node.number & 15U) << 4U | node.param2 : node.param2, 1);
  }
  const Bytes metadata = Writer().big(0, 1).bytes;
  Writer objects;
  objects.big(0, 1).big(1, 2).big(7, 1).big(0, 12).big(3, 2).text("abc");
  const Bytes timers = Writer().big(10, 1).big(0, 2).bytes;
  Writer row;
  row.big(static_cast<unsigned>(version), 1);
  if (version < 29) {
    row.big(0, 1);  // flags
    if (version >= 27) row.big(0xFFFF, 2);
    row.big(static_cast<unsigned>(width), 1).big(2, 1);
    row.append(deflated(nodes.bytes)).append(deflated(metadata)).append(objects.bytes).big(1234, 4);
    return row.append(names.bytes).append(timers).bytes;
  }
  Writer content;
  content.big(0, 1).big(0xFFFF, 2).big(1234, 4).append(names.bytes);
  content.big(static_cast<unsigned>(width), 1).big(2, 1).append(nodes.bytes);
  content.append(metadata).append(objects.bytes).append(timers);
  return row.append(zstd_of(content.bytes)).bytes;
}

/// A database of blocks. `by_three`: with columns x, y and z, as since 5.12.
class Map {
 public:
  explicit Map(const std::filesystem::path& path, bool by_three = false)
      : database_(Connection::open(path.string(), Connection::Mode::Create).value()), by_three_(by_three) {
    const char* const table = by_three ? "CREATE TABLE IF NOT EXISTS `blocks` (`x` INTEGER, `y` INTEGER, `z` INTEGER, "
                                         "`data` BLOB NOT NULL, PRIMARY KEY (`x`, `z`, `y`))"
                                       : "CREATE TABLE `blocks` (`pos` INT NOT NULL PRIMARY KEY,`data` BLOB)";
    EXPECT_TRUE(database_.run(table));
  }
  void put(IVec3 place, std::span<const std::byte> row) {
    if (!by_three_) {
      put_number((std::int64_t{place.z} * 4096 + place.y) * 4096 + place.x, row);
      return;
    }
    auto insert = database_.prepare("INSERT INTO blocks VALUES (?, ?, ?, ?)").value();
    for (int axis = 0; axis < 3; ++axis) insert.bind(axis, std::int64_t{place[axis]});
    insert.bind(3, row);
    EXPECT_TRUE(insert.run());
  }
  void put_number(std::int64_t number, std::span<const std::byte> row) {
    auto insert = database_.prepare("INSERT INTO blocks VALUES (?, ?)").value();
    insert.bind(0, number);
    insert.bind(1, row);
    EXPECT_TRUE(insert.run());
  }
  void run(const char* sql) { EXPECT_TRUE(database_.run(sql)); }

 private:
  Connection database_;
  bool by_three_;
};

}  // namespace quoin::luanti_test
