#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "cpu_backend.h"
#include "document.h"

namespace quoin::viewer {

/// A document and what draws it.
struct OpenDocument {
  std::unique_ptr<Document> document;
  std::unique_ptr<ViewBackend> backend;            // goes before the document, which it reads
  std::shared_ptr<const FileLook> look = nullptr;  // how the file wants to be drawn, where it says it
};

/// Makes the backend of a document that was read, on the loading thread.
using MakeBackend = std::function<std::unique_ptr<ViewBackend>(const Document&)>;

/// Reads a file and builds what draws it, on a thread of its own.
class Loader {
 public:
  /// `on_done` is called from the loading thread, unless the loader is destroyed first.
  Loader(std::filesystem::path path, const LoadOptions& options, const WorldOptions& world, MakeBackend make_backend,
         std::function<void()> on_done);
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;
  /// Cancels, and waits for the end of the model that is being read; to stop looking at it sooner, keep the loader
  /// aside.
  ~Loader();

  void cancel() { is_abandoned_ = true; }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool is_done() const { return is_done_; }
  /// For people: what is being done now.
  [[nodiscard]] std::string stage() const { return is_read_ ? "building" : "reading"; }
  /// How much of the file has been read, 0 to 1; nothing while it is not known, and while there is building to do.
  [[nodiscard]] std::optional<double> fraction() const;
  /// Seconds since the beginning.
  [[nodiscard]] double seconds() const;
  /// Requires: is_done(), and it has not been taken yet.
  [[nodiscard]] Result<OpenDocument> take();

 private:
  void work(const LoadOptions& options, const WorldOptions& world, const MakeBackend& make_backend);

  std::filesystem::path path_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::atomic<double> fraction_{-1.0};
  std::atomic<bool> is_read_{false};
  std::atomic<bool> is_done_{false};
  std::atomic<bool> is_abandoned_{false};
  std::optional<Result<OpenDocument>> result_;
  std::thread thread_;
};

/// Writes a document on a thread of its own. The document must not be edited meanwhile.
class Saver {
 public:
  /// Where something would be lost and `accepts_losses` is false, nothing is written: `losses` tells.
  Saver(const Document& document, std::filesystem::path path, bool accepts_losses, std::function<void()> on_done);
  Saver(const Saver&) = delete;
  Saver& operator=(const Saver&) = delete;
  /// Cancels, and waits.
  ~Saver();

  void cancel() { is_cancelled_ = true; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool is_done() const { return is_done_; }
  [[nodiscard]] double fraction() const { return fraction_; }
  /// The document's state that was written.
  [[nodiscard]] std::uint64_t state() const { return state_; }
  /// Requires: is_done().
  [[nodiscard]] const Status& status() const { return status_; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }
  /// What saving would lose, where that was not accepted: then nothing was written. Requires: is_done().
  [[nodiscard]] const std::vector<std::string>& losses() const { return losses_; }

 private:
  [[nodiscard]] Status work(const Document& document, bool accepts_losses);

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
