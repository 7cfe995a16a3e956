// Functions missing from the C and C++ libraries for WebAssembly: exceptions and allocation.
//
// These libraries are built without exceptions, so nothing can be caught. An exception ends the instance: JavaScript
// throws an Error with the exception's text through it, and the package starts a fresh instance. Exceptions occur only
// if memory runs out or a library throws, for example for invalid JSON.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <new>
#include <typeinfo>

#include <wasm_simd128.h>

extern "C" [[noreturn]] __attribute__((import_module("quoin"), import_name("fail"))) void quoin_web_fail(
    const char* text);

namespace {

// Classes with one base class, as the Itanium ABI lays their type_info out.
struct SingleBase {
  const void* table;
  const char* name;
  const std::type_info* base;
};

bool is_exception(const std::type_info& type) {
  class Derived : public std::exception {};
  if (type == typeid(std::exception)) return true;
  // All type_infos of one kind share a virtual table.
  const void* const table_of_single = *reinterpret_cast<const void* const*>(&typeid(Derived));
  const auto& layout = reinterpret_cast<const SingleBase&>(type);
  return layout.table == table_of_single && is_exception(*layout.base);
}

[[noreturn]] void out_of_memory() {
  quoin_web_fail("out of memory");
}

void* allocate(std::size_t bytes, std::size_t alignment) {
  void* const found = alignment == 0 ? std::malloc(bytes) : std::aligned_alloc(alignment, bytes);
  if (found == nullptr && bytes > 0) out_of_memory();
  return found;
}

}  // namespace

extern "C" {

// The version in wasi-libc compares single bytes.
int memcmp(const void* left, const void* right, std::size_t bytes) {
  const auto* a = static_cast<const unsigned char*>(left);
  const auto* b = static_cast<const unsigned char*>(right);
  constexpr std::size_t kStep = sizeof(v128_t);
  for (; bytes >= kStep; bytes -= kStep, a += kStep, b += kStep) {
    if (!wasm_i8x16_all_true(wasm_i8x16_eq(wasm_v128_load(a), wasm_v128_load(b)))) break;
  }
  for (; bytes > 0; --bytes, ++a, ++b) {
    if (*a != *b) return *a < *b ? -1 : 1;
  }
  return 0;
}

void* __cxa_allocate_exception(std::size_t bytes) {
  return allocate(bytes, 0);
}

[[noreturn]] void __cxa_throw(void* thrown, std::type_info* type, void (* /*end*/)(void*)) {
  if (is_exception(*type)) quoin_web_fail(static_cast<const std::exception*>(thrown)->what());
  quoin_web_fail(type->name());
}

// Never reached: no handler is ever entered.
void* __cxa_begin_catch(void* thrown) noexcept {
  return thrown;
}
void __cxa_end_catch() {}
void __cxa_free_exception(void* thrown) noexcept {
  std::free(thrown);
}
[[noreturn]] void __cxa_rethrow() {
  std::abort();
}

// The instance, with its only thread, is discarded as a whole, so destructors need not run.
int __cxa_thread_atexit(void (* /*end*/)(void*), void* /*object*/, void* /*library*/) {
  return 0;
}

}  // extern "C"

void* operator new(std::size_t bytes) {
  return allocate(bytes == 0 ? 1 : bytes, 0);
}
void* operator new[](std::size_t bytes) {
  return allocate(bytes == 0 ? 1 : bytes, 0);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  const auto step = static_cast<std::size_t>(alignment);
  return allocate((bytes + step - 1) / step * step + (bytes == 0 ? step : 0), step);
}
