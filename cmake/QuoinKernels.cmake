# A kernel is one source, x.cpp, compiled once for each instruction set and chosen at run time: x.cpp itself with the
# build's own flags; x_avx2.cpp and x_avx512.cpp of the build folder, which include it, with those below. The last two
# define everything except the kernel, a constant, with internal linkage. Otherwise a linker might use one of their
# inline functions in the whole program, which would then fail on machines without the instructions. tests/kernels
# checks the objects.

set(quoin_avx2_flags -mavx2 -mbmi -mbmi2 -mpopcnt)
set(quoin_avx512_flags ${quoin_avx2_flags} -mavx512f -mavx512bw -mavx512dq -mavx512vl)

if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND NOT MSVC)
  set(quoin_x86_kernels TRUE)
else()
  set(quoin_x86_kernels FALSE)
endif()

# Usage: quoin_kernel(src/FOLDER/x [FLAG...]), with additional flags for AVX-512. Appends the sources that it writes to
# quoin_sources. The files of the build folder are written only if they change.
function(quoin_kernel stem)
  # Wide vectors never cross a call.
  set(common -Wno-psabi -fno-trapping-math)
  if(QUOIN_CHECKED)  # the other sources then have -O1
    list(APPEND common $<$<CONFIG:Release>:-O3>)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC stops inlining when a source has grown by a share of its size. So code for packets made single rays slower.
    list(APPEND common --param=large-unit-insns=100000)
  endif()
  set_source_files_properties("${stem}.cpp" PROPERTIES COMPILE_OPTIONS "${common}" SKIP_PRECOMPILE_HEADERS ON)
  if(NOT quoin_x86_kernels)
    return()
  endif()
  # Unoptimised, they would contain standard library functions that the linker might use elsewhere.
  list(APPEND common $<$<NOT:$<CONFIG:Release>>:-O2>)
  set(avx2_options ${common} ${quoin_avx2_flags})
  set(avx2_definitions QUOIN_KERNEL_AVX2)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC 12's own header reads a value that is undefined on purpose (GCC bug 105593).
    list(APPEND common -Wno-uninitialized -Wno-maybe-uninitialized)
  endif()
  set(avx512_options ${common} ${quoin_avx512_flags} ${ARGN})
  set(avx512_definitions QUOIN_KERNEL_AVX2 QUOIN_KERNEL_AVX512)
  cmake_path(RELATIVE_PATH stem BASE_DIRECTORY src OUTPUT_VARIABLE included)
  foreach(set avx2 avx512)
    set(source "${PROJECT_BINARY_DIR}/kernels/${stem}_${set}.cpp")
    file(CONFIGURE OUTPUT "${source}"
      CONTENT "#include \"${included}.cpp\"  // NOLINT(bugprone-suspicious-include)\n")
    set_source_files_properties("${source}" PROPERTIES COMPILE_OPTIONS "${${set}_options}"
      COMPILE_DEFINITIONS "${${set}_definitions}" SKIP_PRECOMPILE_HEADERS ON)
    list(APPEND quoin_sources "${source}")
  endforeach()
  set(quoin_sources "${quoin_sources}" PARENT_SCOPE)
endfunction()
