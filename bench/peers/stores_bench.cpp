// store/* with other stores: LMDB, and SQLite in Luanti's schema (three coordinate columns, its own pragmas except for
// synchronous, which is FULL in both). All store Quoin's chunk bodies, which the loop encodes and decodes, so that only
// the store differs.

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <lmdb.h>
#include <sqlite3.h>

#include "store/chunk/chunk_body.h"
#include "store/world/terrain_chunks_for_tests.h"
#include "store/world/world_for_tests.h"

namespace quoin::peers {
namespace {

using Bytes = BlockVector<std::byte>;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "store benchmark: %s\n", what);
  std::exit(1);
}

const TerrainChunks& terrain() {
  static const TerrainChunks chunks(40);
  return chunks;
}

// LMDB sorts keys as bytes; 21 bits per coordinate are enough here.
std::array<unsigned char, 8> key_of(IVec3 chunk) {
  std::uint64_t number = 0;
  for (int axis = 2; axis >= 0; --axis) number = number << 21 | static_cast<std::uint32_t>(chunk[axis] + (1 << 20));
  std::array<unsigned char, 8> key{};
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<unsigned char>(number >> (56 - 8 * i));
  return key;
}

class Lmdb {
 public:
  explicit Lmdb(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    require(mdb_env_create(&environment_) == 0 && mdb_env_set_mapsize(environment_, std::size_t{1} << 30) == 0 &&
                mdb_env_open(environment_, folder.c_str(), 0, 0664) == 0,
            "LMDB does not open");
    MDB_txn* transaction = nullptr;
    require(mdb_txn_begin(environment_, nullptr, 0, &transaction) == 0 &&
                mdb_dbi_open(transaction, nullptr, 0, &table_) == 0 && mdb_txn_commit(transaction) == 0,
            "LMDB does not open its table");
  }
  Lmdb(const Lmdb&) = delete;
  Lmdb& operator=(const Lmdb&) = delete;
  ~Lmdb() { mdb_env_close(environment_); }

  void begin() { require(mdb_txn_begin(environment_, nullptr, 0, &transaction_) == 0, "LMDB begins nothing"); }
  void put(IVec3 chunk, const Bytes& body) {
    auto key = key_of(chunk);
    MDB_val k{key.size(), key.data()};
    MDB_val v{body.size(), const_cast<std::byte*>(body.data())};
    require(mdb_put(transaction_, table_, &k, &v, 0) == 0, "LMDB puts nothing");
  }
  void commit() { require(mdb_txn_commit(transaction_) == 0, "LMDB commits nothing"); }
  template <class Read>
  void get(IVec3 chunk, Read read) {
    MDB_txn* transaction = nullptr;
    require(mdb_txn_begin(environment_, nullptr, MDB_RDONLY, &transaction) == 0, "LMDB begins nothing");
    auto key = key_of(chunk);
    MDB_val k{key.size(), key.data()};
    MDB_val v{};
    require(mdb_get(transaction, table_, &k, &v) == 0, "LMDB gets nothing");
    read(std::span(static_cast<const std::byte*>(v.mv_data), v.mv_size));
    mdb_txn_abort(transaction);
  }

 private:
  MDB_env* environment_ = nullptr;
  MDB_dbi table_ = 0;
  MDB_txn* transaction_ = nullptr;
};

class Luanti {
 public:
  explicit Luanti(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    require(sqlite3_open((folder / "map.sqlite").c_str(), &database_) == SQLITE_OK, "SQLite does not open");
    run("PRAGMA synchronous = 2");
    run("CREATE TABLE blocks (x INTEGER, y INTEGER, z INTEGER, data BLOB NOT NULL, PRIMARY KEY (x, z, y))");
    put_ = prepare("REPLACE INTO blocks (x, y, z, data) VALUES (?, ?, ?, ?)");
    get_ = prepare("SELECT data FROM blocks WHERE x = ? AND y = ? AND z = ? LIMIT 1");
  }
  Luanti(const Luanti&) = delete;
  Luanti& operator=(const Luanti&) = delete;
  ~Luanti() {
    sqlite3_finalize(put_);
    sqlite3_finalize(get_);
    sqlite3_close(database_);
  }

  void begin() { run("BEGIN"); }
  void put(IVec3 chunk, const Bytes& body) {
    for (int axis = 0; axis < 3; ++axis) sqlite3_bind_int(put_, axis + 1, chunk[axis]);
    sqlite3_bind_blob(put_, 4, body.data(), static_cast<int>(body.size()), SQLITE_STATIC);
    require(sqlite3_step(put_) == SQLITE_DONE, "SQLite puts nothing");
    sqlite3_reset(put_);
  }
  void commit() { run("COMMIT"); }
  template <class Read>
  void get(IVec3 chunk, Read read) {
    for (int axis = 0; axis < 3; ++axis) sqlite3_bind_int(get_, axis + 1, chunk[axis]);
    require(sqlite3_step(get_) == SQLITE_ROW, "SQLite gets nothing");
    const auto* const data = static_cast<const std::byte*>(sqlite3_column_blob(get_, 0));
    read(std::span(data, static_cast<std::size_t>(sqlite3_column_bytes(get_, 0))));
    sqlite3_reset(get_);
  }

 private:
  void run(const char* sql) {
    require(sqlite3_exec(database_, sql, nullptr, nullptr, nullptr) == SQLITE_OK, "SQLite runs nothing");
  }
  sqlite3_stmt* prepare(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    require(sqlite3_prepare_v2(database_, sql, -1, &statement, nullptr) == SQLITE_OK, "SQLite prepares nothing");
    return statement;
  }

  sqlite3* database_ = nullptr;
  sqlite3_stmt* put_ = nullptr;
  sqlite3_stmt* get_ = nullptr;
};

template <class Store>
void save_all(Store& store, std::size_t group) {
  store::ChunkEncoder encoder;
  Bytes body;
  for (std::size_t begin = 0; begin < terrain().chunks.size(); begin += group) {
    store.begin();
    for (std::size_t i = begin; i < std::min(begin + group, terrain().chunks.size()); ++i) {
      require(encoder.encode(terrain().places[i], 1, terrain().chunks[i].voxels, nullptr, body).has_value(),
              "a chunk is not encoded");
      store.put(terrain().places[i].chunk, body);
    }
    store.commit();
  }
}

void count(benchmark::State& state) {
  state.counters["chunks_per_second"] =
      benchmark::Counter(static_cast<double>(terrain().chunks.size()), benchmark::Counter::kIsIterationInvariantRate);
}

template <class Store>
void save_new(benchmark::State& state) {
  const WorldFolder folder;
  int number = 0;
  std::optional<Store> store;
  for (auto _ : state) {
    state.PauseTiming();
    store.emplace(folder.path() / std::to_string(number++));
    state.ResumeTiming();
    save_all(*store, 64);
  }
  count(state);
}

template <class Store>
void load(benchmark::State& state) {
  const WorldFolder folder;
  Store store(folder.path() / "w");
  save_all(store, 64);
  std::vector<std::size_t> order(terrain().chunks.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::minstd_rand random(3);
  std::shuffle(order.begin(), order.end(), random);
  store::ChunkDecoder decoder;
  const store::ChunkLimits limits{&terrain().types, 8.0F};
  for (auto _ : state) {
    for (const std::size_t i : order) {
      store.get(terrain().places[i].chunk, [&](std::span<const std::byte> body) {
        const auto chunk = decoder.decode(terrain().places[i], body, limits);
        require(chunk && chunk->voxels.data_count() == 0, "a chunk is lost");
        benchmark::DoNotOptimize(chunk);
      });
    }
  }
  count(state);
}

BENCHMARK(save_new<Lmdb>)->Name("peer/lmdb/store/save/new")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(load<Lmdb>)->Name("peer/lmdb/store/load")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(save_new<Luanti>)->Name("peer/luanti/store/save/new")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(load<Luanti>)->Name("peer/luanti/store/load")->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace quoin::peers
