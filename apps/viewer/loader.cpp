#include "loader.h"

#include <chrono>
#include <new>
#include <utility>

namespace quoin::viewer {

namespace {

Error out_of_memory(const std::filesystem::path& path) {
  return {ErrorCode::LimitExceeded, "out of memory", path.string(), std::nullopt};
}

}  // namespace

Loader::Loader(std::filesystem::path path, const LoadOptions& options, const WorldOptions& world, PackFallback fallback,
               MakeBackend make_backend, std::function<void()> on_done)
    : path_(std::move(path)) {
  thread_ = std::thread([this, options, world, fallback, make = std::move(make_backend), done = std::move(on_done)] {
    yield_to_window();
    try {
      work(options, world, fallback, make);
    } catch (const std::bad_alloc&) {
      result_ = out_of_memory(path_);
    }
    is_done_ = true;
    if (!is_abandoned_ && done) done();
  });
}

Loader::~Loader() {
  is_abandoned_ = true;
  thread_.join();
}

void Loader::work(const LoadOptions& options, const WorldOptions& world, PackFallback fallback,
                  const MakeBackend& make_backend) {
  const auto report = [this](double share) {
    fraction_ = share;
    return !is_abandoned_;
  };
  auto document = Document::open(path_, options, report, world, fallback);
  if (!document) {
    result_ = document.error();
    return;
  }
  is_read_ = true;
  if (is_abandoned_) {
    result_ = make_error(ErrorCode::Cancelled, "cancelled", path_.string());
    return;
  }
  OpenDocument opened;
  opened.document = std::move(*document);
  opened.backend = make_backend(*opened.document);
  result_ = std::move(opened);
}

std::optional<double> Loader::fraction() const {
  const double share = fraction_;
  return share < 0.0 || is_read_ ? std::nullopt : std::optional(share);
}

double Loader::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

Result<OpenDocument> Loader::take() {
  Result<OpenDocument> taken = std::move(*result_);
  result_.reset();
  return taken;
}

PackLoader::PackLoader(VoxelRegistry plain, std::vector<std::filesystem::path> packs, std::string choice,
                       std::function<void()> on_done)
    : choice_(std::move(choice)) {
  thread_ =
      std::thread([this, types = std::move(plain), named = std::move(packs), done = std::move(on_done)]() mutable {
        yield_to_window();
        try {
          result_ = packed_types(std::move(types), named);
        } catch (const std::bad_alloc&) {
          result_ = out_of_memory(named.empty() ? std::filesystem::path() : named.front());
        }
        is_done_ = true;
        if (done) done();
      });
}

PackLoader::~PackLoader() {
  thread_.join();
}

Saver::Saver(const Document& document, std::filesystem::path path, bool accepts_unsupported,
             std::function<void()> on_done)
    : path_(std::move(path)), state_(document.history().state()) {
  thread_ = std::thread([this, &document, accepts_unsupported, done = std::move(on_done)] {
    yield_to_window();
    try {
      status_ = work(document, accepts_unsupported);
    } catch (const std::bad_alloc&) {
      status_ = out_of_memory(path_);
    }
    is_done_ = true;
    if (done) done();
  });
}

Status Saver::work(const Document& document, bool accepts_unsupported) {
  if (!accepts_unsupported) {
    auto losses = document.losses(path_);
    if (!losses) return losses.error();
    losses_ = std::move(*losses);
    if (!losses_.empty()) return {};
  }
  return document.write(path_, warnings_, [this](double fraction) {
    fraction_ = fraction;
    return !is_cancelled_;
  });
}

Saver::~Saver() {
  is_cancelled_ = true;
  thread_.join();
}

}  // namespace quoin::viewer
