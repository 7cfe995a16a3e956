#include <quoin/core/function_ref.h>

#include <gtest/gtest.h>

namespace quoin {
namespace {

int twice(int i) {
  return 2 * i;
}

int call(FunctionRef<int(int)> function, int argument) {
  return function(argument);
}

TEST(FunctionRef, AcceptsFunctionsAndFunctionPointers) {
  EXPECT_EQ(call(twice, 21), 42);
  EXPECT_EQ(call(&twice, 4), 8);
  int (*pointer)(int) = twice;
  EXPECT_EQ(call(pointer, 5), 10);
}

TEST(FunctionRef, CallsOriginalInsteadOfCopy) {
  int calls = 0;
  auto counting = [&calls, seen = 0](int i) mutable {
    ++calls;
    seen += i;
    return seen;
  };
  const FunctionRef<int(int)> function = counting;
  EXPECT_EQ(function(1), 1);
  EXPECT_EQ(function(2), 3);
  EXPECT_EQ(counting(0), 3) << "the reference called this object";
  EXPECT_EQ(calls, 3);
}

TEST(FunctionRef, DropsUnusedReturnValue) {
  int sum = 0;
  const auto adding = [&](int i) { return sum += i; };
  const FunctionRef<void(int)> add = adding;
  add(3);
  add(4);
  EXPECT_EQ(sum, 7);
}

TEST(FunctionRef, ForwardsReferences) {
  int value = 1;
  const auto change = [](int& i) { i = 7; };
  const FunctionRef<void(int&)> function = change;
  function(value);
  EXPECT_EQ(value, 7);
}

}  // namespace
}  // namespace quoin
