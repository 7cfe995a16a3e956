#pragma once

#include <memory>
#include <type_traits>
#include <utility>

namespace [[gnu::visibility("default")]] quoin {

template <class Signature>
class FunctionRef;

/// A non-owning reference to a callable, also to a plain function. Use it for callback parameters. Never allocates.
/// Lifetime: the callable must outlive the reference.
template <class Result, class... Arguments>
class FunctionRef<Result(Arguments...)> {
 public:
  template <class Callable>
    requires(!std::is_same_v<std::remove_cvref_t<Callable>, FunctionRef> &&
             std::is_invocable_r_v<Result, Callable&, Arguments...>)
  FunctionRef(Callable&& callable) {  // NOLINT(bugprone-forwarding-reference-overload): never a FunctionRef, see above
    using Called = std::remove_reference_t<Callable>;
    if constexpr (std::is_function_v<Called>) {
      callable_.function = reinterpret_cast<void (*)()>(&callable);
      call_ = [](Place called, Arguments... arguments) -> Result {
        return static_cast<Result>(reinterpret_cast<Called*>(called.function)(std::forward<Arguments>(arguments)...));
      };
    } else {
      callable_.object = const_cast<void*>(static_cast<const void*>(std::addressof(callable)));
      call_ = [](Place called, Arguments... arguments) -> Result {
        return static_cast<Result>((*static_cast<Called*>(called.object))(std::forward<Arguments>(arguments)...));
      };
    }
  }

  Result operator()(Arguments... arguments) const { return call_(callable_, std::forward<Arguments>(arguments)...); }

 private:
  union Place {
    void* object;
    void (*function)();
  };

  Place callable_;
  Result (*call_)(Place, Arguments...);
};

}  // namespace quoin
