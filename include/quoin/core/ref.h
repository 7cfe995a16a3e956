#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <quoin/core/assert.h>

namespace [[gnu::visibility("default")]] quoin {

/// Base class that counts the owners of a copy-on-write object; owners hold it by Ref. A copy of the object starts
/// without owners.
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

/// A reference-counted pointer to a T, which derives from RefCounted. The last owner destroys the object. Null by
/// default.
///
/// Requires: `*` and `->` are used only if the pointer is not null.
/// Sharing: do not change an object while `is_shared` is true. Call `make_own` first, which replaces it with a copy.
/// Threads: several threads may add and release owners of one object at once. Use each Ref on one thread at a time.
template <class T>
class Ref {
 public:
  Ref() noexcept = default;
  Ref(std::nullptr_t) noexcept {}
  /// Becomes an owner of the object, alone or together with its existing owners.
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
    // The acquire-release order lets the last owner see the writes of all other owners before it deletes the object.
    if (object != nullptr && object->owners_.fetch_sub(1, std::memory_order_acq_rel) == 1) delete object;
  }
  void swap(Ref& other) noexcept { std::swap(object_, other.object_); }

  [[nodiscard]] T* get() const { return object_; }
  T* operator->() const {
    QUOIN_ASSERT(object_ != nullptr, "there is an object");
    return object_;
  }
  T& operator*() const {
    QUOIN_ASSERT(object_ != nullptr, "there is an object");
    return *object_;
  }
  bool operator==(const Ref& other) const = default;
  bool operator==(std::nullptr_t) const { return object_ == nullptr; }

  /// Returns true if the object has other owners. Requires: not null.
  [[nodiscard]] bool is_shared() const {
    QUOIN_ASSERT(object_ != nullptr, "there is an object");
    return object_->owners_.load(std::memory_order_acquire) != 1;
  }
  /// Replaces a shared object with a copy, so that this is its only owner. Does nothing if the object is not shared.
  /// Requires: not null.
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
