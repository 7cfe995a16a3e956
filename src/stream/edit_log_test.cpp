#include <zlib.h>

#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/stream/world_edit.h>

#include "core/bytes/bytes.h"
#include "core/death_for_tests.h"

namespace quoin {
namespace {

EditLog some_log(std::uint32_t author) {
  EditLog log;
  log.add({1, author, {0, WorldEdit::SetVoxels{{{{1, -2, 3}, 4}, {{100, 200, -300}, 5}}}}});
  log.add({2, author, {0, WorldEdit::SetData{{1, -2, 3}, 7, {std::byte{1}, std::byte{2}}}}});
  log.add({5, author, {3, WorldEdit::FillBox{{{-5, -5, -5}, {70, 3, 3}}, 2}}});
  log.add({6, author, {3, WorldEdit::FillSphere{{1.5, 2.5, -3.5}, 9.25, 0}}});
  log.add({7, author, {3, WorldEdit::FieldSphere{{1.5, 2.5, -3.5}, 9.25, 1.5, 3}}});
  log.add({9, author, {3, WorldEdit::FieldBox{{1.5, 2.5, -3.5}, {9.0, 9.0, 9.0}, 0.5, 1.5, 0}}});
  return log;
}

TEST(EditLog, RoundTripsThroughBytes) {
  const EditLog log = some_log(1);
  const auto read = EditLog::decode(log.encode());
  ASSERT_TRUE(read.has_value()) << to_string(read.error());
  EXPECT_EQ(read->edits(), log.edits());
  EXPECT_TRUE(EditLog::decode(EditLog().encode())->empty());
}

// As gzip does: other programs read these files.
TEST(EditLog, StoresTheCrc32OfZlib) {
  const std::vector<std::byte> bytes = some_log(1).encode();
  constexpr std::size_t kHeader = 12;
  constexpr std::size_t kEditHeader = 8;
  int edits = 0;
  for (std::size_t at = kHeader; at < bytes.size();) {
    const auto size = load<std::uint32_t>(&bytes[at], std::endian::little);
    const auto checksum = load<std::uint32_t>(&bytes[at + 4], std::endian::little);
    const auto* const body = reinterpret_cast<const Bytef*>(&bytes[at + kEditHeader]);
    EXPECT_EQ(checksum, crc32(0, body, size)) << at;
    at += kEditHeader + size;
    ++edits;
  }
  EXPECT_EQ(edits, 6);
}

TEST(EditLog, DetectsEveryFlippedByte) {
  const std::vector<std::byte> bytes = some_log(1).encode();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::byte> turned = bytes;
    turned[i] ^= std::byte{0x40};
    EXPECT_FALSE(EditLog::decode(turned).has_value()) << i;
  }
}

TEST(EditLog, DetectsTruncationWithinEdits) {
  const EditLog log = some_log(1);
  const std::vector<std::byte> bytes = log.encode();
  std::size_t whole = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto read = EditLog::decode(std::span(bytes).first(size));
    whole += static_cast<std::size_t>(read.has_value());
    if (!read) {
      EXPECT_TRUE(read.error().byte_offset.has_value());
    }
  }
  EXPECT_EQ(whole, log.edits().size());
}

TEST(EditLog, MergesByNumberAndAuthor) {
  const EditLog a = some_log(1);
  const EditLog b = some_log(2);
  const auto both = EditLog::merged(a, b);
  ASSERT_TRUE(both.has_value());
  ASSERT_EQ(both->edits().size(), 12U);
  EXPECT_EQ(both->edits()[0].author, 1U);
  EXPECT_EQ(both->edits()[1].author, 2U);
  EXPECT_EQ(EditLog::merged(b, a)->edits(), both->edits());
  EXPECT_EQ(EditLog::merged(*both, a)->edits(), both->edits());
  EditLog other;
  other.add({1, 1, {9, WorldEdit::FillBox{}}});
  EXPECT_FALSE(EditLog::merged(a, other).has_value());
}

TEST(WorldEdit, ListsAffectedChunks) {
  const auto chunks = [](WorldEdit::Content content) { return chunks_of_edit({0, std::move(content)}); };
  EXPECT_EQ(chunks(WorldEdit::FillBox{{{0, 0, 0}, {65, 1, 1}}, 1})->size(), 2U);
  EXPECT_EQ(chunks(WorldEdit::FillBox{})->size(), 0U);
  EXPECT_EQ(chunks(WorldEdit::SetVoxels{{{{0, 0, 0}, 1}, {{64, 0, 0}, 1}, {{1, 0, 0}, 1}}})->size(), 2U);
  EXPECT_EQ(chunks(WorldEdit::FillSphere{{32.0, 32.0, 32.0}, 5.0, 1})->size(), 1U);
  EXPECT_EQ(chunks(WorldEdit::FieldSphere{{60.0, 32.0, 32.0}, 1.0, 0.0, 1})->size(), 2U);
  EXPECT_EQ(chunks(WorldEdit::FillBox{{IVec3{-1'000'000}, IVec3{1'000'000}}, 1}).error().code,
            ErrorCode::LimitExceeded);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(chunks(WorldEdit::FillSphere{{nan, 0.0, 0.0}, 5.0, 1}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(chunks(WorldEdit::FieldSphere{{0.0, 0.0, 0.0}, -1.0, 0.0, 1}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(chunks(WorldEdit::FieldBox{{0.0, 0.0, 0.0}, {1.0, nan, 1.0}, 0.0, 0.0, 1}).error().code,
            ErrorCode::InvalidArgument);
}

TEST(EditLogDeathTest, RejectsOutOfOrderEdits) {
  EditLog log = some_log(1);
  QUOIN_EXPECT_MISTAKE(log.add({9, 1, {0, WorldEdit::FillBox{}}}), "an edit later than the last one");
}

}  // namespace
}  // namespace quoin
