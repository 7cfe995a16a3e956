#include "stream/stream_budget.h"

#include <algorithm>
#include <cmath>

#include <quoin/core/assert.h>

namespace quoin::stream {
namespace {

// Assumed bytes per chunk before any is loaded.
constexpr double kGuessedChunkBytes = 24.0 * 1024.0;
constexpr std::size_t kGuessBelow = 64;
constexpr std::size_t kLeastChunks = 8;
// Largest growth from one plan to the next. No growth while many chunks are missing, whose size is unknown.
constexpr double kGrows = 1.1;
constexpr double kMostMissing = 0.25;
// Bytes derived per chunk byte before any measurement: meshes of smooth ground take more, of blocks less.
constexpr double kGuessedRatio = 1.5;
// Seconds in which new measurements replace two thirds of the estimate. The estimate falls more slowly than it rises.
constexpr double kRises = 3.0;
constexpr double kFalls = 8.0;
// Share of the budget to plan for. The rest covers uncounted memory (journals, plans, worker and store caches) and
// allocator fragmentation: 10 % on average in half-hour flights, 12.5 % at most.
constexpr double kShareOfBudget = 0.86;

}  // namespace

StreamBudget::StreamBudget(std::size_t bytes, bool has_others)
    : budget_(bytes), ratio_(has_others ? kGuessedRatio : 0.0) {}

void StreamBudget::set_others(std::size_t reported, std::size_t pending, bool is_quiet, Clock::time_point now) {
  const double seconds = is_reported_ ? std::chrono::duration<double>(now - announced_).count() : 0.0;
  const bool is_other = !is_reported_ || reported != reported_;
  if (!is_reported_ || chunks_ == 0) {
    fixed_ = reported;
  } else {
    fixed_ = std::min(fixed_, reported);
  }
  if (is_reported_ && (is_other || is_quiet) && chunks_ >= kGuessBelow) {
    const double found =
        static_cast<double>(reported - fixed_) / static_cast<double>(std::max(chunk_bytes_, std::size_t{1}));
    ratio_ += (found - ratio_) * (1.0 - std::exp(-seconds / (found > ratio_ ? kRises : kFalls)));
  }
  reported_ = reported;
  pending_ = pending;
  announced_ = now;
  is_reported_ = true;
}

double StreamBudget::limit() const {
  return static_cast<double>(budget_) * kShareOfBudget;
}

double StreamBudget::used() const {
  return static_cast<double>(chunk_bytes_ + arrived_bytes_ + reported_ + pending_);
}

double StreamBudget::expected() const {
  const double made = (1.0 + ratio_) * static_cast<double>(chunk_bytes_ + arrived_bytes_);
  return std::max(used(), made + static_cast<double>(fixed_ + pending_));
}

std::int64_t StreamBudget::guess() const {
  const double mean = chunks_ == 0 ? 0.0 : static_cast<double>(chunk_bytes_) / static_cast<double>(chunks_);
  return static_cast<std::int64_t>(std::max(mean, kGuessedChunkBytes));
}

std::int64_t StreamBudget::room(std::size_t begun) const {
  return static_cast<std::int64_t>((limit() - expected()) / (1.0 + ratio_)) -
         guess() * static_cast<std::int64_t>(begun);
}

// Near chunks take more bytes than far ones. If the budget limits the plan, the count is found step by step: it shrinks
// at once and grows when nearly all wanted chunks are loaded.
std::size_t StreamBudget::chunks(std::size_t planned, bool is_cut, double missing) const {
  QUOIN_ASSERT(missing >= 0.0 && missing <= 1.0, "a share of 0 to 1");
  const double total = expected();
  const auto at_least = [](double count) { return std::max(static_cast<std::size_t>(count), kLeastChunks); };
  if (chunks_ < kGuessBelow && !is_cut) {
    const double each = std::max(kGuessedChunkBytes * (1.0 + ratio_), total / static_cast<double>(kGuessBelow));
    return at_least(limit() / each);
  }
  const double ratio = limit() / std::max(total, 1.0);
  const double fit = static_cast<double>(chunks_) * std::min(ratio, 1e6);
  if (!is_cut) return at_least(fit);
  const auto were = static_cast<double>(planned);
  if (ratio < 1.0) return at_least(std::min(fit, were));
  // Extrapolates to all wanted chunks: a moving viewer never has all of them.
  const double ratio_of_all = missing < kMostMissing ? ratio * (1.0 - missing) : 1.0;
  return at_least(were * std::clamp(ratio_of_all, 1.0, kGrows));
}

}  // namespace quoin::stream
