# Compiler settings that every Quoin target shares.

if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
set(CMAKE_CXX_EXTENSIONS OFF)
# Hides all names, also those of private headers in tests. Public headers declare theirs in
# `namespace [[gnu::visibility("default")]] quoin`.
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)

find_program(QUOIN_CCACHE ccache)
if(QUOIN_CCACHE AND PROJECT_IS_TOP_LEVEL)
  # Needed for ccache to cache sources with precompiled headers.
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${QUOIN_CCACHE}")
endif()

# Precompiles the headers that almost every source includes, once per target: this halves compile time. `./dev nightly`
# builds without, to check that headers are self-contained. Sources with their own flags are excluded.
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

# Uses the precompiled headers of another target that has the same compiler options.
function(quoin_share_precompiled target owner)
  if(QUOIN_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} REUSE_FROM ${owner})
    if(QUOIN_CCACHE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(${target} PRIVATE -fpch-preprocess)
    endif()
  endif()
endfunction()

# Compiles the sources of a folder together, at most nine at a time: a third of compile time is spent on headers and
# templates that each source would parse and instantiate separately. Names in a folder's anonymous namespaces must
# therefore differ. Sources with their own definitions or flags are excluded.
# ACROSS takes the sources of all folders for those of one.
# Usage: quoin_compile_together(TARGET [ACROSS] [ONLY FOLDER...] [EXCEPT FOLDER...]); ONLY includes folders below, EXCEPT
# does not.
option(QUOIN_COMPILE_TOGETHER "Compile sources of a folder together" ${PROJECT_IS_TOP_LEVEL})
function(quoin_compile_together target)
  if(NOT QUOIN_COMPILE_TOGETHER)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 chosen "ACROSS" "" "ONLY;EXCEPT")
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC takes the sources for headers, in which members must not be of types of anonymous namespaces.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  list(SORT sources)
  set(folders)
  list(TRANSFORM chosen_ONLY REPLACE "(.+)" "^\\1(/|$)" OUTPUT_VARIABLE only)
  list(JOIN only "|" only)
  list(FILTER sources EXCLUDE REGEX "^\\$<")  # objects of other targets
  foreach(source ${sources})
    get_source_file_property(options "${source}" COMPILE_OPTIONS)
    if(options)  # then CMake compiles it alone
      continue()
    endif()
    cmake_path(ABSOLUTE_PATH source NORMALIZE)
    cmake_path(GET source PARENT_PATH folder)
    cmake_path(RELATIVE_PATH folder BASE_DIRECTORY "${PROJECT_SOURCE_DIR}")
    if(folder IN_LIST chosen_EXCEPT)
      continue()
    endif()
    if(chosen_ONLY AND NOT folder MATCHES "${only}")
      continue()
    endif()
    if(chosen_ACROSS)
      set(folder ${target})
    endif()
    string(MAKE_C_IDENTIFIER "${folder}" folder)
    list(APPEND folders ${folder})
    list(APPEND sources_of_${folder} "${source}")
  endforeach()
  list(REMOVE_DUPLICATES folders)
  foreach(folder ${folders})
    list(LENGTH sources_of_${folder} count)
    if(count EQUAL 1)
      continue()
    endif()
    math(EXPR groups "(${count} + 8) / 9")
    set(index 0)
    foreach(source ${sources_of_${folder}})
      math(EXPR group "${index} * ${groups} / ${count}")
      set_source_files_properties("${source}" PROPERTIES UNITY_GROUP ${folder}_${group})
      math(EXPR index "${index} + 1")
    endforeach()
  endforeach()
endfunction()

# Of programs whose fast code is in the library. In checked builds, whose programs only run tests, optimising takes a
# fifth of their compile time.
set(quoin_app_optimisation -O1)
if(QUOIN_CHECKED)
  set(quoin_app_optimisation -O0)
endif()

function(quoin_compile_options target)
  if(QUOIN_CHECKED)
    # Checked builds are compiled to be tested: without the more costly passes, a source takes a third less time.
    # Kernels keep -O3.
    target_compile_options(${target} PRIVATE "$<$<CONFIG:Release>:-O1>")
  endif()
  # No contraction: the same bytes from every instruction set.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
    -ffp-contract=off)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Collecting garbage from 128 MB on, as GCC does, takes a tenth of the time of large sources.
    target_compile_options(${target} PRIVATE "SHELL:--param ggc-min-heapsize=400000")
  endif()
  # Under sanitizers GCC 12 warns about its own standard library: regular expressions and strings.
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

# A shared library exports only the names that public headers declare, without instances of the standard library's
# templates. `./dev abi` compares the names with committed lists.
set(quoin_version_script "${CMAKE_CURRENT_LIST_DIR}/quoin_cpp.map")
function(quoin_export_names target)
  # Without a DEFINE_SYMBOL, both libraries have the same definitions, and share precompiled headers.
  set_target_properties(${target} PROPERTIES DEFINE_SYMBOL "")
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "SHARED_LIBRARY")
    target_link_options(${target} PRIVATE "LINKER:--version-script=${quoin_version_script}")
    set_target_properties(${target} PROPERTIES LINK_DEPENDS "${quoin_version_script}")
  endif()
endfunction()
