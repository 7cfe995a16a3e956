#pragma once

// Part of the layout of Grid and DensityGrid, of no use to callers.

#include <cstdint>

namespace quoin {

class EditNotices;

/// By it a container tells the one that holds it (a grid its scene) that it was edited. It stays where it is when the
/// container's content is moved.
class EditNotice {
 public:
  EditNotice() = default;
  EditNotice(const EditNotice&) {}
  EditNotice& operator=(const EditNotice& other) {
    if (this != &other) give();
    return *this;
  }
  ~EditNotice() = default;

  /// After every edit; costs something the first time since it was last taken.
  void give() {
    if (!is_given_) [[unlikely]]
      give_first();
  }

 private:
  friend class EditNotices;
  void give_first();

  EditNotices* to_ = nullptr;
  std::uint32_t index_ = 0;
  bool is_given_ = true;
};

}  // namespace quoin
