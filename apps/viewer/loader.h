#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cpu_backend.h"
#include "document.h"

namespace quoin::viewer {

/// A document and its backend.
struct OpenDocument {
  std::unique_ptr<Document> document;
  std::unique_ptr<ViewBackend> backend;                                 // reads the document, so it is destroyed first
  std::shared_ptr<const FileRenderSettings> render_settings = nullptr;  // of the file, if any
  std::optional<Environment> environment = std::nullopt;                // of the file, if it stores more than the sun
};

/// Makes the backend of a loaded document, on the loading thread.
using MakeBackend = std::function<std::unique_ptr<ViewBackend>(const Document&)>;

/// Reads a file and builds its backend on a separate thread.
class Loader {
 public:
  /// The loading thread calls `on_done`, unless the loader is destroyed first.
  Loader(std::filesystem::path path, const LoadOptions& options, const WorldOptions& world, PackFallback fallback,
         MakeBackend make_backend, std::function<void()> on_done);
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;
  /// Cancels, and waits until the current model has been read. Keep a cancelled loader alive to avoid the wait.
  ~Loader();

  void cancel() { is_abandoned_ = true; }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool is_done() const { return is_done_; }
  /// Returns the current step, to show.
  [[nodiscard]] std::string stage() const { return is_read_ ? "building" : "reading"; }
  /// Returns the fraction of the file read, in [0, 1]; empty while it is unknown and while the backend is built.
  [[nodiscard]] std::optional<double> fraction() const;
  /// Returns the seconds since the start.
  [[nodiscard]] double seconds() const;
  /// Requires: is_done(), and the result has not been taken yet.
  [[nodiscard]] Result<OpenDocument> take();

 private:
  void work(const LoadOptions& options, const WorldOptions& world, PackFallback fallback,
            const MakeBackend& make_backend);

  std::filesystem::path path_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::atomic<double> fraction_{-1.0};
  std::atomic<bool> is_read_{false};
  std::atomic<bool> is_done_{false};
  std::atomic<bool> is_abandoned_{false};
  std::optional<Result<OpenDocument>> result_;
  std::thread thread_;
};

/// Opens resource packs and gives types their looks on a separate thread.
class PackLoader {
 public:
  /// `choice`: the setting that the packs are for. The thread calls `on_done` at the end.
  PackLoader(VoxelRegistry plain, std::vector<std::filesystem::path> packs, std::string choice,
             std::function<void()> on_done);
  PackLoader(const PackLoader&) = delete;
  PackLoader& operator=(const PackLoader&) = delete;
  /// Waits until the packs have been read.
  ~PackLoader();

  [[nodiscard]] const std::string& choice() const { return choice_; }
  [[nodiscard]] bool is_done() const { return is_done_; }
  /// Requires: is_done().
  [[nodiscard]] const Result<PackedTypes>& result() const { return *result_; }

 private:
  std::string choice_;
  std::optional<Result<PackedTypes>> result_;
  std::atomic<bool> is_done_{false};
  std::thread thread_;
};

/// Writes a document on a separate thread. The document must not be edited meanwhile.
class Saver {
 public:
  /// If saving would lose something and `accepts_unsupported` is false, writes nothing and reports it in `losses`.
  Saver(const Document& document, std::filesystem::path path, bool accepts_unsupported, std::function<void()> on_done);
  Saver(const Saver&) = delete;
  Saver& operator=(const Saver&) = delete;
  /// Cancels, and waits.
  ~Saver();

  void cancel() { is_cancelled_ = true; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool is_done() const { return is_done_; }
  [[nodiscard]] double fraction() const { return fraction_; }
  /// Returns the document's state that was written.
  [[nodiscard]] std::uint64_t state() const { return state_; }
  /// Requires: is_done().
  [[nodiscard]] const Status& status() const { return status_; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }
  /// Returns the losses that kept the document from being written, if any. Requires: is_done().
  [[nodiscard]] const std::vector<std::string>& losses() const { return losses_; }

 private:
  [[nodiscard]] Status work(const Document& document, bool accepts_unsupported);

  std::filesystem::path path_;
  std::uint64_t state_;
  std::atomic<double> fraction_{0.0};
  std::atomic<bool> is_done_{false};
  std::atomic<bool> is_cancelled_{false};
  Status status_;
  std::vector<std::string> warnings_;
  std::vector<std::string> losses_;
  std::thread thread_;
};

}  // namespace quoin::viewer
