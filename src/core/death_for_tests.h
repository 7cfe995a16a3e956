#pragma once

#include <gtest/gtest.h>
#include <quoin/core/assert.h>

/// Expects that `statement` breaks a `Requires:` whose condition or message matches `pattern`. Skips the test, visibly,
/// in builds that do not check.
#if QUOIN_ASSERT_ENABLED
#define QUOIN_EXPECT_MISTAKE(statement, pattern) EXPECT_DEATH(statement, pattern)
#else
#define QUOIN_EXPECT_MISTAKE(statement, pattern) GTEST_SKIP() << "this build does not check (QUOIN_CHECKED)"
#endif
