# Compiler settings that every Quoin target shares.

if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
set(CMAKE_CXX_EXTENSIONS OFF)

find_program(QUOIN_CCACHE ccache)
if(QUOIN_CCACHE AND PROJECT_IS_TOP_LEVEL)
  # Else it would keep nothing that was compiled with precompiled headers.
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${QUOIN_CCACHE}")
endif()

# What almost every source includes, parsed once a target: half of what compiling takes. `./dev nightly` builds without,
# so that headers go on standing by themselves. Sources with flags of their own are left out.
option(QUOIN_PRECOMPILED_HEADERS "Parse common headers once" ${PROJECT_IS_TOP_LEVEL})
function(quoin_precompile target)
  if(QUOIN_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <bit> <cmath> <cstdint> <cstring> <functional>
      <map> <memory> <optional> <random> <span> <string> <utility> <vector> <quoin/core/vec.h> <quoin/core/result.h>
      ${ARGN})
    if(QUOIN_CCACHE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(${target} PRIVATE -fpch-preprocess)
    endif()
  endif()
endfunction()

function(quoin_compile_options target)
  # No contraction: the same bytes from every instruction set.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
    -ffp-contract=off)
  # Under sanitizers GCC 12 warns of its own standard library: of regular expressions, of strings.
  if(QUOIN_WARNINGS_AS_ERRORS AND NOT QUOIN_SANITIZE)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(QUOIN_SANITIZE STREQUAL "address")
    target_compile_options(${target} PUBLIC -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=address,undefined)
  elseif(QUOIN_SANITIZE STREQUAL "thread")
    target_compile_options(${target} PUBLIC -fsanitize=thread -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=thread)
    target_compile_definitions(${target} PRIVATE QUOIN_PARALLEL_WITH_JTHREAD)
  endif()
endfunction()
