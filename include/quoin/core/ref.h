#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin {

/// Counts the owners of an object that is shared until it is written: derive from it, own by Ref. A copy of the object
/// has owners of its own.
class RefCounted {
 public:
  RefCounted() = default;
  RefCounted(const RefCounted&) {}
  RefCounted& operator=(const RefCounted&) { return *this; }

 protected:
  ~RefCounted() = default;

 private:
  template <class T>
  friend class Ref;
  mutable std::atomic<std::uint32_t> owners_{0};
};

/// One of the owners of a T, which derives from RefCounted; the last one destroys it. Null by default.
///
/// Requires: `*` and `->` are of one that is not null; this is not checked.
/// Copy on write: what `is_shared` is not to be changed; `make_own` puts a copy in its place.
/// Threads: owners of one object may come and go on several threads at once, each Ref by itself on one.
template <class T>
class Ref {
 public:
  Ref() noexcept = default;
  Ref(std::nullptr_t) noexcept {}
  /// Owns an object that has no owner yet, or shares it with its owners.
  explicit Ref(T* object) noexcept : object_(object) { acquire(); }
  Ref(const Ref& other) noexcept : object_(other.object_) { acquire(); }
  Ref(Ref&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Ref& operator=(const Ref& other) noexcept {
    if (this != &other) Ref(other).swap(*this);
    return *this;
  }
  Ref& operator=(Ref&& other) noexcept {
    Ref(std::move(other)).swap(*this);
    return *this;
  }
  ~Ref() { reset(); }

  void reset() noexcept {
    T* object = std::exchange(object_, nullptr);
    // Whoever is last sees what the others did before they went.
    if (object != nullptr && object->owners_.fetch_sub(1, std::memory_order_acq_rel) == 1) delete object;
  }
  void swap(Ref& other) noexcept { std::swap(object_, other.object_); }

  [[nodiscard]] T* get() const { return object_; }
  T* operator->() const { return object_; }
  T& operator*() const { return *object_; }
  bool operator==(const Ref& other) const = default;
  bool operator==(std::nullptr_t) const { return object_ == nullptr; }

  /// Whether there are other owners. Requires: it is not null.
  [[nodiscard]] bool is_shared() const {
    QUOIN_ASSERT(object_ != nullptr, "there is an object");
    return object_->owners_.load(std::memory_order_acquire) != 1;
  }
  /// Copies what it shares; then it is the only owner. Requires: it is not null.
  void make_own() {
    if (is_shared()) *this = Ref(new T(*object_));
  }

 private:
  void acquire() const noexcept {
    if (object_ != nullptr) object_->owners_.fetch_add(1, std::memory_order_relaxed);
  }

  T* object_ = nullptr;
};

template <class T, class... Arguments>
[[nodiscard]] Ref<T> make_ref(Arguments&&... arguments) {
  return Ref<T>(new T(std::forward<Arguments>(arguments)...));
}

}  // namespace quoin
