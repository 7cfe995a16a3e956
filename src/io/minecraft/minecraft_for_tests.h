#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

// Small worlds of Minecraft's, made byte by byte.

namespace quoin::minecraft_test {

/// Writes NBT. `order`: little in the Bedrock edition.
class NbtWriter {
 public:
  explicit NbtWriter(std::endian order = std::endian::big) : order_(order) {}

  std::vector<std::byte> bytes;

  NbtWriter& number(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) {
      const int place = order_ == std::endian::little ? i : size - 1 - i;
      bytes.push_back(static_cast<std::byte>(value >> (8 * place)));
    }
    return *this;
  }
  NbtWriter& text(std::string_view value) {
    number(value.size(), 2);
    for (const char c : value) bytes.push_back(static_cast<std::byte>(c));
    return *this;
  }
  NbtWriter& tag(int kind, std::string_view name) { return number(static_cast<std::uint64_t>(kind), 1).text(name); }
  NbtWriter& compound(std::string_view name) { return tag(10, name); }
  NbtWriter& end() { return number(0, 1); }
  NbtWriter& byte(std::string_view name, int value) {
    return tag(1, name).number(static_cast<std::uint64_t>(value), 1);
  }
  NbtWriter& integer(std::string_view name, int value) {
    return tag(3, name).number(static_cast<std::uint64_t>(value), 4);
  }
  NbtWriter& string(std::string_view name, std::string_view value) { return tag(8, name).text(value); }
  NbtWriter& list(std::string_view name, int kind, std::size_t count) {
    return tag(9, name).number(static_cast<std::uint64_t>(kind), 1).number(count, 4);
  }
  NbtWriter& integers(const std::vector<int>& values) {  // a list in a list
    number(3, 1).number(values.size(), 4);
    for (const int value : values) number(static_cast<std::uint64_t>(value), 4);
    return *this;
  }
  NbtWriter& longs(std::string_view name, const std::vector<std::uint64_t>& values) {
    tag(12, name).number(values.size(), 4);
    for (const std::uint64_t value : values) number(value, 8);
    return *this;
  }
  NbtWriter& byte_array(std::string_view name, const std::vector<std::uint8_t>& values) {
    tag(7, name).number(values.size(), 4);
    for (const std::uint8_t value : values) number(value, 1);
    return *this;
  }

 private:
  std::endian order_;
};

/// Creates a region file with one chunk of these bytes at (x, z), by default uncompressed (compression 3).
inline std::vector<std::byte> region_with(const std::vector<std::byte>& chunk, int x = 0, int z = 0,
                                          int compression = 3) {
  const std::size_t sectors = (chunk.size() + 5 + 4095) / 4096;
  std::vector<std::byte> region((2 + sectors) * 4096);
  const auto put = [&](std::size_t at, std::uint64_t value) {
    for (std::size_t i = 0; i < 4; ++i) region[at + i] = static_cast<std::byte>(value >> (8 * (3 - i)));
  };
  put(static_cast<std::size_t>(z * 32 + x) * 4, 2U << 8 | sectors);
  put(8192, chunk.size() + 1);
  region[8196] = static_cast<std::byte>(compression);
  for (std::size_t i = 0; i < chunk.size(); ++i) region[8197 + i] = chunk[i];
  return region;
}

/// A chunk as 1.18 has it, of one section at height `y` with stone where `is_stone`, above all stairs that face east.
inline std::vector<std::byte> chunk_of_stairs(int y) {
  NbtWriter nbt;
  nbt.compound("").integer("DataVersion", 2975).list("sections", 10, 1);
  nbt.byte("Y", y).compound("block_states").list("palette", 10, 3);
  nbt.string("Name", "minecraft:air").end();
  nbt.string("Name", "minecraft:stone").end();
  nbt.string("Name", "minecraft:oak_stairs").compound("Properties").string("facing", "east").string("half", "top");
  nbt.end().end();
  std::vector<std::uint64_t> words(256, 0);
  words[0] = 0x21;            // (0, 0, 0) stone, (1, 0, 0) stairs
  words[255] = 0x1ULL << 60;  // (15, 15, 15)
  nbt.longs("data", words).end().end().end();
  return nbt.bytes;
}

}  // namespace quoin::minecraft_test
