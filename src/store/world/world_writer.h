#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/memory.h>
#include <quoin/core/parallel.h>

#include "core/database/connection.h"
#include "core/work/workers.h"
#include "store/chunk/chunk_body.h"
#include "store/world/world_changes.h"

namespace quoin::store {

/// Saves changes on its own thread; merges many saves into one commit while commits are slower than saves:
///
///   save -> queue -> group (merged) -> encoded, by key -> one transaction -> commit, synced -> acknowledged
///
/// The `pending_*` functions find changes that are not on disk yet. Threads: all functions may run on any thread.
class WorldWriter {
 public:
  using OnSaved = std::function<void(const Status&)>;

  /// `revision`: of the last commit. `connection` is the only writing connection.
  WorldWriter(Connection connection, std::uint64_t revision, Threads threads);
  WorldWriter(const WorldWriter&) = delete;
  WorldWriter& operator=(const WorldWriter&) = delete;
  /// Saves the queue if possible, and closes the connection.
  ~WorldWriter();

  /// If memory runs out, nothing is saved, and the changes are lost.
  SaveTicket save(ChangeSet changes, OnSaved on_saved);
  [[nodiscard]] Status wait(SaveTicket ticket);
  [[nodiscard]] Status flush();
  [[nodiscard]] WorldStats stats() const;

  /// Returns the chunk to be saved, or an inner nullopt if it is to be removed; nullopt if it has no pending change.
  [[nodiscard]] std::optional<std::optional<StoredChunk>> pending_chunk(const ChunkAddress& place) const;
  /// As `pending_chunk`.
  [[nodiscard]] std::optional<std::optional<PartContent>> pending_part(const PartKey& key) const;
  /// The pending changes to the chunks of a grid and level in a box: each chunk with true if it will exist, false if it
  /// is removed. With `is_removed` the grid's other chunks are removed.
  struct PendingChunks {
    bool is_removed = false;
    std::vector<std::pair<IVec3, bool>> chunks;
  };
  [[nodiscard]] PendingChunks pending_chunks(std::uint32_t grid, std::uint8_t level, const IBox& box) const;
  /// Returns the pending changes to the parts of a kind, in the order of their saves; nullopt for removed parts.
  [[nodiscard]] std::vector<std::pair<PartKey, std::optional<PartContent>>> pending_parts(std::string_view kind) const;

 private:
  struct Save {
    std::uint64_t last = 0;  ///< its ticket; for several saves the last ticket
    ChangeSet changes;
    std::vector<OnSaved> on_saved;
  };
  struct PendingChunk {
    std::optional<StoredChunk> content;
    std::uint64_t ticket = 0;
  };
  struct Encoded {
    std::int64_t key = 0;
    const ChunkAddress* place = nullptr;
    const StoredChunk* chunk = nullptr;  ///< null: the row is removed
    BlockVector<std::byte> body;
    Status outcome;
  };

  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock);
  /// Fills `group_`, unless no save waits, or the last commit failed and was not retried. Requires: the lock is held.
  void begin_group();
  /// Lets readers find the changes of a save. If memory runs out, nothing has changed.
  void note_pending(const ChangeSet& changes, std::uint64_t ticket);
  void finish(const Status& outcome);
  void roll_back();
  void forget_pending(const Save& group);

  // Runs on the writer's thread.
  [[nodiscard]] Status write(const ChangeSet& changes);
  [[nodiscard]] Status write_all(const ChangeSet& changes);
  [[nodiscard]] Status remove_grid(std::uint32_t number);
  [[nodiscard]] Status write_chunks(const ChangeSet& changes);
  [[nodiscard]] Status put_chunks(std::vector<Encoded>& chunks);
  [[nodiscard]] Status write_part(const PartKey& key, const std::optional<PartContent>& content);
  [[nodiscard]] Result<std::optional<std::int64_t>> region_for(const RegionPlace& place, bool may_add);
  [[nodiscard]] Result<Statement*> ready(const char* sql);

  Connection connection_;
  std::uint64_t revision_;
  bool needs_version_;
  Threads threads_;
  std::vector<ChunkEncoder> encoders_;
  std::map<const char*, Statement> statements_;
  std::map<RegionPlace, std::int64_t> regions_;
  /// Being saved: one save; a step that throws leaves it to the next. While it is written, its changes stay as they
  /// are: `pending_part` and `pending_parts` read them as well.
  std::list<Save> group_;
  std::uint64_t bytes_of_commit_ = 0;
  std::uint64_t chunks_of_commit_ = 0;

  mutable std::mutex mutex_;
  std::list<Save> queue_;
  ChunkMap<PendingChunk> pending_chunks_;
  std::map<std::uint32_t, std::uint64_t> pending_removed_;  // grids, with their tickets
  std::uint64_t last_ticket_ = 0;
  std::uint64_t saved_through_ = 0;
  std::uint64_t failed_through_ = 0;
  Status failure_;
  WorldStats stats_;

  Workers thread_{mutex_};
};

}  // namespace quoin::store
