#pragma once

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <sqlite3.h>

// An in-memory disk, as an SQLite file system, that knows the possible contents after a power cut: all synced data, and
// any subset of later writes, in any order, with torn sectors.
//
//   file      content now | content at the last sync | operations since
//   folder    names now   | names at the last sync
//
// Like SQLite's own file system, it syncs the folder at the first sync of a new file, and at a deletion with the sync
// flag. Shared memory belongs to the running machine and does not survive. Overwriting a sector leaves other sectors
// unchanged (POWERSAFE_OVERWRITE).

namespace quoin {

class TestDisk {
 public:
  static constexpr std::size_t kSector = 512;
  using Bytes = std::vector<std::uint8_t>;

  /// The state that a power cut leaves, before random choices.
  struct Image {
    struct Step {
      std::size_t offset = 0;
      Bytes bytes;        ///< of a write
      bool cuts = false;  ///< a truncation to `offset`
    };
    struct Content {
      Bytes synced;
      std::vector<Step> since;
    };
    std::map<std::string, Content> synced_names;
    std::map<std::string, Content> names;
  };

  explicit TestDisk(std::string name) : name_(std::move(name)) {
    vfs_.iVersion = 1;
    vfs_.szOsFile = sizeof(Handle);
    vfs_.mxPathname = 512;
    vfs_.zName = name_.c_str();
    vfs_.pAppData = this;
    vfs_.xOpen = open;
    vfs_.xDelete = remove;
    vfs_.xAccess = access;
    vfs_.xFullPathname = [](sqlite3_vfs*, const char* path, int size, char* out) {
      return sqlite3_snprintf(size, out, "%s", path) != nullptr ? SQLITE_OK : SQLITE_ERROR;
    };
    vfs_.xRandomness = [](sqlite3_vfs*, int count, char* out) {
      static std::minstd_rand random(7);
      for (int i = 0; i < count; ++i) out[i] = static_cast<char>(random());
      return count;
    };
    vfs_.xSleep = [](sqlite3_vfs*, int microseconds) { return microseconds; };
    vfs_.xCurrentTime = [](sqlite3_vfs*, double* time) {
      *time = 2461000.0;
      return SQLITE_OK;
    };
    vfs_.xGetLastError = [](sqlite3_vfs*, int, char*) { return 0; };
    sqlite3_vfs_register(&vfs_, 0);
  }
  TestDisk(const TestDisk&) = delete;
  TestDisk& operator=(const TestDisk&) = delete;
  ~TestDisk() { sqlite3_vfs_unregister(&vfs_); }

  [[nodiscard]] const char* name() const { return name_.c_str(); }
  /// Called before everything that changes the disk, with the disk as it is then.
  std::function<void()> before_change;
  /// Returns the result code of a call: SQLITE_OK, SQLITE_FULL, SQLITE_IOERR_WRITE ... `what`: "write", "sync",
  /// "truncate", "delete", "open", "read".
  std::function<int(const char* what)> fault;
  /// Returns true if a sync of the file really writes its data.
  std::function<bool(const std::string& file)> is_sync_honest;

  [[nodiscard]] Image image() {
    const std::scoped_lock lock(mutex_);
    Image image;
    const auto copy = [](const auto& names, auto& out) {
      for (const auto& [name, file] : names) out[name] = {file->synced, file->since};
    };
    copy(synced_names_, image.synced_names);
    copy(names_, image.names);
    return image;
  }

  /// Sets the content to a possible state after a power cut.
  void become(const Image& image, std::minstd_rand& random) {
    const std::scoped_lock lock(mutex_);
    names_.clear();
    synced_names_.clear();
    // Folder entries are written separately: each name may or may not be updated yet.
    const unsigned folder = random() % 3;
    const auto chosen = [&] { return folder == 0 ? false : folder == 1 ? true : random() % 2 == 0; };
    std::map<std::string, const Image::Content*> kept;
    for (const auto& [name, content] : image.synced_names) {
      if (image.names.contains(name) || !chosen()) kept[name] = &content;
    }
    for (const auto& [name, content] : image.names) {
      if (kept.contains(name) || chosen()) kept[name] = &content;
    }
    for (const auto& [name, content] : kept) {
      auto file = std::make_shared<File>();
      file->content = left_of(*content, random);
      file->synced = file->content;
      names_[name] = file;
    }
    synced_names_ = names_;
  }

  [[nodiscard]] std::size_t bytes_of(const std::string& name) {
    const std::scoped_lock lock(mutex_);
    const auto found = names_.find(name);
    return found == names_.end() ? 0 : found->second->content.size();
  }
  /// To damage it.
  [[nodiscard]] Bytes* impl_of(const std::string& name) {
    const auto found = names_.find(name);
    return found == names_.end() ? nullptr : &found->second->content;
  }

 private:
  struct Handle;
  struct File {
    Bytes content;
    Bytes synced;
    std::vector<Image::Step> since;
    bool is_named_for_ever = false;  // the folder was synced since it was made
    int shared = 0;
    Handle* reserved = nullptr;
    Handle* exclusive = nullptr;  // or about to be
    std::vector<std::unique_ptr<std::array<std::uint8_t, 32768>>> memory;
    std::array<int, SQLITE_SHM_NLOCK> memory_shared{};
    std::array<Handle*, SQLITE_SHM_NLOCK> memory_exclusive{};
  };
  struct Handle {
    sqlite3_file base;
    TestDisk* disk;
    File* file;
    std::shared_ptr<File>* owner;
    std::string* name;
    int level;
    unsigned memory_shared;
    bool is_deleted_on_close;
  };

  static TestDisk& of(sqlite3_vfs* vfs) { return *static_cast<TestDisk*>(vfs->pAppData); }
  static Handle& of(sqlite3_file* file) { return *reinterpret_cast<Handle*>(file); }

  static Bytes left_of(const Image::Content& content, std::minstd_rand& random) {
    Bytes bytes = content.synced;
    const unsigned mode = random() % 4;  // none, all, each by chance, all up to a moment
    const std::size_t moment = content.since.empty() ? 0 : random() % (content.since.size() + 1);
    for (std::size_t i = 0; i < content.since.size(); ++i) {
      const Image::Step& step = content.since[i];
      const auto chosen = [&] { return mode == 1 || (mode == 2 && random() % 2 == 0) || (mode == 3 && i < moment); };
      if (step.cuts) {
        if (chosen()) bytes.resize(step.offset);
        continue;
      }
      for (std::size_t begin = 0; begin < step.bytes.size();) {
        const std::size_t room = kSector - (step.offset + begin) % kSector;
        std::size_t count = std::min(room, step.bytes.size() - begin);
        const std::size_t next = begin + count;
        if (chosen()) {
          if (mode == 2 && random() % 8 == 0) count = random() % (count + 1);  // torn
          const std::size_t end = step.offset + begin + count;
          if (bytes.size() < end) bytes.resize(end);
          std::memcpy(bytes.data() + step.offset + begin, step.bytes.data() + begin, count);
        }
        begin = next;
      }
    }
    return bytes;
  }

  int failure(const char* what) const { return fault ? fault(what) : SQLITE_OK; }
  void will_change() const {
    if (before_change) before_change();
  }

  static int open(sqlite3_vfs* vfs, const char* path, sqlite3_file* out, int flags, int* out_flags) {
    TestDisk& disk = of(vfs);
    Handle& handle = of(out);
    handle.base.pMethods = nullptr;
    if (const int code = disk.failure("open"); code != SQLITE_OK) return SQLITE_CANTOPEN;
    const std::scoped_lock lock(disk.mutex_);
    const std::string name = path != nullptr ? path : "temporary " + std::to_string(disk.temporary_++);
    auto found = disk.names_.find(name);
    if (found == disk.names_.end()) {
      if ((flags & SQLITE_OPEN_CREATE) == 0) return SQLITE_CANTOPEN;
      found = disk.names_.emplace(name, std::make_shared<File>()).first;
    }
    handle.disk = &disk;
    handle.owner = new std::shared_ptr<File>(found->second);
    handle.file = found->second.get();
    handle.name = new std::string(name);
    handle.level = SQLITE_LOCK_NONE;
    handle.memory_shared = 0;
    handle.is_deleted_on_close = (flags & SQLITE_OPEN_DELETEONCLOSE) != 0;
    handle.base.pMethods = &methods();
    if (out_flags != nullptr) *out_flags = flags;
    return SQLITE_OK;
  }

  static int remove(sqlite3_vfs* vfs, const char* path, int syncs_folder) {
    TestDisk& disk = of(vfs);
    disk.will_change();
    if (const int code = disk.failure("delete"); code != SQLITE_OK) return SQLITE_IOERR_DELETE;
    const std::scoped_lock lock(disk.mutex_);
    if (disk.names_.erase(path) == 0) return SQLITE_IOERR_DELETE_NOENT;
    if (syncs_folder != 0) disk.sync_folder();
    return SQLITE_OK;
  }

  static int access(sqlite3_vfs* vfs, const char* path, int, int* out) {
    TestDisk& disk = of(vfs);
    const std::scoped_lock lock(disk.mutex_);
    const auto found = disk.names_.find(path);
    *out = found != disk.names_.end() && !found->second->content.empty() ? 1 : 0;
    return SQLITE_OK;
  }

  void sync_folder() {
    synced_names_ = names_;
    for (auto& [name, file] : names_) file->is_named_for_ever = true;
  }

  static int close(sqlite3_file* base) {
    Handle& handle = of(base);
    TestDisk& disk = *handle.disk;
    const std::scoped_lock lock(disk.mutex_);
    disk.set_level(handle, SQLITE_LOCK_NONE);
    disk.release_memory(handle);
    if (handle.is_deleted_on_close) disk.names_.erase(*handle.name);
    delete handle.owner;
    delete handle.name;
    return SQLITE_OK;
  }

  static int read(sqlite3_file* base, void* out, int count, sqlite3_int64 offset) {
    Handle& handle = of(base);
    if (handle.disk->failure("read") != SQLITE_OK) return SQLITE_IOERR_READ;
    const std::scoped_lock lock(handle.disk->mutex_);
    const Bytes& content = handle.file->content;
    const auto begin = std::min(static_cast<std::size_t>(offset), content.size());
    const std::size_t there = std::min(content.size() - begin, static_cast<std::size_t>(count));
    if (there != 0) std::memcpy(out, content.data() + begin, there);
    if (there == static_cast<std::size_t>(count)) return SQLITE_OK;
    std::memset(static_cast<char*>(out) + there, 0, static_cast<std::size_t>(count) - there);
    return SQLITE_IOERR_SHORT_READ;
  }

  static int write(sqlite3_file* base, const void* data, int count, sqlite3_int64 offset) {
    Handle& handle = of(base);
    handle.disk->will_change();
    if (const int code = handle.disk->failure("write"); code != SQLITE_OK) return code;
    const std::scoped_lock lock(handle.disk->mutex_);
    const auto* const bytes = static_cast<const std::uint8_t*>(data);
    const auto size = static_cast<std::size_t>(count);
    const auto begin = static_cast<std::size_t>(offset);
    Bytes& content = handle.file->content;
    if (content.size() < begin + size) content.resize(begin + size);
    std::memcpy(content.data() + begin, bytes, size);
    handle.file->since.push_back({begin, Bytes(bytes, bytes + size), false});
    return SQLITE_OK;
  }

  static int truncate(sqlite3_file* base, sqlite3_int64 size) {
    Handle& handle = of(base);
    handle.disk->will_change();
    if (const int code = handle.disk->failure("truncate"); code != SQLITE_OK) return SQLITE_IOERR_TRUNCATE;
    const std::scoped_lock lock(handle.disk->mutex_);
    handle.file->content.resize(static_cast<std::size_t>(size));
    handle.file->since.push_back({static_cast<std::size_t>(size), {}, true});
    return SQLITE_OK;
  }

  static int sync(sqlite3_file* base, int) {
    Handle& handle = of(base);
    TestDisk& disk = *handle.disk;
    disk.will_change();
    if (disk.failure("sync") != SQLITE_OK) return SQLITE_IOERR_FSYNC;
    const std::scoped_lock lock(disk.mutex_);
    if (disk.is_sync_honest && !disk.is_sync_honest(*handle.name)) return SQLITE_OK;
    handle.file->synced = handle.file->content;
    handle.file->since.clear();
    if (!handle.file->is_named_for_ever) disk.sync_folder();
    return SQLITE_OK;
  }

  static int file_size(sqlite3_file* base, sqlite3_int64* out) {
    Handle& handle = of(base);
    const std::scoped_lock lock(handle.disk->mutex_);
    *out = static_cast<sqlite3_int64>(handle.file->content.size());
    return SQLITE_OK;
  }

  void set_level(Handle& handle, int level) {
    File& file = *handle.file;
    if (level < SQLITE_LOCK_EXCLUSIVE && file.exclusive == &handle) file.exclusive = nullptr;
    if (level < SQLITE_LOCK_RESERVED && file.reserved == &handle) file.reserved = nullptr;
    if (level < SQLITE_LOCK_SHARED && handle.level >= SQLITE_LOCK_SHARED) --file.shared;
    handle.level = std::min(handle.level, level);
  }

  static int lock(sqlite3_file* base, int level) {
    Handle& handle = of(base);
    const std::scoped_lock guard(handle.disk->mutex_);
    File& file = *handle.file;
    if (handle.level >= level) return SQLITE_OK;
    const bool is_others = file.exclusive != nullptr && file.exclusive != &handle;
    if (level == SQLITE_LOCK_SHARED) {
      if (is_others) return SQLITE_BUSY;
      ++file.shared;
    } else if (level == SQLITE_LOCK_RESERVED) {
      if (is_others || (file.reserved != nullptr && file.reserved != &handle)) return SQLITE_BUSY;
      file.reserved = &handle;
    } else {
      if (is_others) return SQLITE_BUSY;
      file.exclusive = &handle;  // pending from here on
      if (file.shared > 1) return SQLITE_BUSY;
    }
    handle.level = level;
    return SQLITE_OK;
  }

  static int unlock(sqlite3_file* base, int level) {
    Handle& handle = of(base);
    const std::scoped_lock guard(handle.disk->mutex_);
    handle.disk->set_level(handle, level);
    return SQLITE_OK;
  }

  static int check_reserved(sqlite3_file* base, int* out) {
    Handle& handle = of(base);
    const std::scoped_lock guard(handle.disk->mutex_);
    *out = handle.file->reserved != nullptr ? 1 : 0;
    return SQLITE_OK;
  }

  static int map_memory(sqlite3_file* base, int page, int size, int extends, void volatile** out) {
    Handle& handle = of(base);
    const std::scoped_lock guard(handle.disk->mutex_);
    auto& memory = handle.file->memory;
    *out = nullptr;
    if (size > 32768) return SQLITE_IOERR_SHMMAP;
    while (memory.size() <= static_cast<std::size_t>(page) && extends != 0) {
      memory.push_back(std::make_unique<std::array<std::uint8_t, 32768>>());
    }
    if (memory.size() > static_cast<std::size_t>(page)) *out = memory[static_cast<std::size_t>(page)]->data();
    return SQLITE_OK;
  }

  static int lock_memory(sqlite3_file* base, int first, int count, int flags) {
    Handle& handle = of(base);
    const std::scoped_lock guard(handle.disk->mutex_);
    File& file = *handle.file;
    const auto each = [&](auto action) {
      for (int i = first; i < first + count; ++i) action(static_cast<std::size_t>(i), 1U << i);
    };
    bool is_free = true;
    if ((flags & SQLITE_SHM_UNLOCK) != 0) {
      each([&](std::size_t i, unsigned bit) {
        if (file.memory_exclusive[i] == &handle) file.memory_exclusive[i] = nullptr;
        if ((handle.memory_shared & bit) != 0) --file.memory_shared[i];
        handle.memory_shared &= ~bit;
      });
      return SQLITE_OK;
    }
    const bool is_shared = (flags & SQLITE_SHM_SHARED) != 0;
    each([&](std::size_t i, unsigned bit) {
      const int others = file.memory_shared[i] - ((handle.memory_shared & bit) != 0 ? 1 : 0);
      is_free = is_free && (file.memory_exclusive[i] == nullptr || file.memory_exclusive[i] == &handle) &&
                (is_shared || others == 0);
    });
    if (!is_free) return SQLITE_BUSY;
    each([&](std::size_t i, unsigned bit) {
      if (!is_shared) {
        file.memory_exclusive[i] = &handle;
      } else if ((handle.memory_shared & bit) == 0) {
        ++file.memory_shared[i];
        handle.memory_shared |= bit;
      }
    });
    return SQLITE_OK;
  }

  void release_memory(Handle& handle) {
    File& file = *handle.file;
    for (std::size_t i = 0; i < file.memory_shared.size(); ++i) {
      if (file.memory_exclusive[i] == &handle) file.memory_exclusive[i] = nullptr;
      if ((handle.memory_shared >> i & 1U) != 0) --file.memory_shared[i];
    }
    handle.memory_shared = 0;
  }

  static int unmap_memory(sqlite3_file* base, int deletes) {
    Handle& handle = of(base);
    const std::scoped_lock guard(handle.disk->mutex_);
    handle.disk->release_memory(handle);
    if (deletes != 0) handle.file->memory.clear();
    return SQLITE_OK;
  }

  static const sqlite3_io_methods& methods() {
    static const sqlite3_io_methods all = [] {
      sqlite3_io_methods m{};
      m.iVersion = 2;
      m.xClose = close;
      m.xRead = read;
      m.xWrite = write;
      m.xTruncate = truncate;
      m.xSync = sync;
      m.xFileSize = file_size;
      m.xLock = lock;
      m.xUnlock = unlock;
      m.xCheckReservedLock = check_reserved;
      m.xFileControl = [](sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; };
      m.xSectorSize = [](sqlite3_file*) { return static_cast<int>(kSector); };
      m.xDeviceCharacteristics = [](sqlite3_file*) { return SQLITE_IOCAP_POWERSAFE_OVERWRITE; };
      m.xShmMap = map_memory;
      m.xShmLock = lock_memory;
      m.xShmBarrier = [](sqlite3_file*) {};
      m.xShmUnmap = unmap_memory;
      return m;
    }();
    return all;
  }

  std::string name_;
  sqlite3_vfs vfs_{};
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<File>> names_;
  std::map<std::string, std::shared_ptr<File>> synced_names_;
  int temporary_ = 0;
};

/// Lets writes of SQLite's own file system fail as on a full disk, for all files of the process. Lifetime: outlives all
/// connections.
class FullDisk {
 public:
  FullDisk() {
    is_full() = false;
    for (const auto& [name, call] : calls()) vfs()->xSetSystemCall(vfs(), name, call);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    for (const auto& [name, call] : calls()) vfs()->xSetSystemCall(vfs(), name, nullptr);
  }
  void set_full(bool is) { is_full() = is; }
  /// Returns the number of writes that failed.
  [[nodiscard]] int failures() const { return failed(); }

 private:
  static sqlite3_vfs* vfs() { return sqlite3_vfs_find(nullptr); }
  static std::atomic<bool>& is_full() {
    static std::atomic<bool> is{false};
    return is;
  }
  static std::atomic<int>& failed() {
    static std::atomic<int> count{0};
    return count;
  }
  static bool fails() {
    if (!is_full()) return false;
    ++failed();
    errno = ENOSPC;
    return true;
  }
  static ssize_t write(int file, const void* bytes, std::size_t count) {
    return fails() ? -1 : ::write(file, bytes, count);
  }
  static ssize_t write_at(int file, const void* bytes, std::size_t count, off_t at) {
    return fails() ? -1 : ::pwrite(file, bytes, count, at);
  }
  static std::array<std::pair<const char*, sqlite3_syscall_ptr>, 3> calls() {
    const auto call = [](auto* function) { return reinterpret_cast<sqlite3_syscall_ptr>(function); };
    return {{{"write", call(write)}, {"pwrite", call(write_at)}, {"pwrite64", call(write_at)}}};
  }
};

}  // namespace quoin
