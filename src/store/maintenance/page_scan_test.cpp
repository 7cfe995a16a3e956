#include "store/maintenance/page_scan.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/memory.h>
#include <quoin/io/file.h>

#include "core/bytes/bytes.h"
#include "core/database/connection.h"
#include "core/death_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "store/chunk/chunk_body.h"
#include "store/world/world_for_tests.h"

namespace quoin::store {
namespace {

using Bytes = std::vector<std::byte>;

/// Returns a unique body of about `bytes` bytes.
Bytes body_of(std::mt19937& random, int number, std::uint64_t revision, std::size_t bytes) {
  VoxelRegistry types;
  VoxelProperties properties;
  properties.state_bits = 8;
  EXPECT_TRUE(types.add(properties).has_value());
  Chunk chunk(VoxelType{1});
  Bytes noise(bytes);
  for (std::byte& byte : noise) byte = static_cast<std::byte>(random());
  chunk.set_data({number % 64, 1, 2}, {1, noise});
  BlockVector<std::byte> body;
  EXPECT_TRUE(ChunkEncoder().encode({0, 0, {number, 0, 0}}, revision, chunk, nullptr, body).has_value());
  return {body.begin(), body.end()};
}

struct Row {
  std::int64_t key = 0;
  Bytes body;
};

Connection opened(const std::filesystem::path& path) {
  auto connection = Connection::open(path.string(), Connection::Mode::Create);
  EXPECT_TRUE(connection.has_value());
  return std::move(*connection);
}

void run(Connection& connection, const std::string& sql) {
  const auto status = connection.run(sql.c_str());
  ASSERT_TRUE(status.has_value()) << sql << ": " << status.error().message;
}

void put_row(Connection& connection, const Row& row) {
  auto statement = connection.prepare("INSERT OR REPLACE INTO chunks VALUES(?, ?)");
  ASSERT_TRUE(statement.has_value());
  statement->bind(0, row.key);
  statement->bind(1, std::span<const std::byte>(row.body));
  ASSERT_TRUE(statement->run().has_value());
}

/// Returns rows of all sizes: most within a page, some across several pages.
std::vector<Row> rows_of(std::mt19937& random, int count) {
  std::vector<Row> rows;
  for (int i = 0; i < count; ++i) {
    const std::size_t bytes = i % 7 == 0 ? 3'000 + random() % 40'000 : 20 + random() % 900;
    const std::int64_t key = i % 5 == 0 ? (std::int64_t{1} << (i % 62)) + i * 3 : i * 1'000;
    rows.push_back({key, body_of(random, i, 1, bytes)});
  }
  return rows;
}

void make_database(const std::filesystem::path& path, int page_size, const std::vector<Row>& rows) {
  Connection connection = opened(path);
  run(connection, "PRAGMA page_size=" + std::to_string(page_size));
  run(connection, "PRAGMA journal_mode=DELETE");
  run(connection, "CREATE TABLE parts(kind TEXT NOT NULL, id NOT NULL, size REAL, body BLOB)");
  run(connection, "CREATE TABLE chunks(key INTEGER PRIMARY KEY, body BLOB NOT NULL)");
  run(connection, "BEGIN");
  for (const Row& row : rows) put_row(connection, row);
  run(connection, "COMMIT");
  ASSERT_TRUE(connection.close().has_value());
}

Bytes file_of(const std::filesystem::path& path) {
  auto bytes = read_file(path);
  EXPECT_TRUE(bytes.has_value());
  return bytes ? std::move(*bytes) : Bytes();
}

void write(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

/// Returns the found bodies with their keys.
std::map<Bytes, std::set<std::int64_t>> found_in(const std::filesystem::path& path) {
  std::map<Bytes, std::set<std::int64_t>> found;
  const auto status = scan_bodies(path, [&](std::int64_t key, std::span<const std::byte> body) {
    found[Bytes(body.begin(), body.end())].insert(key);
  });
  EXPECT_TRUE(status.has_value());
  return found;
}

void expect_all_found(const std::filesystem::path& path, const std::vector<Row>& rows) {
  const auto found = found_in(path);
  EXPECT_EQ(found.size(), rows.size());
  for (const Row& row : rows) {
    const auto body = found.find(row.body);
    ASSERT_NE(body, found.end()) << "row " << row.key;
    EXPECT_TRUE(body->second.contains(row.key)) << "row " << row.key;
  }
}

std::uint32_t number_at(const Bytes& file, std::size_t at, std::size_t bytes) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < bytes; ++i) number = number << 8 | std::to_integer<std::uint32_t>(file[at + i]);
  return number;
}

std::uint64_t take_varint(const Bytes& file, std::size_t& at) {
  std::uint64_t number = 0;
  for (int i = 0; i < 9; ++i) {
    const auto byte = std::to_integer<std::uint64_t>(file[at++]);
    if (i == 8) return number << 8 | byte;
    number = number << 7 | (byte & 0x7FU);
    if (byte < 0x80) break;
  }
  return number;
}

struct Span {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Returns the bytes of each row in an intact file, found by its page headers, which the scan ignores.
std::map<std::int64_t, std::vector<Span>> places_of_rows(const Bytes& file, std::size_t page_size) {
  std::map<std::int64_t, std::vector<Span>> places;
  for (std::size_t page = 0; page < file.size(); page += page_size) {
    const std::size_t header = page == 0 ? 100 : page;
    if (file[header] != std::byte{0x0D} || page == 0) continue;
    const std::size_t cells = number_at(file, header + 3, 2);
    for (std::size_t i = 0; i < cells; ++i) {
      std::size_t at = page + number_at(file, header + 8 + 2 * i, 2);
      std::vector<Span> spans(1, {at, 0});
      std::uint64_t left = take_varint(file, at);
      const auto key = static_cast<std::int64_t>(take_varint(file, at));
      std::uint64_t local = left;
      if (left > page_size - 35) {
        const std::uint64_t least = (page_size - 12) * 32 / 255 - 23;
        local = least + (left - least) % (page_size - 4);
        if (local > page_size - 35) local = least;
      }
      at += local;
      left -= local;
      if (left > 0) at += 4;
      spans[0].end = at;
      std::uint32_t next = left > 0 ? number_at(file, at - 4, 4) : 0;
      while (left > 0) {
        const std::size_t overflow = (next - 1) * page_size;
        const std::size_t count = std::min<std::uint64_t>(left, page_size - 4);
        // The pointer of the last page leads nowhere.
        spans.push_back({overflow + (left > count ? 0 : 4), overflow + 4 + count});
        left -= count;
        next = number_at(file, overflow, 4);
      }
      places[key] = std::move(spans);
    }
  }
  return places;
}

TEST(PageScan, FindsAllRowsOfSoundFile) {
  const WorldFolder folder;
  std::mt19937 random(1);
  for (const int page_size : {512, 1'024, 8'192, 65'536}) {
    const auto path = folder / std::to_string(page_size).c_str();
    const auto rows = rows_of(random, 120);
    make_database(path, page_size, rows);
    expect_all_found(path, rows);
  }
}

TEST(PageScan, FindsAllRowsWithoutFirstPage) {
  const WorldFolder folder;
  std::mt19937 random(2);
  for (const int page_size : {512, 2'048, 4'096, 8'192, 65'536}) {
    const auto path = folder / "world";
    const auto rows = rows_of(random, 60);
    make_database(path, page_size, rows);
    Bytes file = file_of(path);
    std::fill_n(file.begin(), page_size, std::byte{0});
    std::filesystem::remove(path);
    write(path, file);
    expect_all_found(path, rows);
    // Also with a random header.
    for (int i = 0; i < page_size; ++i) file[static_cast<std::size_t>(i)] = static_cast<std::byte>(random());
    std::memcpy(file.data(), "SQLite format 3\0\x02\0", 18);
    write(path, file);
    expect_all_found(path, rows);
    std::filesystem::remove(path);
  }
}

TEST(PageScan, FindsAllRowsWithoutInnerPagesAndHeaders) {
  const WorldFolder folder;
  std::mt19937 random(3);
  const auto path = folder / "world";
  const auto rows = rows_of(random, 900);
  make_database(path, 4'096, rows);
  Bytes file = file_of(path);
  const auto places = places_of_rows(file, 4'096);
  std::vector<bool> is_of_row(file.size());
  for (const auto& [key, spans] : places) {
    for (const Span& span : spans) std::fill(is_of_row.begin() + span.begin, is_of_row.begin() + span.end, true);
  }
  std::size_t inner = 0;
  for (std::size_t page = 0; page < file.size(); page += 4'096) inner += file[page] == std::byte{0x05} ? 1 : 0;
  EXPECT_GT(inner, 0U);
  for (std::size_t i = 0; i < file.size(); ++i) {
    if (!is_of_row[i]) file[i] = static_cast<std::byte>(random());
  }
  write(path, file);
  expect_all_found(path, rows);
}

TEST(PageScan, FindsOnlySoundRows) {
  const WorldFolder folder;
  std::mt19937 random(4);
  const auto path = folder / "world";
  const auto rows = rows_of(random, 80);
  make_database(path, 8'192, rows);
  const Bytes sound = file_of(path);
  const auto places = places_of_rows(sound, 8'192);
  ASSERT_EQ(places.size(), rows.size());
  std::set<Bytes> bodies;
  for (const Row& row : rows) bodies.insert(row.body);
  const int count = cases(1'000, 10'000);
  std::size_t lost = 0;
  for (int i = 0; i < count; ++i) {
    Bytes file = sound;
    for (std::size_t k = 1 + random() % 30; k > 0; --k) {
      // Damages single bytes, sectors and pages.
      const std::size_t length = k % 10 == 0 ? (i % 3 == 0 ? 8'192 : 512) : 1;
      const std::size_t begin = random() % (file.size() / length) * length;
      for (std::size_t b = 0; b < length; ++b) file[begin + b] = static_cast<std::byte>(i % 2 == 0 ? 0 : random());
    }
    write(path, file);
    const auto found = found_in(path);
    for (const auto& [body, keys] : found) {
      ASSERT_TRUE(bodies.contains(body)) << "case " << i;
    }
    for (const Row& row : rows) {
      const bool is_sound = std::ranges::all_of(places.at(row.key), [&](const Span& span) {
        return std::memcmp(file.data() + span.begin, sound.data() + span.begin, span.end - span.begin) == 0;
      });
      const auto body = found.find(row.body);
      lost += is_sound ? 0 : 1;
      if (is_sound) {
        ASSERT_TRUE(body != found.end() && body->second.contains(row.key)) << "case " << i << ", row " << row.key;
      }
    }
  }
  EXPECT_GT(lost, static_cast<std::size_t>(count));
}

TEST(PageScan, FindsRowsOfLog) {
  const WorldFolder folder;
  std::mt19937 random(5);
  auto rows = rows_of(random, 60);
  Connection connection = opened(folder / "open");
  run(connection, "PRAGMA journal_mode=WAL");
  run(connection, "PRAGMA wal_autocheckpoint=0");
  run(connection, "CREATE TABLE chunks(key INTEGER PRIMARY KEY, body BLOB NOT NULL)");
  for (const Row& row : rows) put_row(connection, row);
  ASSERT_TRUE(connection.checkpoint().has_value());
  // The log rewrites rows of the file, some of them twice.
  for (int round = 2; round <= 3; ++round) {
    for (std::size_t i = 0; i < rows.size(); i += static_cast<std::size_t>(round)) {
      rows[i].body = body_of(random, static_cast<int>(i), static_cast<std::uint64_t>(round), 100 + random() % 20'000);
      put_row(connection, rows[i]);
    }
  }
  std::filesystem::copy_file(folder / "open", folder / "world");
  std::filesystem::copy_file(folder / "open-wal", folder / "world-wal");
  const auto found = found_in(folder / "world");
  for (const Row& row : rows) {
    ASSERT_TRUE(found.contains(row.body)) << row.key;
  }
}

TEST(PageScan, FindsRemovedRows) {
  const WorldFolder folder;
  std::mt19937 random(6);
  const auto path = folder / "world";
  const auto rows = rows_of(random, 60);
  make_database(path, 8'192, rows);
  {
    Connection connection = opened(path);
    run(connection, "PRAGMA secure_delete=OFF");
    run(connection, "DELETE FROM chunks");
  }
  EXPECT_GT(found_in(path).size(), 40U);
}

TEST(PageScan, FindsRecordsOfAnyColumns) {
  const WorldFolder folder;
  std::mt19937 random(7);
  const auto path = folder / "world";
  make_database(path, 1'024, rows_of(random, 20));
  Bytes large(20'000);
  for (std::byte& byte : large) byte = static_cast<std::byte>(random());
  {
    Connection connection = opened(path);
    auto statement = connection.prepare("INSERT INTO parts VALUES(?, ?, ?, ?)");
    ASSERT_TRUE(statement.has_value());
    const std::vector<std::int64_t> ids = {
        0, 1, -1, 127, -128, 40'000, 1 << 23, -(1LL << 40), 1LL << 47, -(1LL << 62), 0x7FFF'FFFF, 2};
    for (const std::int64_t id : ids) {
      statement->bind(0, "kind");
      statement->bind(1, id);
      statement->bind(3, std::span<const std::byte>(large).first(static_cast<std::size_t>(id & 0xFFF)));
      ASSERT_TRUE(statement->run().has_value());
    }
    run(connection, "INSERT INTO parts VALUES('real', 'a name', 0.5, NULL)");
    statement->bind(0, "large");
    statement->bind(1, 3);
    statement->bind(3, std::span<const std::byte>(large));
    ASSERT_TRUE(statement->run().has_value());
    Bytes file = file_of(path);
    std::fill_n(file.begin(), 1'024, std::byte{0});
    std::filesystem::remove(path);
    write(path, file);
    std::vector<std::vector<ColumnValue>> found;
    ASSERT_TRUE(scan_records(path, [&](const PageRecord& record) { found.push_back(record.columns); }).has_value());
    const auto has = [&](const std::vector<ColumnValue>& columns) { return std::ranges::count(found, columns) == 1; };
    for (const std::int64_t id : ids) {
      EXPECT_TRUE(has({std::string("kind"), id, std::monostate(), Bytes(large.begin(), large.begin() + (id & 0xFFF))}))
          << id;
    }
    EXPECT_TRUE(has({std::string("real"), std::string("a name"), 0.5, std::monostate()}));
    EXPECT_TRUE(has({std::string("large"), std::int64_t{3}, std::monostate(), large}));
  }
}

// Pages that point to themselves, and rows without a number that begin there.
TEST(PageScan, TerminatesOnCyclicPages) {
  constexpr std::size_t kPage = 512;
  constexpr std::size_t kPages = 2'048;
  const WorldFolder folder;
  Bytes file(kPage * kPages);
  std::memcpy(file.data(), "SQLite format 3\0\x02\0", 18);
  // A payload of 1,016,040 bytes, row 1, a record of NULL and a blob; the next page follows the 40 bytes stored here.
  constexpr std::array<std::uint8_t, 16> kCell = {0xBE, 0x81, 0x68, 0x01, 0x05, 0x00, 0xFC, 0x83,
                                                  0x52, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02};
  for (std::size_t at = 2 * kPage; at < file.size(); at += kCell.size()) std::memcpy(&file[at], kCell.data(), 16);
  file[kPage + 3] = std::byte{2};
  const auto path = folder / "world";
  write(path, file);
  std::size_t records = 0;
  const auto status = scan_records(path, [&](const PageRecord&) { ++records; });
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::LimitExceeded);
  EXPECT_GT(records, 10U);
  EXPECT_TRUE(found_in(path).empty());
}

// Uses the form of page_scan_fuzz: the first byte is the database's number of 256-byte blocks, followed by the database
// and its log.
TEST(PageScan, FindsBodiesInCorpus) {
  const WorldFolder folder;
  for (const char* const name : {"pages_of_512", "pages_of_1024"}) {
    const Bytes file = file_of(std::filesystem::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "page_scan" / name);
    ASSERT_GT(file.size(), 1U);
    const auto log = file.begin() + 1 + std::to_integer<std::ptrdiff_t>(file[0]) * 256;
    write(folder / "world", Bytes(file.begin() + 1, log));
    write(folder / "world-wal", Bytes(log, file.end()));
    const auto found = found_in(folder / "world");
    EXPECT_EQ(found.size(), 6U);
    for (const auto& [body, keys] : found) {
      EXPECT_FALSE(keys.contains(kLostKey)) << name;
    }
  }
}

TEST(PageScan, ReportsMissingFile) {
  const WorldFolder folder;
  const auto status = scan_bodies(folder / "none", [](std::int64_t, std::span<const std::byte>) {});
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::CannotRead);
  EXPECT_FALSE(scan_bodies(folder.path(), [](std::int64_t, std::span<const std::byte>) {}).has_value());
}

TEST(PageScan, SurvivesRandomFiles) {
  const WorldFolder folder;
  std::mt19937 random(8);
  for (int i = 0; i < 60; ++i) {
    Bytes file(random() % 40'000);
    for (std::byte& byte : file) byte = static_cast<std::byte>(i % 2 == 0 ? random() : random() % 8);
    write(folder / "world", file);
    write(folder / "world-wal", Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(file.size() / 3)));
    EXPECT_TRUE(found_in(folder / "world").empty());
    static_cast<void>(
        scan_records(folder / "world", [](const PageRecord& record) { EXPECT_GE(record.columns.size(), 2U); }));
  }
}

TEST(PageFileDeathTest, AssertsOnPageOutOfRange) {
  const WorldFolder folder;
  write(folder / "world", Bytes(8'192));
  const auto file = PageFile::open(folder / "world");
  ASSERT_TRUE(file.has_value());
  Bytes page(file->layout().page_size);
  QUOIN_EXPECT_MISTAKE(file->read(file->page_count(), page), "a page, and room for it");
}

}  // namespace
}  // namespace quoin::store
